"""Fit modulus, work of adhesion and relaxation to a measured force curve by the simplest model that describes it.

The ladder of `bem.lab.models` is climbed: Hertz, then DMT and JKR, Ting where the residuals of Hertz hold relaxation,
and the solver where the curve calls for adhesion and relaxation both. The Bayesian information criterion decides, for
noise as correlated as the residuals. Tilt of the baseline and drag of the liquid are always fitted: one too small to be
seen would still bias the others. A drift in time, which looks like relaxation, is fitted where the criterion calls for
it. A rung whose memory vanishes at the end of its range is elastic and does not count. Intervals are those of the
linearised problem, for the slow noise of the residuals.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import get_args

import numpy as np

from bem._support.validation import instance
from bem._support.wording import shown
from bem.lab.contact_point import FEWEST
from bem.lab.curve import ForceCurve
from bem.lab.fitting.measurement import Measurement, Segment, hertz_line, measurement_of
from bem.lab.fitting.regression import Fitted, Regression
from bem.lab.fitting.result import FitError, FitResult, result_of
from bem.lab.fitting.simulated import memories, search
from bem.lab.models import CONTACT_POINT, LADDER, LINEAR, Model
from bem.lab.models.solver import MEMORY, NoContactError
from bem.lab.setup import Setup
from bem.lab.units import Quantity, to_si
from bem.problem.accuracy import resolve_accuracy
from bem.problem.materials import PronySeries

AUTO = "auto"

_ALIKE = 10.0  # difference of the criterion from which two models are told apart
_BETTER = 0.9  # times the misfit of Hertz, below which a rung describes a part of what Hertz does not
_MEMORIES = (0.01, 0.1, 1.0)  # retardation times, over the duration, that are looked for
_SLIGHT = 0.8  # modulus ratio with which they are
_HIDDEN = 15.0  # of chi-square, by which adhesion with its ends lowers it in one curve of Hertz in twenty
_TWINS = ("dmt", "jkr")


def fit(
    curve: ForceCurve,
    setup: Setup,
    free: Sequence[str] | None = None,
    *,
    model: str = AUTO,
    segment: Segment = "both",
    within: tuple[Quantity | None, Quantity | None] | None = None,
    accuracy: str | float = "standard",
    report: Callable[[int, float], None] | None = None,
) -> FitResult:
    """Fit a measured curve.

    Args:
        curve: the measurement, from out of contact on.
        setup: what is known: radius, Poisson's ratio, spring, and what is not in `free`; `bem.lab.fitting.guess_setup`
            makes one from the curve. With its `stiffness`, or that of a curve with a stage, the fit moves the stage,
            and the contact point is a position of the stage.
        free: the parameters to fit, of the model's, contact_point, force_offset, tilt, drag and drift; the others are
            the setup's, or zero. `None` fits all.
        model: a name of `bem.lab.models.LADDER`; "auto" climbs the ladder, or with `free` takes the solver.
        segment: "approach", "retract" or "both": the points that count.
        within: lowest and highest indentation, as lengths, or lowest and highest compression, as forces such as
            "2 nN", of the points in contact that count.
        accuracy: of the solver, as for `bem.simulate`.
        report: called with the number of evaluations so far and the misfit in standard deviations of the noise.

    Returns:
        the fit; its `sentences` say which model, and what the curve does not determine or contradicts.

    Raises:
        ValueError: an unknown model, parameter or accuracy, or a curve without contact or baseline.
        FitError: the fit did not converge.
    """
    instance("curve", curve, (ForceCurve,))
    require_options(instance("setup", setup, (Setup,)).half_angle, model, segment, within)
    resolve_accuracy(accuracy)
    if setup.stiffness is None and curve.stiffness is not None:
        setup = setup.replaced(stiffness=curve.stiffness)
    if free is not None:
        model = "solver" if model == AUTO else model
        free = (free,) if isinstance(free, str) else tuple(free)
        names = [each.name for each in (*LADDER[model].parameters, CONTACT_POINT)]
        unknown = [name for name in free if name not in (*names, *LINEAR)]
        if unknown or not set(free) & set(names):
            raise ValueError(
                f"free must be one or more of {', '.join(names)}, with or without force_offset, tilt, drag and drift; "
                f"received {shown(unknown[0] if unknown else ', '.join(free))}"
            )
    data = measurement_of(curve, setup, segment)
    start = hertz_line(data)
    if within is not None:
        data = _within(data, within, start["contact_point"])
    climb = Climb(data, start, free, accuracy, report)
    try:
        climb, best = climb.finished(model)
    except NoContactError as error:
        raise FitError(f"the fit did not converge: the solver does not complete the contact ({error})") from error
    zero = False
    if free is None and best.model.adhesive and best.adequate:
        hertz = climb.fits.get("hertz") or climb.rung("hertz")
        zero = hertz.criterion(best) < best.criterion(best)
    said = ["Hertz describes the curve as well: the work of adhesion may be zero."] if zero else []
    result = result_of(curve, best, list(climb.fits.values()), climb.alike(best), said)
    if zero:  # the ends of the contact are chosen, which finds a little adhesion in any noise
        result.intervals["work_of_adhesion"] = (0.0, result.intervals["work_of_adhesion"][1])
    return result


def require_options(
    half_angle: float | None,
    model: str = AUTO,
    segment: Segment = "both",
    within: tuple[Quantity | None, Quantity | None] | None = None,
) -> None:
    """Raise a `ValueError` unless `fit` takes these, whatever the curve."""
    if model != AUTO and model not in LADDER:
        raise ValueError(f"model must be auto or one of {', '.join(LADDER)}; received {shown(model)}")
    if model == "cone" and half_angle is None:
        raise ValueError("half_angle must be given for a cone; received None")
    if segment not in get_args(Segment):
        raise ValueError(f"segment must be one of {', '.join(get_args(Segment))}; received {shown(segment)}")
    if within is not None:
        _ends(within)


def _ends(within: tuple[Quantity | None, Quantity | None]) -> tuple[str, float, float]:
    """What a range counts, length or force, and its ends in SI."""
    given, kind = [-np.inf if within[0] is None else within[0], np.inf if within[1] is None else within[1]], "length"
    try:
        low, high = (to_si("range", end, kind) for end in given)
    except ValueError:
        kind = "force"
        low, high = (to_si("range", end, kind) for end in given)
    if not low < high:
        raise ValueError(f"the range must grow; received {shown(within)}")
    return kind, low, high


def _within(data: Measurement, within: tuple[Quantity | None, Quantity | None], contact_point: float) -> Measurement:
    """The points in contact inside a range of indentation or of force."""
    kind, low, high = _ends(within)
    pressed, depth = data.baseline - data.tension, data.depth - (contact_point - data.place[data.first])
    values = depth if kind == "length" else pressed
    inside, apart = (values >= low) & (values <= high), data.depth <= 0.0
    count = np.count_nonzero(data.weights * inside * ~apart)
    if count < FEWEST:
        raise ValueError(
            f"the range must hold {FEWEST} points in contact; received {shown(within)}, which holds {count}"
        )
    return dataclasses.replace(data, weights=data.weights * (inside | apart))


@dataclass
class Climb:
    """The models that were fitted to one curve, in this order."""

    data: Measurement
    start: dict[str, float]
    free: tuple[str, ...] | None = None
    accuracy: str | float = "standard"
    report: Callable[[int, float], None] | None = None
    drift: bool = False
    fits: dict[str, Fitted] = field(default_factory=dict)

    def finished(self, model: str) -> tuple[Climb, Fitted]:
        """The climb and its end, or the one rung of a name, with a drift where the criterion calls for it."""
        best, data = self.climb() if model == AUTO else self.rung(model), self.data
        drift = np.zeros((best.residuals.size, 1))
        drift[: len(best.problem), 0] = data.columns["drift"] * data.weights / data.noise
        called = best.calls_for(drift)
        # Relaxation takes up a drift, so that its residuals need not call for it.
        sought = called or (model == AUTO and (not best.adequate or best.model.name in ("ting", "solver")))
        if self.free is not None or not sought or not data.shows_drift:
            return self, best
        other = dataclasses.replace(self, fits={}, drift=True)
        drifting = other.climb(called and best.adequate) if model == AUTO else other.rung(model)
        judge = min((self._closest(), other._closest()), key=lambda each: each.misfit)
        # As in a climb, the misfit decides where no rung describes the curve.
        better = drifting.criterion(judge) < best.criterion(judge)
        better &= drifting.adequate or drifting.misfit < best.misfit
        return (other, drifting) if better else (self, best)

    def climb(self, solver: bool = True) -> Fitted:
        """The simplest model that the next rung does not improve on."""
        if self.data.setup.half_angle is not None:
            return self.rung("cone")
        hertz = self.rung("hertz")
        for name in ("dmt", "jkr"):
            self.rung(name)
        best = self.best()
        # Where no rung describes the curve, the criterion has no independent points to count: the misfit decides.
        adheres = best.model.adhesive or best.misfit < _BETTER * hertz.misfit
        relaxes, one_way = not best.adequate or self._relaxes(best if adheres else hertz), self.data.one_way
        relaxes |= self.held and not adheres
        if relaxes or (one_way and best.model.adhesive):
            self.rung("ting")
        if solver and relaxes and adheres and (self.best().model.adhesive or self.best().beyond_chance):
            # What the solver does not complete is no rung.
            with suppress(NoContactError):
                self.rung("solver")
        return self.best()

    @property
    def held(self) -> bool:
        """Whether the relaxation of the solid is known."""
        return isinstance(self.data.setup.material, PronySeries)

    def best(self) -> Fitted:
        """The rung of the lowest criterion so far, for noise as correlated as the residuals of the closest."""
        closest = self._closest()
        best = min(self._standing(), key=lambda each: each.criterion(closest))
        if not best.adequate:
            return closest
        names = [each.model.name for each in (best, *self.alike(best))]
        if best.model.name not in _TWINS or not set(_TWINS) <= set(names):
            return best
        # What the force does not tell, the Tabor parameter of the fitted values may: DMT below 1, JKR above.
        return self.fits["dmt" if best.setup.physical_tabor < 1.0 else "jkr"]

    def alike(self, best: Fitted) -> tuple[Fitted, ...]:
        """Models that are not told from the best: of one family by the criterion.

        Hertz has adhesion beside it that fits better than chance allows, and not yet as much as the criterion asks for.
        """
        judge = self._closest()
        family = (*_TWINS, "ting") if self.data.one_way else _TWINS  # an approach alone does not tell Ting either
        names, more = family if best.model.name in family else (), _ALIKE
        if best.model.name == "hertz":
            names, more = _TWINS, 5.0 * np.log(judge.independent) - _HIDDEN
        others = [each for each in self._standing() if each.model.name in names and each is not best]
        least = best.criterion(judge)
        return tuple(each for each in others if each.criterion(judge) < least + more)

    def rung(self, name: str) -> Fitted:
        """Fit one model, with offset, tilt and, where the curve tells them, drag and drift."""
        begin = time.process_time()
        model, data, setup = LADDER[name], self.data, self.data.setup
        held = MEMORY if self.held and name in ("solver", "ting") else ()
        nonlinear = tuple(each.name for each in (*model.parameters, CONTACT_POINT) if each.name not in held)
        guesses = self._start(model)
        start = {each: guesses[each] for each in nonlinear}
        linear = (*data.linear, *("drift",) * self.drift)
        if self.free is not None:
            known = vars(setup) | {"modulus_ratio": setup.material.modulus_ratio, "contact_point": 0.0}
            start |= {each: known[each] for each in nonlinear if each not in self.free and known.get(each) is not None}
            nonlinear = tuple(each for each in nonlinear if each in self.free)
            linear = tuple(each for each in LINEAR if each in self.free)
        problem = Regression(model, data, start, nonlinear, linear, report=self.report)
        if name == "solver":
            problem.options = {"jumps": data.jumps}
            starts = memories(start, data.duration) if set(MEMORY) <= set(nonlinear) else [start]
            found = search(problem, starts, self.accuracy)
        else:
            found = problem.run(np.zeros(len(nonlinear)))
        self.fits[name] = dataclasses.replace(found.at_its_bounds(), seconds=time.process_time() - begin)
        return self.fits[name]

    def _closest(self) -> Fitted:
        """The rung of the smallest misfit."""
        return min(self._standing(), key=lambda each: each.misfit)

    def _standing(self) -> list[Fitted]:
        """The rungs without those whose memory vanishes at the end of its range, unless there is no other."""
        elastic = [each for each in self.fits.values() if "modulus_ratio" in each.at_bound]
        elastic = [each for each in elastic if each.values["modulus_ratio"] > 0.99]
        return [each for each in self.fits.values() if each not in elastic] or list(self.fits.values())

    def _start(self, model: Model) -> dict[str, float]:
        """First guesses, from what simpler rungs found."""
        hertz, pull = self.fits.get("hertz"), 2.0 if model.name == "dmt" else 1.5
        start = self.start | (hertz.values if hertz and not hertz.at_bound and model.name != "solver" else {})
        largest = float(np.max(self.data.tension[self.data.weights > 0.0])) - self.data.baseline
        start["work_of_adhesion"] = max(largest, self.data.noise) / (pull * np.pi * self.data.setup.radius)
        start |= {"modulus_ratio": 0.4, "retardation_time": 0.1 * self.data.duration}
        return start

    def _relaxes(self, fitted: Fitted) -> bool:
        """Whether the residuals of an elastic rung hold the trace of a memory."""
        data, slight = self.data, fitted.values | {"modulus_ratio": _SLIGHT}
        relaxed = [slight | {"retardation_time": share * data.duration} for share in _MEMORIES]
        tensions = np.column_stack([LADDER["ting"].tension(each, data) for each in relaxed])
        changes = tensions - LADDER["hertz"].tension(fitted.values, data)[:, None]
        return fitted.calls_for(changes * (data.weights / data.noise)[:, None])
