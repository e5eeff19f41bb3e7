"""What `surrogate predict` was asked and found: trajectories, and their errors against the solver, in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

USUAL_MODULUS_RATIO = 0.1
"""Modulus ratio of the published data set, where neither a model nor the user says another."""


@dataclass
class Answer:
    """One prediction, and what the solver says once it is asked.

    Args:
        scene: The scene that the solver is asked about.
        protocol: The protocol likewise.
        found: Trajectory at measurement steps.
        written: What is written: the same, or the prediction at the points of a given history.
        simulated: The solver's trajectory.
        check: Errors against it, and the materials of both.
        solver_force: Its force where written.
    """

    scene: Any
    protocol: Any
    found: Any
    written: Any
    simulated: Any = None
    check: dict[str, Any] | None = None
    solver_force: np.ndarray | None = None

    def compare(self, model_ratio: float | None) -> None:
        """Ask the solver; `model_ratio` is the model's only modulus ratio, `None` if it knows many, or says none."""
        from bem import simulate
        from surrogate.cli.comparison import solver_errors, solver_force

        self.simulated = simulate(self.scene, self.protocol)
        own = model_ratio if self.found.modulus_ratio is None else self.found.modulus_ratio
        ratios = {"modulus_ratio": self.scene.material.modulus_ratio, "model_modulus_ratio": own}
        self.check = solver_errors(self.found, self.simulated) | ratios
        self.solver_force = solver_force(self.written.time, self.simulated)


def readable(number: int, found: Any, check: dict[str, Any] | None) -> str:
    """Return one trajectory in a few lines: results, band, and errors where the solver was asked."""
    interval = band = ""
    if found.pull_off_interval is not None:
        band = (
            f", modulus ratio {found.modulus_ratio:g}\n  no band: outside the ranges that {found.model} was trained on"
        )
    if band and not found.extrapolated:
        low, high = found.pull_off_interval
        interval = f" ({100 * found.coverage:g} % interval {low:.5g} to {high:.5g})"
        half = sorted(0.5 * (found.force_upper - found.force_lower))
        band = (
            f", modulus ratio {found.modulus_ratio:g}\n  {100 * found.coverage:g} % band of the force at each step: "
            f"half-width {half[len(half) // 2]:.3g} in the median, {half[-1]:.3g} at most; --out and --json give it"
        )
    line = (
        f"trajectory {number}: pull-off force {found.pull_off_force:.5g}{interval} at time {found.pull_off_time:.5g}, "
        f"hysteresis {found.hysteresis:.5g}, max compression {found.max_compression:.5g}"
    )
    if found.work() < 0.0:
        line += f", work {found.work():.5g}: the contact gave energy back; not dissipation"
    if found.completed and not found.detached:
        line += ", still attached at the end: the pull-off force is the largest so far"
    line += band
    if check is None:
        return line
    from bem.trajectory import is_completed

    if not is_completed(check["solver_status"]):
        return f"{line}\n  against the solver: nothing to compare, it did not finish: {check['solver_status']}"
    other = check["model_modulus_ratio"] not in (None, check["modulus_ratio"])
    material = f" of another material (modulus ratio {check['modulus_ratio']:g})" if other else ""
    return (
        f"{line}\n  against the solver{material}: pull-off force off by {check['pull_off_percent']:.2f} % "
        f"({check['pull_off_on_steps_percent']:.2f} % on the measurement steps), hysteresis by "
        f"{check['hysteresis_percent']:.2f} % ({check['hysteresis_on_steps_percent']:.2f} %), "
        f"force by {100 * check['force_rms']:.2f} % of its range (rms)"
    )
