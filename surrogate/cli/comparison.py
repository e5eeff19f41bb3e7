"""Predictions of `surrogate predict`, and their comparison with the solver: in words, in numbers and in a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.tabular import UNITS
from bem._support.wording import plain_table
from bem.results.trajectory import is_completed
from surrogate.trajectory import INTERVALS

MOST_DRAWN = 12
QUANTITIES = ("pull_off_force", "pull_off_time", "hysteresis", "max_compression")
WORDS = ("pull-off force", "pull-off time", "hysteresis", "largest compression")


@dataclass
class Answer:
    """One prediction, and what the solver says once it is asked.

    Args:
        scene: The scene that the solver is asked about.
        protocol: The protocol likewise.
        predicted: The predicted trajectory.
        simulated: The solver's trajectory.
        check: Errors against it, and the materials of both.
        solver_force: Its force at the steps of the prediction.
    """

    scene: Any
    protocol: Any
    predicted: Any
    simulated: Any = None
    check: dict[str, Any] | None = None
    solver_force: np.ndarray | None = None

    def compare(self, model_ratio: float | None) -> None:
        """Ask the solver; `model_ratio` is the model's only modulus ratio, `None` if it knows many, or says none."""
        from bem import simulate

        self.simulated = simulate(self.scene, self.protocol)
        ratios = {"modulus_ratio": self.scene.material.modulus_ratio, "model_modulus_ratio": model_ratio}
        self.check = solver_errors(self.predicted, self.simulated) | ratios
        self.solver_force = solver_force(self.predicted.time, self.simulated)


def readable(number: int, curve: Any, check: dict[str, Any] | None) -> str:
    """Return one trajectory as a table with units, then band, and errors where the solver was asked."""
    intervals, notes = {}, []
    if curve.pull_off_interval is not None:
        notes = [f"no band: outside the training of {curve.model}"]
        if not curve.extrapolated:
            intervals = {name: _interval(*getattr(curve, name)) for name in INTERVALS}
            half = sorted(0.5 * (curve.force_upper - curve.force_lower))
            notes = [
                f"{100 * curve.coverage:g} % band of the force at each step: half-width {half[len(half) // 2]:.3g} in "
                f"the median, {half[-1]:.3g} at most; --out and --json give it"
            ]
    if not curve.completed:
        return f"trajectory {number}: {curve.status}"
    rows = [
        ["quantity (tension positive)", "value", f"{100 * curve.coverage:g} % interval" if intervals else "", "unit"]
    ]
    for label, name, interval in zip(WORDS, QUANTITIES, (*INTERVALS, ""), strict=True):
        rows.append([label, f"{getattr(curve, name):.5g}", intervals.get(interval, ""), UNITS[name]])
    if curve.work() < 0.0:
        notes.append(f"work {curve.work():.5g}: the contact gave energy back; not dissipation")
    if not curve.detached:
        notes.append("still attached at the end: the pull-off force is the largest so far")
    if check is not None:
        notes.append(check_words(check))
    return "\n".join([plain_table(rows if intervals else [row[:2] + row[3:] for row in rows]), "", *notes]).rstrip()


def _interval(low: float, high: float) -> str:
    """An interval with as many digits as its ends need to differ."""
    digits = next((digits for digits in range(5, 10) if f"{low:.{digits}g}" != f"{high:.{digits}g}"), 5)
    return f"{low:.{digits}g} to {high:.{digits}g}"


def check_words(check: dict[str, Any]) -> str:
    """Return the errors of a prediction against the solver in a sentence."""
    if not is_completed(check["solver_status"]):
        return f"against the solver: nothing to compare, it did not finish: {check['solver_status']}"
    other_material = check["model_modulus_ratio"] not in (None, check["modulus_ratio"])
    material = f" of another material (modulus ratio {check['modulus_ratio']:g})" if other_material else ""
    return (
        f"against the solver{material}: pull-off force off by {check['pull_off_percent']:.2f} % "
        f"({check['pull_off_on_steps_percent']:.2f} % on the measurement steps), hysteresis by "
        f"{check['hysteresis_percent']:.2f} % ({check['hysteresis_on_steps_percent']:.2f} %), "
        f"force by {100 * check['force_rms']:.2f} % of its range (rms)"
    )


