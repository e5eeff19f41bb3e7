"""What a fit gives: model, values, 95 % intervals, the models tried, and in words what the curve does not determine."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from bem._support.text_files import plain
from bem._support.validation import FloatArray
from bem.lab.curve import ForceCurve
from bem.lab.fitting.fitted import CONFIDENCE, Fitted
from bem.lab.fitting.measurement import prescribed_path
from bem.lab.models import LINEAR, MODELS, PARAMETERS, Path
from bem.lab.setup import Setup
from bem.lab.units import readable

_LOOSE = {"logarithm": np.log(2.0), "logit": 2.0}
_TIED = 0.98  # correlation from which two parameters are said to trade off
_STIFFEST, _LARGEST = 5e11, 1e-2  # Pa, and m of a radius
_DEEP, _THICK = 1.0, 1.0  # depth over radius and over thickness, up to which the formulas hold
_SHOWN = 0.98  # share of the residuals that sets the limits of their picture


class FitError(RuntimeError):
    """A fit that did not converge."""


@dataclass(frozen=True, eq=False)
class FitResult:
    """A fitted force curve, in SI units and tension positive."""

    model: str
    """Name of the model in `bem.lab.models.MODELS`."""
    adequate: bool
    """Whether it describes the curve; else no interval holds, and all are infinite."""
    values: dict[str, float]
    """Each free parameter."""
    intervals: dict[str, tuple[float, float]]
    """Its 95 % interval; infinite where the curve does not determine it."""
    correlations: dict[str, dict[str, float]]
    """Between each pair, of the parameters as they are searched (logarithms of positive ones)."""
    undetermined: tuple[str, ...]
    """Parameters that the curve does not determine."""
    moduli: tuple[float, float] | None
    """Smallest and largest Young's modulus over three depths, in Pa."""
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
    """Root mean square of the residuals over the noise."""
    alike: tuple[str, ...]
    """Models that the curve does not tell from this one."""
    misfits: dict[str, float]
    """Of all models that were fitted, in this order."""
    warnings: tuple[str, ...]
    """In words: assumptions of the model that the curve or the values contradict. They come before the numbers."""
    sentences: tuple[str, ...]
    """In words: what is not determined, what trades off, and why no model is adequate."""
    simulations: int
    seconds: dict[str, float]
    """Processor time of each model."""

    def summary(self) -> str:
        """What the assumptions forbid, values with intervals, the models tried, and what is not determined."""
        setup, rows = self.setup, [("model", MODELS[self.model].title)]
        for name, value in self.values.items():
            title, unit, (low, high) = PARAMETERS[name].title, PARAMETERS[name].unit, self.intervals[name]
            text, finite = f"{readable(value, unit):>14}", np.isfinite([low, high]).all()
            if name in self.undetermined or (self.adequate and not finite):
                text = "not determined"
            elif finite:
                text += f"   95 %: {readable(low, unit)} to {readable(high, unit)}"
            relaxed = name == "relaxed_modulus" and "modulus_ratio" in self.values
            rows.append((f"{title}, relaxed" if relaxed else title, text))
            if name == "relaxed_modulus":
                if relaxed and "modulus_ratio" not in self.undetermined:
                    at_once = value / self.values["modulus_ratio"]
                    rows.append((f"{title}, instantaneous", f"{readable(at_once, unit):>14}"))
                rows.append(("reduced modulus E/(1-nu^2)", f"{readable(setup.contact_modulus, unit):>14}"))
        rows.append(("noise", f"{readable(self.noise, 'N'):>14}   residuals {self.misfit:.3g} times it"))
        if "work_of_adhesion" in self.values:
            rows.append(("Tabor parameter", f"{setup.physical_tabor:>14.3g}   {setup.regime}"))
        tried = ", ".join(f"{name} {misfit:.3g}" for name, misfit in self.misfits.items())
        rows.append(("models tried", f"residuals over noise: {tried}; {sum(self.seconds.values()):.2g} s of processor"))
        head = [f"Caution: {text}" for text in self.warnings]
        return "\n".join([*self.measured.notes, *head, *(f"{name:29} {text}" for name, text in rows), *self.sentences])

    def to_dict(self) -> dict[str, Any]:
        """Everything but the curves, ready for JSON; what is infinite is null."""
        names = "model adequate alike values intervals undetermined moduli correlations noise misfit misfits seconds"
        fields = {name: getattr(self, name) for name in f"{names} warnings sentences simulations".split()}
        fields |= {"units": {name: PARAMETERS[name].unit for name in self.values}, "confidence": CONFIDENCE}
        return plain(fields | {"tabor": self.setup.physical_tabor, "notes": self.measured.notes})

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
    alike: Sequence[Fitted],
    tried: Mapping[str, Fitted],
    seconds: dict[str, float],
) -> FitResult:
    """The result of a choice: of the best model, with the union of its intervals and those of models alike."""
    intervals, correlations = best.intervals()
    loose = tuple(name for name in best.names if _is_loose(best, name, intervals[name]))
    sentences, judgement = _sentences(best, correlations, loose, alike), best.judgement
    for rival in alike:
        for name, (low, high) in rival.intervals()[0].items():
            if name in intervals:
                intervals[name] = (min(low, intervals[name][0]), max(high, intervals[name][1]))
    hertz = tried.get("hertz") if best.model.spans and judgement.adequate else None
    if hertz is not None and hertz.criterion(best) < best.criterion(best):
        # The ends of the contact are chosen, which gives a little adhesion in any noise.
        sentences.insert(0, "Hertz describes the curve as well: the work of adhesion may be zero.")
        intervals["work_of_adhesion"] = (0.0, intervals["work_of_adhesion"][1])
    if not judgement.adequate:
        intervals = dict.fromkeys(intervals, (-np.inf, np.inf))
    data, counted = best.problem.data, best.problem.data.time[best.problem.weights > 0.0]
    path = Path(curve.time, prescribed_path(curve, data.setup), data.setup)
    tension = _whole_tension(best, path)
    model = ForceCurve(
        time=curve.time,
        indentation=path.position + tension * path.compliance,
        force=tension,
        stage=None if path.setup.stiffness is None else path.position,
    )
    values = {name: best.values[name] for name in best.names}
    for name in LINEAR.keys() & values.keys() if curve.force_sign == "compression" else ():
        values[name] = -values[name]
        intervals[name] = (-intervals[name][1], -intervals[name][0])
    return FitResult(
        model=best.model.name,
        adequate=judgement.adequate,
        values=values,
        intervals=intervals,
        correlations=correlations,
        undetermined=loose,
        moduli=judgement.moduli,
        residuals=tension - curve.tension,
        curve=model.with_sign(curve.force_sign),
        measured=curve,
        setup=best.setup,
        noise=float(1.4826 * np.median(np.abs((tension - curve.tension)[_within(curve.time, counted)]))),
        misfit=best.misfit,
        alike=tuple(rival.model.name for rival in alike),
        misfits={name: candidate.misfit for name, candidate in tried.items()},
        warnings=tuple(_warnings(best)),
        sentences=tuple(sentences),
        simulations=tried["contact"].problem.evaluations if "contact" in tried else 0,
        seconds=seconds,
    )


