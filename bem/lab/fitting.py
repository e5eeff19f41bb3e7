"""Fit modulus, work of adhesion and relaxation to a measured force curve, with 95 % intervals.

The solver runs inside a least-squares search, at draft accuracy from several starts and then at standard accuracy from
the best of them. Parameters are searched as logarithms; the offset of the force, which enters linearly, is solved for
at every step. The noise is estimated from the residuals. Intervals are those of the linearised problem at the solution;
where neighbouring residuals are correlated they are widened as for that many fewer independent points.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from bem._support.validation import FloatArray, instance
from bem._support.wording import shown
from bem.accuracy import TIGHTEST, resolve_accuracy
from bem.lab.contact_point import Contact, weights_of
from bem.lab.curve import ForceCurve
from bem.lab.fit_result import FitError, FitResult, result_of
from bem.lab.guess import first_contact, starting_points
from bem.lab.model import Model, prescribed_path, with_memory
from bem.lab.model_choice import effects_called_for, sentence
from bem.lab.parameters import MEMORY, PARAMETERS
from bem.lab.setup import Setup
from bem.materials import Elastic, StandardLinearSolid

ALL = tuple(PARAMETERS)
ELASTIC = ("relaxed_modulus", "work_of_adhesion", "contact_point", "force_offset")

DIFFERENCE = 0.02  # of a logarithm, or of the adhesion length; large enough that the solver's own errors do not matter
_SHORT, _LONG, _POLISH, _ROUNDS = 4, 14, 12, 3  # evaluations of the Jacobian, and times it is polished
_KEPT, _GOOD = 2, 1.1  # runs continued, and the misfit in standard deviations of the noise at which one is enough
_CORRECTIONS, _TIGHTER = 2, 4.0
_STRIDE = 3.0  # steps of the search, over which the derivatives behind the intervals are taken
_AS_GOOD = 1.1  # noise of a simpler fit over that of the full one


@dataclass
class Search:
    """The least-squares problem of one curve: what varies, and the residuals in standard deviations of the noise."""

    model: Model
    free: tuple[str, ...]
    fixed: dict[str, float]
    unit: dict[str, float]
    """Change of each transformed parameter that counts as one in the search."""
    origin: dict[str, float]
    """Parameters in SI at which the search is zero, so that its relative tolerances mean something."""
    weights: FloatArray
    accuracy: str | float = "draft"
    report: Callable[[int, float], None] | None = None
    _last: tuple[Any, FloatArray | None] = (None, None)

    @property
    def searched(self) -> tuple[str, ...]:
        """The free parameters that the search moves: all but the linear offset."""
        return tuple(name for name in self.free if name != "force_offset")

    @cached_property
    def bad(self) -> float:
        """Residual of a contact that the solver does not complete: more than no contact at all would leave."""
        tension = self.model.curve.tension
        return 1.0 + 2.0 * float(np.max(self.weights * np.abs(tension - np.median(tension))))

    def values(self, x: FloatArray) -> dict[str, float]:
        """Parameters in SI of a point of the search."""
        free = {
            name: PARAMETERS[name].outer(x[i] * self.unit[name] + PARAMETERS[name].inner(self.origin[name]))
            for i, name in enumerate(self.searched)
        }
        return self.fixed | free

    def point(self, values: Mapping[str, float]) -> FloatArray:
        """The point of the search that belongs to parameters in SI."""
        return np.array([self._inner(name, values[name]) for name in self.searched])

    def _inner(self, name: str, value: float) -> float:
        parameter = PARAMETERS[name]
        return (parameter.inner(value) - parameter.inner(self.origin[name])) / self.unit[name]

    def offset(self, tension: FloatArray) -> float:
        """The force offset, as a tension: the best one where it is free."""
        if "force_offset" not in self.free:
            return self.fixed.get("force_offset", 0.0)
        square = self.weights**2
        return float(np.sum(square * (self.model.curve.tension - tension)) / np.sum(square))

    def residuals(self, x: FloatArray, offset: float | None = None) -> FloatArray:
        """Weighted model minus measurement, shape (n,); with the best force offset unless one is given."""
        # The Jacobian begins where the search has just been.
        asked = (x.tobytes(), self.accuracy)
        if asked != self._last[0]:
            self._last = asked, self.model.tension(self.values(x), self.accuracy)
        tension = self._last[1]
        if tension is None:
            return np.full(len(self.model.curve), self.bad)
        added = self.offset(tension) if offset is None else offset
        found = self.weights * (tension + added - self.model.curve.tension)
        if self.report is not None:
            self.report(self.model.evaluations, float(np.sqrt(np.mean(found**2))))
        return found

    def misfit(self, x: FloatArray) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(self.residuals(x) ** 2)))

    def until_good(self, points: Sequence[FloatArray], evaluations: int) -> list[OptimizeResult]:
        """Least squares from each point, the best first; once one describes the curve, no other is tried."""
        runs: list[OptimizeResult] = []
        for x in points:
            runs.append(self.run(x, evaluations))
            if np.mean(runs[-1].fun ** 2) < _GOOD**2:
                break
        return sorted(runs, key=lambda run: run.cost)

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivative of the residuals with the best offset at each point, shape (n, searched)."""
        here = self.residuals(x)
        return np.column_stack([self.residuals(x + step) - here for step in np.eye(x.size)])

    def full_jacobian(self, x: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """Derivative by all free parameters, the offset last and in N, shape (n, free), by central differences.

        Steps are long: where parameters trade off, the solver's scatter over a short one would look like a difference
        that tells them apart, and the intervals would be too narrow. Also which rows no jump passed, (n,) bool.
        """
        self.residuals(x, 0.0)
        columns, jumps = [], [self.model.jumps]
        for step in _STRIDE * np.eye(x.size):
            sides = []
            for side in (x + step, x - step):
                sides.append(self.residuals(side, 0.0))
                jumps.append(self.model.jumps)
            columns.append((sides[0] - sides[1]) / (2.0 * _STRIDE))
        rows = self.model.away_from_jumps(jumps)
        return np.column_stack(columns + [self.weights] * ("force_offset" in self.free)), rows

    def run(self, x: FloatArray, evaluations: int) -> OptimizeResult:
        """Least squares from a point."""
        parameters = [PARAMETERS[name] for name in self.searched]
        bounds = [
            [self._inner(p.name, getattr(p, side)) if p.scale != "linear" else getattr(p, side) for p in parameters]
            for side in ("low", "high")
        ]
        inside = np.clip(x, np.array(bounds[0]) + 1e-9, np.array(bounds[1]) - 1e-9)
        # The solver's results scatter by its own error: an improvement below that is not real.
        return least_squares(
            self.residuals,
            inside,
            jac=self.jacobian,
            bounds=bounds,
            max_nfev=evaluations,
            xtol=1e-4,
            ftol=1e-5,
            gtol=1e-8,
        )


def fit(
    curve: ForceCurve,
    setup: Setup,
    free: Sequence[str] | None = None,
    *,
    accuracy: str | float = "standard",
    report: Callable[[int, float], None] | None = None,
) -> FitResult:
    """Fit a setup to a measured curve.

    Args:
        curve: the measurement, from out of contact to out of contact.
        setup: what is known, and first guesses of what is free; `bem.lab.guess.guess_setup` makes one from the curve.
            With its `stiffness`, or that of a curve with a stage, the fit moves the stage: jumps into and out of
            contact are those of contact and spring, and the contact point is a position of the stage.
        free: the parameters to fit, of relaxed_modulus, work_of_adhesion, retardation_time, modulus_ratio,
            contact_point and force_offset. `None` fits all of them and then leaves the relaxation out where the curve
            does not call for it.
        accuracy: of the final fit, as for `bem.simulate`.
        report: called with the number of simulations so far and the misfit in standard deviations of the noise.

    Returns:
        the fit; its `sentences` say what the curve does not determine.

    Raises:
        ValueError: an unknown parameter, or a curve without contact or baseline.
        FitError: the fit did not converge.
    """
    instance("curve", curve, (ForceCurve,))
    instance("setup", setup, (Setup,))
    chosen = ALL if free is None else tuple(free)
    unknown = [name for name in chosen if name not in PARAMETERS]
    if unknown or not chosen or set(chosen) == {"force_offset"}:
        raise ValueError(f"free must be one or more of {', '.join(ALL)}; received {shown(free)}")
    chosen = tuple(name for name in ALL if name in chosen)
    if setup.stiffness is None and curve.stiffness is not None:
        setup = setup.replaced(stiffness=curve.stiffness)
    contact = first_contact(curve)
    contact = dataclasses.replace(contact, contact_point=float(prescribed_path(curve, setup)[contact.index]))
    duration = float(curve.time[-1] - curve.time[contact.index])
    if not duration > 0.0:
        raise ValueError(f"time must increase after contact; received {curve.time[-1]:g} s to the end")
    if set(chosen) & set(MEMORY):
        setup = with_memory(setup, duration)
    if "modulus_ratio" in chosen:
        instance("material, whose modulus_ratio is free,", setup.material, (StandardLinearSolid,))
    result = _fitted(curve, setup, chosen, contact, duration, accuracy, report)
    if free is not None:
        return result
    effects = effects_called_for(result)
    if effects.terms == 0 or not result.determines_memory():
        elastic = result.setup.replaced(material=Elastic(), retardation_time=None)
        simpler = _fitted(curve, elastic, ELASTIC, contact, duration, accuracy, report)
        if simpler.noise < _AS_GOOD * result.noise:
            result, effects = simpler, effects_called_for(simpler)
    return dataclasses.replace(result, sentences=(sentence(effects), *result.sentences))


def _fitted(
    curve: ForceCurve,
    setup: Setup,
    free: tuple[str, ...],
    contact: Contact,
    duration: float,
    accuracy: str | float,
    report: Callable[[int, float], None] | None,
) -> FitResult:
    fixed = {} if "contact_point" in free else {"contact_point": 0.0}
    if "force_offset" not in free:
        fixed["force_offset"] = 0.0
    unit = {name: DIFFERENCE * (1.0 if PARAMETERS[name].scale != "linear" else setup.adhesion_length) for name in free}
    unit |= {"modulus_ratio": 2.0 * DIFFERENCE}
    starts = starting_points(curve, setup, contact, duration, free)
    search = Search(Model(curve, setup), free, fixed, unit, starts[0], weights_of(curve, contact.noise), report=report)
    points = sorted((search.point(start) for start in starts), key=search.misfit)
    runs = search.until_good(points, _SHORT)
    best = min(search.until_good([run.x for run in runs[:_KEPT]], _LONG), key=lambda run: run.cost)
    search.accuracy = accuracy
    for _ in range(_ROUNDS):
        last, best = best, search.run(best.x, _POLISH)
        unfinished = best.status == 0 and best.cost < 0.9 * last.cost
        if not unfinished:
            break
    if not np.isfinite(best.cost) or np.all(best.fun == search.bad):
        raise FitError("the fit did not converge: the solver completes no contact near the measured curve")
    if unfinished:
        raise FitError(f"the fit did not converge in {search.model.evaluations} simulations; give a closer first guess")
    return result_of(search, *_settled(search, best.x))


def _settled(search: Search, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The solution after a few Gauss-Newton steps with a tighter solver; its residuals and its Jacobian.

    Central differences are less sensitive to the scatter of the solver's results, at which the search stops; and with
    many points the noise averages out to less than the solver's error at the accuracy of the search.
    """
    search.accuracy = max(resolve_accuracy(search.accuracy).target / _TIGHTER, TIGHTEST)
    # A jump of the model that passes a point makes a difference there that is no derivative.
    jacobian, smooth = search.full_jacobian(x)
    residuals = search.residuals(x)
    for _ in range(_CORRECTIONS):
        step = np.linalg.lstsq(jacobian[smooth], -residuals[smooth], rcond=1e-6)[0][: x.size]
        ahead = search.residuals(x + step)
        if not ahead @ ahead < residuals @ residuals:
            break
        x, residuals = x + step, ahead
    return x, residuals[smooth], jacobian[smooth]
