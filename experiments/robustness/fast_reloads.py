"""Fast reloads after slow pull-offs: how well the largest compression is known.

The stiff glass presses on what is left of the dent, which fades within a retardation time of the detachment. Each
history turns less than h0/2 beyond the indentation at which another simulation lost its contact, where that instant
matters most.
"""

from typing import Any

import numpy as np

from bem import (
    ConstantStress,
    Exponential,
    LennardJones,
    PiecewiseLinearProtocol,
    Scene,
    StandardLinearSolid,
    Trajectory,
    simulate,
)
from bem.accuracy import resolve_accuracy
from experiments.measurements.harness import Count, Jobs, Seed, in_parallel

LAWS = (ConstantStress(), Exponential(), LennardJones())
FINE = 6e-4
FARTHEST = -40.0
TEXT = "{missed} of {count} random histories miss {target:.2g} % at `{accuracy}`, by {worst:.2g} % at most"


def history(number: int, seed: int) -> tuple[Scene, PiecewiseLinearProtocol] | None:
    """Scene and protocol of a number; None where the contact is not lost."""
    generator = np.random.default_rng([seed, number])

    def between(low: float, high: float) -> float:
        return float(np.exp(generator.uniform(np.log(low), np.log(high))))

    tabor, ratio, peak = between(0.3, 7.0), between(0.01, 0.4), between(0.6, 20.0)
    scene = Scene(tabor, StandardLinearSolid(ratio), LAWS[number % len(LAWS)])
    start, speed = -2.0 - tabor, between(0.1, 30.0) * tabor
    instants = np.cumsum([0.0, (peak - start) / speed, between(0.01, 30.0)]).tolist()
    slow, fast, depths = between(0.01, 2.0) * tabor, between(100.0, 1e5) * tabor, [start, peak, peak]
    away = PiecewiseLinearProtocol([*instants, instants[-1] + (peak - FARTHEST) / slow], [*depths, FARTHEST])
    pulled = simulate(scene, away)
    lost = pulled.indentation[(pulled.contact_radius == 0.0) & (pulled.time > instants[-1])]
    if not lost.size:
        return None
    turn, again = float(lost[0]) - between(1e-3, 0.5), between(0.1, 20.0)
    instants.append(instants[-1] + (peak - turn) / slow)
    return scene, PiecewiseLinearProtocol([*instants, instants[-1] + (again - turn) / fast], [*depths, turn, again])


def compression(found: Trajectory, since: float) -> float:
    """Smallest force of the reload; NaN where it was not reached."""
    return float(np.min(found.force[found.time >= since])) if found.completed else np.nan


def reloaded(number: int, seed: int) -> dict[str, Any] | None:
    """Change of the largest compression under refinement, over it or 1, at two accuracies."""
    drawn = history(number, seed)
    if drawn is None:
        return None
    scene, path = drawn
    fine = compression(simulate(scene, path, FINE), path.times[-2])
    result: dict[str, Any] = {"law": type(scene.adhesion).__name__, "tabor": scene.tabor, "compression": fine}
    for accuracy in ("draft", "standard"):
        found = compression(simulate(scene, path, accuracy), path.times[-2])
        result[accuracy] = abs(found - fine) / max(abs(fine), 1.0)
    return result


def limits_text(fast_reloads: Any) -> str:
    """How many histories miss their target, and by how much, for docs/limits.md."""
    parts = []
    for accuracy in ("standard", "draft"):
        # NaN, null in the file, where the trajectory did not complete.
        errors = np.array([row[accuracy] for row in fast_reloads["histories"]], dtype=float)
        target = resolve_accuracy(accuracy).target
        missed, percents = np.sum(~(errors <= target)), (100.0 * target, 100.0 * np.nanmax(errors))
        parts.append(
            TEXT.format(missed=missed, count=len(errors), accuracy=accuracy, target=percents[0], worst=percents[1])
        )
    return "; ".join(parts)


def study_fast_reloads(*, count: Count = 200, seed: Seed = 5, jobs: Jobs = 1) -> dict[str, Any]:
    """Pull slowly until the contact is just lost, and press again fast."""
    found = in_parallel(reloaded, [(number, seed) for number in range(count)], jobs=jobs, label="histories")
    return {"histories": [row for row in found if row is not None]}