def _within(time: FloatArray, instants: FloatArray) -> np.ndarray:
    """Which instants lie between the first and the last of others."""
    return (time >= instants[0]) & (time <= instants[-1]) if instants.size else np.zeros(time.size, dtype=bool)


def _whole_tension(best: Fitted, path: Path) -> FloatArray:
    """The fitted model and the linear parts at all measured instants, positive in tension."""
    data, problem = best.problem.data, best.problem
    options = {name: value for name, value in problem.options.items() if name == "accuracy"}
    tension = best.model.tension(best.values, path, **options)
    if best.model.spans:
        tension = np.where(_within(path.time, data.time[problem.inside]), tension, 0.0)
    linear = sum((data.columns[name] * best.values[name] for name in problem.linear), np.zeros(data.time.size))
    if "tilt" in problem.linear:  # it turns about the contact point
        linear += best.values["tilt"] * (data.position[data.first] - best.values["contact_point"])
    return tension + np.interp(path.time, data.time, linear)


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


def _warnings(best: Fitted) -> list[str]:
    """Which assumptions of the model the curve and the fitted values contradict."""
    setup, name, data, texts = best.setup, best.model.name, best.problem.data, []
    depth, tabor = float(data.depth.max()), setup.physical_tabor
    deep, radius = readable(depth, "m"), readable(setup.radius, "m")
    if setup.relaxed_modulus > _STIFFEST:
        texts.append(f"hardly a solid is as stiff as {readable(setup.relaxed_modulus, 'Pa')}: are the units right?")
    if setup.radius > _LARGEST:
        texts.append(f"hardly a sphere of such contacts has a radius of {radius}: are the units right?")
    if setup.half_angle is None and depth > (0.3 if name == "contact" else _DEEP) * setup.radius:
        units = ": are the units right?" if depth > 2.0 * setup.radius else ", beyond which the formula holds for none."
        texts.append(f"the depth, {deep}, is {depth / setup.radius:.2g} times the radius, {radius}{units}")
    if setup.half_angle is not None and depth < 2.0 * setup.radius:
        texts.append(f"the depth, {deep}, is not large beside the radius of the apex.")
    if setup.thickness is not None and setup.radius * depth > (_THICK * setup.thickness) ** 2:
        texts.append(
            f"the contact is wider than the thickness, {readable(setup.thickness, 'm')}: the series ends there."
        )
    if name == "dmt" and tabor > 0.3:
        texts.append(f"DMT assumes a Tabor parameter below 0.1; the fitted values give {tabor:.3g}.")
    if name == "jkr" and tabor < 2.0:
        texts.append(f"JKR assumes a Tabor parameter above 5; the fitted values give {tabor:.3g}.")
    if data.segments.held == "force" and name in ("hertz", "cone", "dmt", "jkr"):
        texts.append("the force was held: an elastic model takes creep during the hold for depth.")
    if not data.linear:
        texts.append("the curve has no baseline: its force is taken for zero at contact; no offset or tilt is fitted.")
    return texts


