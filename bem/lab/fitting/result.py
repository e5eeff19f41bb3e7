"""What a fit found: values, 95 % intervals, correlations, residuals, and in words what the curve does not determine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import t as student

from bem._support.validation import FloatArray
from bem.lab.curve import ForceCurve
from bem.lab.fitting.model import prescribed_path
from bem.lab.fitting.parameters import PARAMETERS
from bem.lab.setup import Setup
from bem.lab.units import readable

if TYPE_CHECKING:
    from bem.lab.fitting.search import Search

CONFIDENCE = 0.95
_LOOSE = {"logarithm": np.log(2.0), "logit": 2.0}
_TIED = 0.98  # correlation from which two parameters are said to trade off
_UNLIKE = 1.5  # residuals over noise from which the model is said not to describe the curve


class FitError(RuntimeError):
    """A fit that did not converge."""


@dataclass(frozen=True, eq=False)
class FitResult:
    """A fitted force curve, in SI units and tension positive."""

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
    """Standard deviation of the residuals, in N, where the force does not jump."""
    sentences: tuple[str, ...]
    """In words: what is not determined, what trades off, and where the model does not describe the curve."""
    simulations: int

    def determines_memory(self) -> bool:
        """Whether relaxation was fitted and found: a modulus ratio well below 1, and a bounded retardation time."""
        if "modulus_ratio" not in self.values or "retardation_time" not in self.values:
            return False
        return self.intervals["modulus_ratio"][1] < 0.95 and np.isfinite(self.intervals["retardation_time"][1])

    def summary(self) -> str:
        """Values with intervals, noise, regime, and what is not determined."""
        lines = []
        for name, value in self.values.items():
            unit = PARAMETERS[name].unit
            low, high = (readable(bound, unit) for bound in self.intervals[name])
            lines.append(f"{name:17} {readable(value, unit):>14}   95 %: {low} to {high}")
        kind = "elastic" if self.setup.material.modulus_ratio == 1.0 else "viscoelastic"
        lines += [
            f"{'noise':17} {readable(self.noise, 'N'):>14}",
            f"{'contact':17} {kind}; {self.setup.regime} (Tabor parameter {self.setup.physical_tabor:.3g})",
        ]
        if self.setup.range_is_effective:
            lines.append(
                f"{'effective range':17} {readable(self.setup.gap, 'm'):>14}   Tabor parameter {self.setup.tabor:.3g}"
            )
        return "\n".join([*lines, *self.sentences])

    def to_dict(self) -> dict[str, Any]:
        """Everything but the curves, ready for JSON; what is infinite is null."""

        def clean(value: float) -> float | None:
            return float(value) if np.isfinite(value) else None

        return {
            "values": {name: clean(value) for name, value in self.values.items()},
            "units": {name: PARAMETERS[name].unit for name in self.values},
            "intervals": {name: [clean(bound) for bound in pair] for name, pair in self.intervals.items()},
            "confidence": CONFIDENCE,
            "correlations": {a: {b: clean(value) for b, value in row.items()} for a, row in self.correlations.items()},
            "noise": clean(self.noise),
            "tabor": self.setup.physical_tabor,
            "effective_range": self.setup.gap if self.setup.range_is_effective else None,
            "sentences": list(self.sentences),
            "simulations": self.simulations,
        }

    def plot(self, path: str | Path) -> None:
        """Draw measurement, model and residuals into an image file."""
        from bem.lab.fitting.plot import plot_fit

        plot_fit(self, path)


def result_of(search: Search, x: FloatArray, residuals: FloatArray, jacobian: FloatArray) -> FitResult:
    """The result at a solution.

    Args:
        search: the problem.
        x: the solution in the variables of the search.
        residuals: weighted, at the solution.
        jacobian: derivative of the residuals by all free parameters, the offset last.

    Raises:
        FitError: the solver does not complete the contact at the solution.
    """
    names = search.free
    values = search.values(x)
    tension = search.model.tension(values, search.accuracy)
    if tension is None:
        raise FitError("the fit did not converge: the solver does not complete the contact at its end")
    offset = search.offset(tension)
    if "force_offset" in names:
        search.unit["force_offset"] = 1.0
    values["force_offset"] = offset
    degrees = max(residuals.size - len(names), 1)
    variance = float(residuals @ residuals) / degrees
    variance *= _fewer_points(residuals)
    deviations, correlation = _deviations(jacobian, variance)
    quantile = float(student.ppf(0.5 + 0.5 * CONFIDENCE, degrees))
    intervals, spreads = {}, {}
    for i, name in enumerate(names):
        parameter, spread = PARAMETERS[name], quantile * deviations[i] * search.unit[name]
        centre = parameter.inner(values[name])
        spreads[name] = spread
        intervals[name] = (parameter.outer(centre - spread), parameter.outer(centre + spread))
    curve = search.model.curve
    setup = search.model.setup_of(values)
    sign = 1.0 if curve.force_sign == "tension" else -1.0
    if sign < 0.0 and "force_offset" in names:
        intervals["force_offset"] = (-intervals["force_offset"][1], -intervals["force_offset"][0])
    fitted = {name: values[name] for name in names}
    if "force_offset" in fitted:
        fitted["force_offset"] *= sign
    noise = float(np.sqrt(np.sum(residuals**2) / degrees) / np.max(search.weights))
    correlations = {a: {b: float(correlation[i, j]) for j, b in enumerate(names)} for i, a in enumerate(names)}
    return FitResult(
        values=fitted,
        intervals=intervals,
        correlations=correlations,
        residuals=tension + offset - curve.tension,
        curve=_fitted_curve(curve, setup, tension + offset),
        measured=curve,
        setup=setup,
        noise=noise,
        sentences=_sentences(names, fitted, spreads, float(np.sqrt(variance)), correlations, residuals, setup),
        simulations=search.model.evaluations,
    )


def _fitted_curve(curve: ForceCurve, setup: Setup, tension: FloatArray) -> ForceCurve:
    """The model at the measured instants, in the measured sign; behind a spring its indentation follows its force."""
    stage = prescribed_path(curve, setup)
    return ForceCurve(
        time=curve.time,
        indentation=stage if setup.stiffness is None else stage + tension / setup.stiffness,
        force=tension if curve.force_sign == "tension" else -tension,
        force_sign=curve.force_sign,
        stage=None if setup.stiffness is None else stage,
    )


def _deviations(jacobian: FloatArray, variance: float) -> tuple[FloatArray, FloatArray]:
    """Standard deviations and correlations of the linearised problem; infinite for what the data do not constrain."""
    scale = np.linalg.norm(jacobian, axis=0)
    seen = scale > 1e-12 * max(float(scale.max()), 1e-300)
    normal = jacobian[:, seen] / scale[seen]
    values, vectors = np.linalg.eigh(normal.T @ normal)
    values = np.maximum(values, 1e-12)
    covariance = variance * (vectors / values) @ vectors.T
    deviations = np.full(scale.size, np.inf)
    deviations[seen] = np.sqrt(np.diag(covariance)) / scale[seen]
    correlation = np.eye(scale.size)
    inner = np.sqrt(np.diag(covariance))
    correlation[np.ix_(seen, seen)] = covariance / np.outer(inner, inner)
    return deviations, correlation


def _fewer_points(residuals: FloatArray) -> float:
    """Factor of the variance by correlated residuals, (1 + r) / (1 - r) with r the correlation of neighbours."""
    r = (
        float(np.corrcoef(residuals[1:], residuals[:-1])[0, 1])
        if residuals.size > 3 and np.ptp(residuals) > 0.0
        else 0.0
    )
    return (1.0 + min(r, 0.98)) / (1.0 - min(r, 0.98)) if r > 2.0 / np.sqrt(residuals.size) else 1.0


def _sentences(
    names: Sequence[str],
    values: Mapping[str, float],
    spreads: Mapping[str, float],
    widened: float,
    correlations: Mapping[str, Mapping[str, float]],
    residuals: FloatArray,
    setup: Setup,
) -> tuple[str, ...]:
    """Sentences of a fit; `widened` is the factor by which residuals above the noise widen every interval."""
    found, misfit = [], float(np.sqrt(np.mean(residuals**2)))
    blurred = []
    for name in names:
        parameter = PARAMETERS[name]
        limit = _LOOSE.get(parameter.scale, setup.adhesion_length if name == "contact_point" else np.inf)
        inside = parameter.low * 1.001 < values[name] < parameter.high * 0.999 if parameter.scale != "linear" else True
        if inside and misfit > _UNLIKE and spreads[name] / widened < limit <= spreads[name]:
            blurred.append(name)
        elif not spreads[name] < limit or not inside:
            found.append(f"The curve does not determine {name}: {parameter.advice} would.")
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            if abs(correlations[one][other]) > _TIED:
                found.append(
                    f"The curve hardly tells {one} from {other} (correlation {correlations[one][other]:.3f}): "
                    "a measured value of one would sharpen the other."
                )
    if misfit > _UNLIKE:
        also = f", which widens the intervals, most of all of {' and '.join(blurred)}" if blurred else ""
        found.append(
            f"The model does not describe the curve: its residuals are {misfit:.1f} times the noise of the "
            f"measurement{also}."
        )
    if setup.range_is_effective and "retardation_time" in names:
        found.append(
            f"The retardation time belongs to the effective range, {readable(setup.gap, 'm')}: the edge of the "
            "contact dissipates over it, and a shorter one gives another time."
        )
    return tuple(found)
