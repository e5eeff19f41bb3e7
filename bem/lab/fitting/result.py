"""What a fit found: model, values, 95 % intervals, the ladder, and in words what the curve does not determine."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from bem._support.text_files import plain
from bem._support.validation import FloatArray
from bem.lab.curve import ForceCurve
from bem.lab.fitting.measurement import prescribed_path
from bem.lab.fitting.regression import ADEQUATE, CONFIDENCE, Fitted
from bem.lab.models import LADDER, LINEAR, UNITS, Path
from bem.lab.setup import Setup
from bem.lab.units import readable

_LOOSE = {"logarithm": np.log(2.0), "logit": 2.0}
_TIED = 0.98  # correlation from which two parameters are said to trade off
_STIFFEST, _LARGEST = 5e11, 1e-2  # Pa, and m of a radius
_SHOWN = 0.98  # share of the residuals that sets the limits of their picture


class FitError(RuntimeError):
    """A fit that did not converge."""


@dataclass(frozen=True)
class Rung:
    """One model of the ladder that was fitted."""

    model: str
    values: dict[str, float]
    misfit: float
    """Root mean square of the residuals over the noise."""
    seconds: float
    """Processor time."""


@dataclass(frozen=True, eq=False)
class FitResult:
    """A fitted force curve, in SI units and tension positive."""

    model: str
    """Name of the model in `bem.lab.models.LADDER`."""
    adequate: bool
    """Whether it describes the curve; else no interval holds, and all are infinite."""
    values: dict[str, float]
    """Each free parameter."""
    intervals: dict[str, tuple[float, float]]
    """Its 95 % interval; infinite where the curve does not determine it."""
    correlations: dict[str, dict[str, float]]
    """Between each pair, of the parameters as they are searched (logarithms of positive ones)."""
    residuals: FloatArray
    """Model minus measurement, in N, shape (n,)."""
    curve: ForceCurve
    """The fitted model at the measured instants, with the fitted contact point and offset, in the sign measured."""
    measured: ForceCurve
    setup: Setup
    """The setup with the fitted values."""
    noise: float
    """Standard deviation of the residuals that count, in N, by their median."""
    misfit: float
    """Root mean square of the averaged residuals over the noise of the averaged baseline."""
    alike: tuple[str, ...]
    """Models that the curve does not tell from this one."""
    ladder: tuple[Rung, ...]
    """All models that were fitted, in this order."""
    sentences: tuple[str, ...]
    """In words: what is not determined, what trades off, and where the model does not describe the curve."""
    simulations: int

    def summary(self) -> str:
        """Values with intervals, noise, the ladder, and what is not determined."""
        setup, rows = self.setup, [("model", LADDER[self.model].title)]
        for name, value in self.values.items():
            low, high = (readable(bound, UNITS[name]) for bound in self.intervals[name])
            between = f"95 %: {low} to {high}"
            between = between if np.isfinite(self.intervals[name]).any() else "no interval"
            rows.append((name, f"{readable(value, UNITS[name]):>14}   {between}"))
        rows.append(("noise", f"{readable(self.noise, 'N'):>14}   {self.misfit:.3g} times that of the baseline"))
        if "work_of_adhesion" in self.values:
            rows.append(("contact", f"{setup.regime} (Tabor parameter {setup.physical_tabor:.3g})"))
        if self.model == "solver" and setup.range_is_effective:
            rows.append(("effective range", f"{readable(setup.gap, 'm'):>14}   Tabor parameter {setup.tabor:.3g}"))
        for rung in self.ladder:
            known = [f"{name} {readable(rung.values[name], UNITS[name])}" for name in rung.values if name not in LINEAR]
            rows.append((f"  {rung.model}", f"misfit {rung.misfit:.3g}, {rung.seconds:.2g} s: {', '.join(known)}"))
        return "\n".join([*(f"{name:17} {text}" for name, text in rows), *self.sentences])

    def to_dict(self) -> dict[str, Any]:
        """Everything but the curves, ready for JSON; what is infinite is null."""
        setup = self.setup
        found = {name: getattr(self, name) for name in ("model", "adequate", "alike", "values")}
        found |= {"units": {name: UNITS[name] for name in self.values}, "intervals": self.intervals}
        found |= {"confidence": CONFIDENCE, "correlations": self.correlations, "noise": self.noise}
        found |= {"misfit": self.misfit, "tabor": setup.physical_tabor}
        found |= {"effective_range": setup.gap if setup.range_is_effective else None}
        found |= {"ladder": [vars(rung) for rung in self.ladder], "sentences": self.sentences}
        return plain(found | {"simulations": self.simulations})

    def plot(self, path: str | FilePath) -> None:
        """Draw measurement and model against indentation, and residuals against time; the suffix chooses the format."""
        # Drawing without a display, and without touching a caller's pyplot state.
        from matplotlib.figure import Figure
        from matplotlib.ticker import EngFormatter, MaxNLocator

        from bem.results.plots import COLOURS, PULL_OFF, ZERO

        measured, offset, touched = self.measured, self.values.get("force_offset"), self.values.get("contact_point")
        figure = Figure(figsize=(9.0, 3.8), layout="constrained")
        loop, history = figure.subplots(1, 2)
        loop.plot(measured.indentation, measured.force, ".", color="0.6", markersize=3, label="measured")
        loop.plot(self.curve.indentation, self.curve.force, color=COLOURS["solver"], linewidth=1.2, label="fit")
        if touched is not None:
            if self.setup.stiffness is not None:
                # It is that of the stage; the offset of the force bends the spring of a measured indentation.
                bent = (offset or 0.0) / self.setup.stiffness
                touched += bent if measured.force_sign == "tension" else -bent
            loop.axvline(touched, color=PULL_OFF, linewidth=0.8, label="contact point")
        loop.axhline(offset or 0.0, color="0.8", linewidth=0.8, label=None if offset is None else "force offset")
        loop.set(xlabel="indentation", ylabel=f"force, {measured.force_sign} positive")
        loop.xaxis.set_major_formatter(EngFormatter("m"))
        loop.legend(edgecolor="none")  # no line runs through its words
        history.axhline(0.0, **ZERO)
        history.plot(measured.time, self.residuals, ".", color="0.4", markersize=3)
        history.set(xlabel="time", ylabel="model minus measurement, in tension")
        sizes = np.abs(self.residuals)
        if (shown := 1.5 * float(np.quantile(sizes, _SHOWN))) > 0.0 and sizes.max() > 3.0 * shown:
            history.set_ylim(-shown, shown)  # the instants of a jump would hide all others
            history.set_title(f"{np.count_nonzero(sizes > shown)} points beyond", loc="right", fontsize="small")
        history.xaxis.set_major_formatter(EngFormatter("s"))
        for axes in (loop, history):
            axes.xaxis.set_major_locator(MaxNLocator(5))
            axes.yaxis.set_major_formatter(EngFormatter("N"))
            axes.spines[["top", "right"]].set_visible(False)
        figure.savefig(path, dpi=150)


def result_of(
    curve: ForceCurve,
    best: Fitted,
    ladder: Sequence[Fitted],
    alike: Sequence[Fitted],
    said: Sequence[str],
) -> FitResult:
    """The result of a climb: of the best of a ladder, with the union of its intervals and those of models alike.

    `said` are sentences that come first.
    """
    intervals, correlations = best.intervals()
    loose = [name for name in best.names if _is_loose(best, name, intervals[name])]
    for other in alike:
        for name, (low, high) in other.intervals()[0].items():
            if name in intervals:
                intervals[name] = (min(low, intervals[name][0]), max(high, intervals[name][1]))
    if not best.adequate:
        intervals = dict.fromkeys(intervals, (-np.inf, np.inf))
    data = best.problem.data
    path = Path(curve.time, prescribed_path(curve, data.setup), data.setup)
    tension = _whole_tension(best, path)
    model = ForceCurve(
        time=curve.time,
        indentation=path.place + tension * path.compliance,
        force=tension,
        stage=None if path.setup.stiffness is None else path.place,
    )
    values = {name: best.values[name] for name in best.names}
    for name in {"force_offset", "tilt", "drift"} & values.keys() if curve.force_sign == "compression" else ():
        values[name] = -values[name]
        intervals[name] = (-intervals[name][1], -intervals[name][0])
    rest = tension - curve.tension
    counted = np.interp(curve.time, data.time, data.weights) > 0.5
    return FitResult(
        model=best.model.name,
        adequate=best.adequate,
        values=values,
        intervals=intervals,
        correlations=correlations,
        residuals=rest,
        curve=model.with_sign(curve.force_sign),
        measured=curve,
        setup=best.setup,
        noise=float(1.4826 * np.median(np.abs(rest[counted]))),
        misfit=best.misfit,
        alike=tuple(other.model.name for other in alike),
        ladder=tuple(Rung(one.model.name, one.values, one.misfit, one.seconds) for one in ladder),
        sentences=(*said, *_sentences(best, correlations, loose, alike)),
        simulations=best.problem.evaluations if any(one.model.name == "solver" for one in ladder) else 0,
    )


def _whole_tension(best: Fitted, path: Path) -> FloatArray:
    """The fitted model and the linear parts at all measured instants, positive in tension."""
    data, problem = best.problem.data, best.problem
    options = {name: value for name, value in problem.options.items() if name == "accuracy"}
    tension = best.model.tension(best.values, path, **options)
    if best.model.adhesive:
        inside = data.time[problem.inside]
        begin, end = (inside[0], inside[-1]) if inside.size else (np.inf, np.inf)
        tension = np.where((path.time >= begin) & (path.time <= end), tension, 0.0)
    return tension + np.interp(path.time, data.time, problem.columns @ problem.coefficients)


def _is_loose(best: Fitted, name: str, interval: tuple[float, float]) -> bool:
    """Whether a curve leaves a parameter open: by a factor of two, or by the whole depth; whatever its unit."""
    if name not in best.problem.free or name in best.at_bound:
        return name in best.at_bound and name != "work_of_adhesion"
    parameter = best.problem.parameters[name]
    if parameter.scale != "linear":
        low, high = (parameter.inner(bound) if 0.0 < bound < np.inf else np.inf for bound in interval)
        return not high - low < 2.0 * _LOOSE[parameter.scale]
    if name == "contact_point":
        return not interval[1] - interval[0] < float(np.ptp(best.problem.data.depth))
    return bool(interval[0] <= parameter.low)


def _sentences(
    best: Fitted,
    correlations: dict[str, dict[str, float]],
    loose: Sequence[str],
    alike: Sequence[Fitted],
) -> list[str]:
    """What the curve leaves open, what trades off, and which assumptions of the model the values contradict."""
    setup, name, found = best.setup, best.model.name, []
    depth, tabor = float(best.problem.data.depth.max()), setup.physical_tabor
    if not best.adequate:
        found.append(
            f"No model is adequate: the residuals of the best are {best.misfit:.1f} times the noise of the "
            "measurement, so that no interval holds."
        )
    elif best.beyond_chance:
        found.append(
            f"The residuals are {best.misfit:.2f} times the noise of the baseline, more than chance allows: the model "
            "misses something, or another minimum is better, and the intervals may be too narrow."
        )
    elif best.misfit > ADEQUATE:
        found.append(
            f"The residuals are {best.misfit:.2f} times the noise of the baseline, and the curve is too short to tell "
            "whether chance makes them so: the intervals may be too narrow."
        )
    if not best.converged:
        found.append("The search did not converge: its evaluations were spent before the residuals stopped falling.")
    for other in alike:
        found.append(f"The curve does not tell {name} from {other.model.name}: each interval is the union of both.")
    for each in best.at_bound:
        end = readable(best.values[each], UNITS[each])
        found.append(f"The best {each} is {'zero' if best.values[each] < 1e-9 else f'at the end of its range, {end}'}.")
    for each in loose:
        found.append(f"The curve does not determine {each}: {best.problem.parameters[each].advice} would.")
    for one, two in itertools.combinations(best.names, 2):
        if abs(correlation := correlations[one][two]) > _TIED:
            found.append(
                f"The curve hardly tells {one} from {two} (correlation {correlation:.3f}): a measured value of one "
                "would sharpen the other."
            )
    deep, radius, gap = (readable(length, "m") for length in (depth, setup.radius, setup.gap))
    if setup.relaxed_modulus > _STIFFEST:
        found.append(f"Hardly a solid is as stiff as {readable(setup.relaxed_modulus, 'Pa')}: are the units right?")
    if setup.radius > _LARGEST:
        found.append(f"Hardly a sphere of such contacts has a radius of {radius}: are the units right?")
    if setup.half_angle is None and depth > 0.5 * setup.radius:
        asked = ": are the units right?" if depth > 2.0 * setup.radius else "."
        found.append(f"The depth, {deep}, is not small beside the radius, {radius}{asked}")
    if setup.half_angle is not None and depth < 2.0 * setup.radius:
        found.append(f"The depth, {deep}, is not large beside the radius of the apex.")
    if name == "dmt" and tabor > 0.3:
        found.append(f"DMT assumes a Tabor parameter below 0.1; the fitted values give {tabor:.3g}.")
    if name == "jkr" and tabor < 2.0:
        found.append(f"JKR assumes a Tabor parameter above 5; the fitted values give {tabor:.3g}.")
    if name == "solver" and setup.range_is_effective and "retardation_time" in best.problem.free:
        found.append(
            f"The retardation time belongs to the effective range, {gap}: the edge of the contact dissipates over it, "
            "and a shorter one gives another time."
        )
    return found