def solver_force(times: np.ndarray, simulated: Any) -> np.ndarray:
    """Return the force of a `bem.Trajectory` at times of its protocol; NaN after the end of an unfinished one."""
    force = np.full(times.shape, np.nan)
    if simulated.time.size == 0:
        return force
    last = simulated.time[-1]
    # The times of the last step may differ by rounding.
    reached = times <= (np.inf if simulated.completed else last)
    force[reached] = simulated.at(np.clip(times[reached], simulated.time[0], last))
    return force


def solver_errors(predicted: Any, simulated: Any) -> dict[str, Any]:
    """Compare a `PredictedTrajectory` with the `bem.Trajectory` of the same protocol.

    Returns:
        `solver_status`, the status of the simulation, and the errors by name. Those of pull-off force and hysteresis
        are in percent, against the value of the solver and against that of the solver's force at the measurement steps
        (`_on_steps`); they differ where a peak is narrower than a step. `force_rms` is the root mean square difference
        of the force as a fraction of its range. Errors are NaN if the simulation did not finish or the
        prediction is not finite.
    """
    force = np.where(simulated.completed and predicted.completed, solver_force(predicted.time, simulated), np.nan)
    on_steps = force[predicted.unloading].max() if predicted.unloading.any() else np.nan
    # Of several cycles, the last unloading.
    begin = predicted.time[predicted.unloading].min(initial=np.inf)
    last = simulated.unloading & (simulated.time >= begin) & simulated.completed
    pull_off = simulated.force[last].max() if last.any() else np.nan
    area = abs(float(np.trapezoid(force, predicted.indentation)))
    return {
        "solver_status": simulated.status,
        "pull_off_percent": _percent(predicted.pull_off_force, pull_off),
        "pull_off_on_steps_percent": _percent(predicted.pull_off_force, on_steps),
        "hysteresis_percent": _percent(predicted.hysteresis, simulated.hysteresis),
        "hysteresis_on_steps_percent": _percent(predicted.hysteresis, area),
        "force_rms": float(np.sqrt(np.mean((predicted.force - force) ** 2)) / np.ptp(force)),
    }


def plot_predictions(
    path: Path, predicted: Sequence[Any], simulated: Sequence[Any] | None = None, title: str = ""
) -> None:
    """Draw force over time and over indentation as `bem.Trajectory.plot` does, and dashed lines for the solver.

    Each phase has a width of its own, unless the phases of the trajectories differ.

    Args:
        path: Image file; the suffix determines the format.
        predicted: Predicted trajectories; the first `MOST_DRAWN` are drawn.
        simulated: Trajectories of the solver, in the same order.
        title: Of the figure.
    """
    from bem.results.plots import COLOURS, draw_curve, labels_of, line_of, top_of

    shown = predicted[:MOST_DRAWN]
    # The first prediction has the colour of its tool, several are told apart by those of the families.
    tools = [shown[0].model.partition("-")[0], *(f"M{number}" for number in range(1, 7))]
    colours = [COLOURS[tool] for tool in dict.fromkeys(tools) if tool in COLOURS]
    lines = []
    for number, prediction in enumerate(shown):
        line = replace(line_of(prediction), colour=colours[number % len(colours)])
        if len(shown) > 1:
            line = replace(line, label=f"{prediction.model}, trajectory {number}" if number < len(colours) else "")
        lines.append(replace(line, coverage=None) if number else line)
        if simulated and simulated[number].time.size:
            lines.append(replace(line_of(simulated[number]), label="" if number else "solver", dashed=True))
    corners = shown[0].corners
    if any(not np.array_equal(curve.corners, corners) for curve in shown):
        corners = np.array([min(curve.time[0] for curve in shown), max(curve.time[-1] for curve in shown)])
    figure = draw_curve(lines, corners, labels_of(corners), top=top_of(shown[0]) if len(shown) == 1 else None)
    if title:
        figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=150)


def _percent(value: float, reference: float) -> float:
    return float(100.0 * abs(value - reference) / abs(reference)) if reference else float("nan")
