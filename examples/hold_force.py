"""Hold a target pull force while the base drifts: a controller that looks ahead with a streamed surrogate.

The plant is the contact solver, advanced step by step (`bem.Contact`); a real machine would be measured instead. The
sphere has been pressed in, held and withdrawn to where it pulls. From then on its base drifts towards the half-space,
and the controller sees nothing but the measured force and its own commands.

Each tick it asks the surrogate what the force would be a little higher and a little lower (`snapshot`, `step`,
`restore`), takes the slope of force by indentation from that, and corrects the command by the measured error over that
slope, or over the slope its own moves met where that was steeper: too small a correction is repaired by the next tick,
too large a one makes the loop swing. What the moves do not explain, drift and relaxation, is averaged and countered.
The surrogate's own bias drops out; only its slope is used. The loop moves otherwise than the protocols of its training,
of which the surrogate warns; `main` says it once.

Run: `python examples/hold_force.py`.
"""

from __future__ import annotations

import argparse
import time
import warnings
from dataclasses import dataclass, field

import numpy as np

import surrogate
from bem import Contact, Scene, StandardLinearSolid
from surrogate.prediction.stream import Stream


@dataclass
class Plant:
    """The contact, seen as a machine sees it: move there until then, and read the force."""

    contact: Contact
    seconds: list[float] = field(default_factory=list)

    def move(self, instant: float, depth: float) -> float:
        """Move to an indentation at constant speed, arriving at the instant; return the force there.

        Raises:
            RuntimeError: the solver did not finish.
        """
        started = time.perf_counter()
        force = self.contact.advance(instant - self.contact.time, indentation=depth)
        self.seconds.append(time.perf_counter() - started)
        if not np.isfinite(force):
            raise RuntimeError(f"the plant stopped: {self.contact.status}")
        return force


@dataclass(frozen=True)
class Run:
    """What a run left behind: instants, measured forces, and commanded indentations of every tick."""

    time: np.ndarray
    force: np.ndarray
    command: np.ndarray
    plant_seconds: float
    control_seconds: float


def hold(
    model: surrogate.Surrogate,
    *,
    target: float = 1.0,
    drift_rate: float = 0.4,
    ticks: int = 60,
    interval: float = 0.05,
    tabor: float = 1.0,
    gain: float = 0.3,
    controlled: bool = True,
) -> Run:
    """Press in, hold, withdraw into the pull, then hold the target force for some ticks.

    Args:
        model: A causal surrogate.
        target: Force to hold, P / (pi R dgamma), tension positive.
        drift_rate: Speed of the base towards the half-space, which nobody tells the controller.
        ticks: Control ticks.
        interval: Time between ticks.
        tabor: Tabor parameter of plant and surrogate.
        gain: Share of the error corrected in one tick.
        controlled: Whether the loop is closed; otherwise the command stays where it was.
    """
    scene = Scene(tabor, StandardLinearSolid(modulus_ratio=0.1))
    peak, speed, dwell = 5.0, 5.0, 1.0
    start = -(np.pi ** (2 / 3)) * tabor
    onset = (peak - start) / speed
    plant = Plant(Contact(scene))
    stream = model.stream(scene)
    for instant in np.linspace(0.0, onset, 50):
        stream.step(instant, start + speed * instant, edge=instant == onset)
    for instant in onset + dwell * np.arange(1, 21) / 20:
        stream.step(instant, peak, edge=instant == onset + dwell)

    plant.move(onset, peak)
    instant, command = onset + dwell, peak
    measured = plant.move(instant, peak)
    while measured < target and command > start:
        instant, command = instant + interval, command - speed * interval
        stream.step(instant, command)
        measured = plant.move(instant, command)

    drift, seconds, met, unexplained = 0.0, 0.0, 0.0, 0.0
    rows = []
    for _ in range(ticks):
        started = time.perf_counter()
        before, moved = measured, 0.0
        if controlled:
            steepness = min(slope(stream, instant + interval, command), met)
            moved = float(np.clip((gain * (target - measured) - unexplained) / steepness, -0.3, 0.3))
            command += moved
        instant += interval
        stream.step(instant, command)
        seconds += time.perf_counter() - started
        drift += drift_rate * interval
        measured = plant.move(instant, command + drift)
        change = measured - before
        if controlled:
            if abs(moved) > 0.02:
                met += 0.3 * (np.clip((change - unexplained) / moved, -10.0, 0.0) - met)
            unexplained += 0.3 * (np.clip(change - steepness * moved, -0.5, 0.5) - unexplained)
        rows.append((instant, measured, command))
    return Run(*np.array(rows).T, plant_seconds=float(np.mean(plant.seconds)), control_seconds=seconds / ticks)


def slope(stream: Stream, instant: float, command: float, reach: float = 0.2) -> float:
    """Slope of force by indentation at the next tick, by looking ahead; pulling must lower the indentation."""
    now = stream.snapshot()
    forces = []
    for depth in (command - reach, command + reach):
        forces.append(stream.step(instant, depth))
        stream.restore(now)
    return min((forces[1] - forces[0]) / (2.0 * reach), -0.5)


def main() -> None:
    """Run with and without control, and say what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", default="M1-concat")
    parser.add_argument("--target", type=float, default=1.0)
    chosen = parser.parse_args()
    model = surrogate.load(chosen.model)
    warnings.simplefilter("ignore", surrogate.ExtrapolationWarning)
    print(f"The loop moves otherwise than the protocols that {chosen.model} was trained on; only its slope is used.")
    for controlled in (False, True):
        run = hold(model, target=chosen.target, controlled=controlled)
        late = run.force[len(run.force) // 2 :]
        print(
            f"{'with' if controlled else 'without'} control: force {late.mean():.3f} "
            f"(target {chosen.target:g}, largest error {np.abs(late - chosen.target).max():.3f}), "
            f"control {1e3 * run.control_seconds:.2f} ms, plant {1e3 * run.plant_seconds:.2f} ms a tick"
        )


if __name__ == "__main__":
    main()
