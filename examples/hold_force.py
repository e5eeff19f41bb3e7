"""Hold a target pull force while the base drifts: a controller that looks ahead with the solver.

The plant is a contact that is advanced step by step (`bem.Contact`); a real machine would be measured instead. The
sphere has been pressed in, held and withdrawn to where it pulls. From then on its base drifts towards the half-space,
and the controller sees nothing but the measured force and its own commands.

The controller follows its own commands with a second contact, of a solid that it knows only roughly. Each tick it asks
copies of it what the force would be a little higher and a little lower, takes the slope of force by indentation from
that, and corrects the command by the measured error over that slope, or over the slope its own moves met where that was
steeper: too small a correction is repaired by the next tick, too large a one makes the loop swing. What the moves do
not explain, drift and relaxation, is averaged and countered.

Run: `python examples/hold_force.py`.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

from bem import Contact, Scene, StandardLinearSolid

PLANT = Scene(1.0, StandardLinearSolid(modulus_ratio=0.1))
ASSUMED = Scene(1.0, StandardLinearSolid(modulus_ratio=0.2))
"""The contact as the controller knows it."""


@dataclass(frozen=True)
class Run:
    """What a run left behind: instants, measured forces, and commanded indentations of every tick."""

    time: np.ndarray
    force: np.ndarray
    command: np.ndarray


def moved(contact: Contact, duration: float, depth: float) -> float:
    """Move to an indentation at constant speed; return the force there.

    Raises:
        RuntimeError: the solver did not finish.
    """
    force = contact.advance(duration, indentation=depth)
    if not np.isfinite(force):
        raise RuntimeError(f"the contact stopped: {contact.status}")
    return force


def hold(
    *,
    target: float = 1.0,
    drift_rate: float = 0.4,
    ticks: int = 60,
    interval: float = 0.05,
    gain: float = 0.3,
    controlled: bool = True,
) -> Run:
    """Press in, hold, withdraw into the pull, then hold the target force for some ticks.

    Args:
        target: Force to hold, P / (pi R dgamma), tension positive.
        drift_rate: Speed of the base towards the half-space, which nobody tells the controller.
        ticks: Control ticks.
        interval: Time between ticks.
        gain: Share of the error corrected in one tick.
        controlled: Whether the loop is closed; otherwise the command stays where it was.
    """
    peak, speed, dwell = 5.0, 5.0, 1.0
    plant, model = Contact(PLANT), Contact(ASSUMED)
    start, command = plant.indentation, peak
    for contact in (plant, model):
        moved(contact, (peak - start) / speed, peak)
        moved(contact, dwell, peak)
    while plant.force < target and command > start:
        command -= speed * interval
        for contact in (plant, model):
            moved(contact, interval, command)

    drift, met, unexplained = 0.0, 0.0, 0.0
    rows = []
    for _ in range(ticks):
        before, move = plant.force, 0.0
        if controlled:
            steepness = min(slope(model, interval, command), met)
            move = float(np.clip((gain * (target - before) - unexplained) / steepness, -0.3, 0.3))
            command += move
        moved(model, interval, command)
        drift += drift_rate * interval
        change = moved(plant, interval, command + drift) - before
        if controlled:
            if abs(move) > 0.02:
                met += 0.3 * (np.clip((change - unexplained) / move, -10.0, 0.0) - met)
            unexplained += 0.3 * (np.clip(change - steepness * move, -0.5, 0.5) - unexplained)
        rows.append((plant.time, plant.force, command))
    return Run(*np.array(rows).T)


def slope(model: Contact, interval: float, command: float, reach: float = 0.2) -> float:
    """Slope of force by indentation at the next tick, by looking ahead; pulling must lower the indentation."""
    low, high = (moved(model.copy(), interval, depth) for depth in (command - reach, command + reach))
    return min((high - low) / (2.0 * reach), -0.5)


def main() -> None:
    """Run with and without control, and say what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--target", type=float, default=1.0)
    target = parser.parse_args().target
    for controlled in (False, True):
        run = hold(target=target, controlled=controlled)
        late = run.force[len(run.force) // 2 :]
        print(
            f"{'with' if controlled else 'without'} control: force {late.mean():.3f} "
            f"(target {target:g}, largest error {np.abs(late - target).max():.3f})"
        )


if __name__ == "__main__":
    main()
