"""Fit modulus, work of adhesion and relaxation to a measured force curve by the simplest model that describes it.

Hertz, DMT and JKR are fitted first, Ting where none of them is adequate, and the contact itself where the curve shows
adhesion and relaxation both. Of the adequate models the Bayesian information criterion chooses. Tilt of the baseline,
drag of the liquid and, with two baselines, drift in time are always fitted: one too small to be seen would still bias
the others. Intervals are those of the linearised problem, for the slow noise of the residuals.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import get_args

import numpy as np

from bem._support.validation import instance
from bem._support.wording import shown
from bem.lab.contact_point import STANDS_OUT
from bem.lab.curve import ForceCurve
from bem.lab.fitting.fitted import Fitted, run
from bem.lab.fitting.measurement import Measurement, Segment, hertz_line, measurement_of
from bem.lab.fitting.regression import Regression
from bem.lab.fitting.result import FitError, FitResult, result_of
from bem.lab.fitting.search import search
from bem.lab.models import CONTACT_POINT, LINEAR, MODELS
from bem.lab.models.contact import NoContactError
from bem.lab.setup import Setup
from bem.problem.accuracy import resolve_accuracy
from bem.problem.materials import PronySeries
from bem.problem.scene import LARGEST_TABOR as HIGHEST_TABOR

AUTO = "auto"
_ALIKE = 10.0  # difference of the criterion from which two models are told apart
_RETRIED = 1.02  # times the misfit of one adhesive model, from which the other is fitted again from its values
_HIDDEN = 15.0  # of chi-square, by which adhesion with its ends lowers it in one curve of Hertz in twenty
_TWINS = ("dmt", "jkr")
_OFF_A_LAYER = ("cone", "jkr", "contact")


def fit(
    curve: ForceCurve,
    setup: Setup,
    free: Sequence[str] | None = None,
    *,
    model: str = AUTO,
    segment: Segment = "both",
    accuracy: str | float = "standard",
) -> FitResult:
    """Fit a measured curve.

    Args:
        curve: the measurement, from out of contact on, or from contact on at force zero.
        setup: what is known: radius, Poisson's ratio, spring, thickness, and what is not in `free`;
            `bem.lab.fitting.guess_setup` makes one from the curve. With its `stiffness`, or that of a curve with a
            stage, the fit moves the stage, and the contact point is a position of the stage.
        free: the parameters to fit, of the model's, contact_point, force_offset, tilt, drag and drift; the others are
            the setup's, or zero. `None` fits all.
        model: a name of `bem.lab.models.MODELS`; "auto" chooses, or with `free` takes the contact.
        segment: "approach", "retract" or "both": the points that count.
        accuracy: of the contact, as for `bem.simulate`.

    Returns:
        the fit; its `sentences` say which model, and what the curve does not determine or contradicts.

    Raises:
        ValueError: an unknown model, parameter or accuracy, a model that does not hold, or a curve without contact.
        FitError: the fit did not converge.
    """
    instance("curve", curve, (ForceCurve,))
    _require_options(instance("setup", setup, (Setup,)), model, segment)
    resolve_accuracy(accuracy)
    if setup.stiffness is None and curve.stiffness is not None:
        setup = setup.replaced(stiffness=curve.stiffness)
    if free is not None:
        model = "contact" if model == AUTO else model
        free = (free,) if isinstance(free, str) else tuple(free)
        names = [parameter.name for parameter in (*MODELS[model].parameters, CONTACT_POINT)]
        unknown = [name for name in free if name not in (*names, *LINEAR)]
        if unknown or not set(free) & set(names):
            raise ValueError(
                f"free must be one or more of {', '.join(names)}, with or without force_offset, tilt, drag and drift; "
                f"received {shown(unknown[0] if unknown else ', '.join(free))}"
            )
    choice = _Choice(measurement_of(curve, setup, segment), free, accuracy)
    try:
        best = choice.made() if model == AUTO else choice.fitted(model)
        if best.model.spans and free is None and "hertz" not in choice.fits:
            choice.fitted("hertz")
        try:
            return choice.result(curve, best)
        except NoContactError:  # along the whole path, which the search averaged
            if model != AUTO:
                raise
            del choice.fits["contact"]
            return choice.result(curve, choice.best())
    except NoContactError as error:
        raise FitError(f"the fit did not converge: the solver does not complete the contact ({error})") from error


def _require_options(setup: Setup, model: str, segment: Segment) -> None:
    """Raise a `ValueError` unless `fit` takes these, whatever the curve."""
    if model != AUTO and model not in MODELS:
        raise ValueError(f"model must be auto or one of {', '.join(MODELS)}; received {shown(model)}")
    if setup.thickness is not None and model in _OFF_A_LAYER:
        raise ValueError(f"thickness must be left out with {model}, of which no formula for a layer is known here")
    if segment not in get_args(Segment):
        raise ValueError(f"segment must be one of {', '.join(get_args(Segment))}; received {shown(segment)}")


class _Choice:
    """The models that were fitted to one curve, in this order."""

    def __init__(self, data: Measurement, free: tuple[str, ...] | None, accuracy: str | float) -> None:
        self.data, self.free, self.accuracy = data, free, accuracy
        self.start = hertz_line(data)
        self.fits: dict[str, Fitted] = {}
        self.seconds: dict[str, float] = {}

    def made(self) -> Fitted:
        """The simplest adequate model, or the closest of all."""
        setup = self.data.setup
        if setup.half_angle is not None:
            return self.fitted("cone")
        hertz = self.fitted("hertz")
        adhesive = [self.fitted(name) for name in _TWINS if setup.thickness is None or name not in _OFF_A_LAYER]
        for jump in self.data.jumps:
            if not jump.out:  # the sphere then touches; a search from elsewhere may end in a wrong beginning of contact
                position = float(np.interp(jump.time, self.data.time, self.data.position))
                adhesive = [self.fitted(candidate.model.name, {"contact_point": position}) for candidate in adhesive]
        if len(adhesive) > 1:  # where one chose wrong ends of the contact, the other may know better
            worse, better = sorted(adhesive, key=lambda candidate: -candidate.misfit)
            if worse.misfit > _RETRIED * better.misfit:
                by_pull = 4.0 / 3.0 if better.model.name == "dmt" else 0.75  # DMT pulls by 2, JKR by 3/2 pi R w
                adhesion = by_pull * better.values["work_of_adhesion"]
                self.fitted(worse.model.name, better.values | {"work_of_adhesion": adhesion})
        # Wrong shapes look like adhesion too, but do not pull.
        pulled = float(np.max((self.data.tension - hertz.problem.baseline) * self.data.weights))
        adheres = pulled > STANDS_OUT * self.data.noise
        best = self.best()
        if isinstance(setup.material, PronySeries) and not adheres:
            return self.fitted("ting")
        if not best.judgement.adequate or (self.data.one_way and best.model.name in _TWINS):
            self.fitted("ting")
        if not self.best().judgement.adequate and adheres and setup.thickness is None:
            with suppress(NoContactError):  # what the solver does not complete is no answer
                self.fitted("contact")
        return self.best()

    def alike(self, best: Fitted) -> tuple[Fitted, ...]:
        """Adequate models that are not told from the best, of one family, by the criterion.

        Hertz has adhesion beside it that fits better than chance allows, and not yet as much as the criterion needs.
        """
        family = (*_TWINS, "ting") if self.data.one_way else _TWINS  # an approach alone does not tell Ting either
        names, more = family if best.model.name in family else (), _ALIKE
        if best.model.name == "hertz":
            names, more = _TWINS, 5.0 * np.log(best.independent) - _HIDDEN
        rivals = [self.fits[name] for name in names if name in self.fits and self.fits[name] is not best]
        least = best.criterion(best)
        return tuple(rival for rival in rivals if rival.judgement.adequate and rival.criterion(best) < least + more)

    def result(self, curve: ForceCurve, best: Fitted) -> FitResult:
        """The result with this fit as the best."""
        return result_of(curve, best, self.alike(best), self.fits, self.seconds)

    def best(self) -> Fitted:
        """The adequate model of the lowest criterion so far; where none is adequate, the closest."""
        closest = min(self.fits.values(), key=lambda candidate: candidate.misfit)
        adequate = [candidate for candidate in self.fits.values() if candidate.judgement.adequate]
        if not adequate:
            return closest
        best = min(adequate, key=lambda candidate: candidate.criterion(closest))
        names = [candidate.model.name for candidate in (best, *self.alike(best))]
        if best.model.name not in _TWINS or not set(_TWINS) <= set(names):
            return best
        # What the force does not tell, the Tabor parameter of the fitted values may: DMT below 1, JKR above.
        return self.fits["dmt" if best.setup.physical_tabor < 1.0 else "jkr"]

    def fitted(self, name: str, further: Mapping[str, float] | None = None) -> Fitted:
        """Fit and judge one model, with what enters linearly and the curve tells apart.

        With `further`, a second time from these values too; the better of the two stays.
        """
        begin = time.process_time()
        model, data, setup = MODELS[name], self.data, self.data.setup
        if name == "contact":  # the range of adhesion is the equilibrium gap
            setup = setup.replaced(largest_tabor=HIGHEST_TABOR)
            data = dataclasses.replace(data, setup=setup)
        held = ("retardation_time", "modulus_ratio") if isinstance(setup.material, PronySeries) else ()
        nonlinear = tuple(key.name for key in (*model.parameters, CONTACT_POINT) if key.name not in held)
        linear, start = data.linear, self._start(model.name) | dict(further or {})
        start = {key: start[key] for key in nonlinear}
        if self.free is not None:
            values = vars(setup) | {"modulus_ratio": setup.material.modulus_ratio, "contact_point": 0.0}
            start |= {key: values[key] for key in nonlinear if key not in self.free and values.get(key)}
            start |= {"contact_point": 0.0} if "contact_point" not in self.free else {}
            nonlinear = tuple(key for key in nonlinear if key in self.free)
            linear = tuple(key for key in LINEAR if key in self.free)
        problem = Regression(model, data, start, nonlinear, linear)
        if name == "contact":
            problem.options = {"jumps": data.jumps}
            best = search(problem, start, self.accuracy)
        else:
            best = run(problem, np.zeros(len(nonlinear)))
        if name not in self.fits or best.misfit < self.fits[name].misfit:
            self.fits[name] = best
        self.seconds[name] = self.seconds.get(name, 0.0) + time.process_time() - begin
        return self.fits[name]

    def _start(self, name: str) -> dict[str, float]:
        """First guesses, from what simpler models gave."""
        hertz, pull = self.fits.get("hertz"), 2.0 if name == "dmt" else 1.5
        start = self.start | (hertz.values if hertz and not hertz.at_bound and name != "contact" else {})
        largest = float(np.max(self.data.tension[self.data.weights > 0.0])) - self.data.baseline
        start["work_of_adhesion"] = max(largest, self.data.noise) / (pull * np.pi * self.data.setup.radius)
        return start | {"modulus_ratio": 0.4, "retardation_time": 0.1 * self.data.duration}
