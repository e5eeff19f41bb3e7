"""Fit modulus, work of adhesion and relaxation to a measured force curve, with 95 % intervals.

The solver runs inside a least-squares search, at draft accuracy from several starts and then at standard accuracy from
the best of them. Parameters are searched as logarithms; the offset of the force, which enters linearly, is solved for
at every step. Where the measured force jumps, the instant of the jump is compared and not the forces beside it. The
noise is estimated from the residuals. Intervals are those of the linearised problem at the solution; where neighbouring
residuals are correlated they are widened as for that many fewer independent points.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from bem._support.validation import FloatArray, instance
from bem._support.wording import shown
from bem.accuracy import TIGHTEST, resolve_accuracy
from bem.effects.scene_effects import Effects
from bem.lab.contact_point import Contact
from bem.lab.curve import ForceCurve
from bem.lab.fitting.jumps import measured_jumps, weights_of
from bem.lab.fitting.model import Model, prescribed_path, with_memory
from bem.lab.fitting.model_choice import effects_called_for, sentence
from bem.lab.fitting.parameters import MEMORY, PARAMETERS
from bem.lab.fitting.result import FitError, FitResult, result_of
from bem.lab.fitting.search import Search
from bem.lab.fitting.starts import faster_memories, starting_points
from bem.lab.guess import first_contact
from bem.lab.setup import Setup
from bem.materials import Elastic, StandardLinearSolid

ALL = tuple(PARAMETERS)
ELASTIC = ("relaxed_modulus", "work_of_adhesion", "contact_point", "force_offset")

DIFFERENCE = 0.02  # of a logarithm, or of the adhesion length; large enough that the solver's own errors do not matter
_SHORT, _LONG, _POLISH, _ROUNDS = 4, 14, 12, 3  # evaluations of the Jacobian, and times it is polished
_KEPT = 2  # runs continued
_CORRECTIONS, _TIGHTER = 4, 4.0
_LONGEST = 10.0  # steps of the search, that one correction moves a parameter
_SMALL = 0.1  # gain in squared standard deviations, below which the solution is settled
_SCATTER = 0.02  # adhesion lengths of travel, by which the solver's own error moves a jump
_AS_GOOD = 1.1  # noise of a simpler fit over that of the full one


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
    if unknown or not set(chosen) - {"force_offset"}:
        names = ", ".join(name for name in ALL if name != "force_offset")
        received = shown(unknown[0] if unknown else ", ".join(chosen))
        raise ValueError(f"free must be one or more of {names}, with or without force_offset; received {received}")
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
    if free is not None:
        return _fitted(curve, setup, chosen, contact, duration, accuracy, report)
    result, effects = _fewest(curve, setup, contact, duration, accuracy, report)
    return dataclasses.replace(result, sentences=(sentence(effects), *result.sentences))


def _fewest(
    curve: ForceCurve,
    setup: Setup,
    contact: Contact,
    duration: float,
    accuracy: str | float,
    report: Callable[[int, float], None] | None,
) -> tuple[FitResult, Effects]:
    """The fit of all parameters, or the elastic one where that describes the curve as well."""
    try:
        result = _fitted(curve, setup, ALL, contact, duration, accuracy, report)
    except FitError:
        # A memory that the curve does not show leaves the search without a minimum.
        elastic = setup.replaced(material=Elastic(), retardation_time=None)
        result = _fitted(curve, elastic, ELASTIC, contact, duration, accuracy, report)
        return result, effects_called_for(result)
    effects = effects_called_for(result)
    if effects.terms == 0 or not result.determines_memory():
        elastic = result.setup.replaced(material=Elastic(), retardation_time=None)
        simpler = _fitted(curve, elastic, ELASTIC, contact, duration, accuracy, report)
        if simpler.noise < _AS_GOOD * result.noise:
            return simpler, effects_called_for(simpler)
    return result, effects


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
    levels = dataclasses.replace(curve, force=curve.tension - contact.force_offset, force_sign="tension")
    least = _SCATTER * setup.adhesion_length * duration / float(np.sum(np.abs(np.diff(prescribed_path(curve, setup)))))
    model = Model(curve, setup, measured_jumps(levels, contact.noise), least)
    search = Search(model, free, fixed, unit, starts[0], weights_of(curve, contact.noise), report=report)
    points = sorted((search.point(start) for start in starts), key=search.misfit)
    runs = search.until_good(points, _SHORT)
    best = search.until_good([run.x for run in runs[:_KEPT]], _LONG)[0]
    others = faster_memories(search.values(best.x), free)
    best = min([best, *(search.run(search.point(start), _LONG) for start in others)], key=lambda run: run.cost)
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
        # The column of the offset is in 1/N: columns of one length let the least squares see all of them.
        length = np.maximum(np.linalg.norm(jacobian[smooth], axis=0), np.finfo(float).tiny)
        step = np.linalg.lstsq(jacobian[smooth] / length, -residuals[smooth], rcond=1e-6)[0] / length
        moved = np.clip(x + np.clip(step[: x.size], -_LONGEST, _LONGEST), *search.bounds)
        ahead = search.residuals(moved)
        if not ahead @ ahead < residuals @ residuals:
            break
        gained = residuals @ residuals - ahead @ ahead
        x, residuals = moved, ahead
        if gained < _SMALL:
            break
        jacobian, smooth = search.full_jacobian(x)
    return x, residuals[smooth], jacobian[smooth]