def _sentences(
    best: Fitted,
    correlations: dict[str, dict[str, float]],
    loose: Sequence[str],
    alike: Sequence[Fitted],
) -> list[str]:
    """Why no model is adequate, what the curve leaves open and what trades off."""
    name, texts, judgement = best.model.name, [], best.judgement
    titles = {key: PARAMETERS[key].title for key in best.names}
    texts.append(f"Segments: {best.problem.data.segments.sentence(best.problem.data.time)}.")
    if not judgement.adequate:
        texts.append(f"No model is adequate, so that no interval holds. {' '.join(judgement.reasons)}")
        if judgement.moduli is not None:
            low, high = (readable(modulus, "Pa") for modulus in judgement.moduli)
            texts.append(f"Over three depths Young's modulus ranges from {low} to {high}.")
    for rival in alike:
        texts.append(f"The curve does not tell {name} from {rival.model.name}: each interval is the union of both.")
    for key in loose:
        texts.append(f"The curve does not determine the {titles[key]}: {best.problem.parameters[key].advice} would.")
    for first, second in itertools.combinations(best.names, 2):
        if abs(correlation := correlations[first][second]) > _TIED:
            texts.append(
                f"The curve hardly tells the {titles[first]} from the {titles[second]} (correlation "
                f"{correlation:.3f}): a measured value of one would sharpen the other."
            )
    return texts
