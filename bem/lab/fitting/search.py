"""The search of the contact's parameters: several memories at draft accuracy, then the best at the wanted one.

A force that decays over a hold looks like the beginning of a slow relaxation or the whole of a faster and smaller one,
and a search does not cross from one to the other. It therefore begins at several retardation times and modulus ratios,
until it has met the lowest misfit twice.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.fitting.fitted import Fitted, fitted_at, run
from bem.lab.fitting.regression import Regression
from bem.lab.models.contact import NoContactError

_TIMES, _RATIOS = (0.005, 0.03, 0.15, 1.0), (0.5, 0.2)  # of the duration, and of the moduli, to begin with
_ADHESIONS = (0.8, 0.4, 0.15)  # of the elastic work of adhesion: an edge that relaxes pulls more than its work
_SHORT, _LONG, _TRIED = 6, 20, 5  # evaluations of a run from a start and of one that ends, and starts that are run
_FARTHER = 4.0, 8.0  # times the last step, at which the misfit of a run that has ended is no lower
_TWICE = 1.002  # times the misfit, up to which two runs have met the same
_ACCURACY = 0.016  # of the runs before the last: a little tighter than a draft, so that a crack takes whole steps
_CLOSENESS = 1e-4  # relative change of chi-square, from which on a run has ended
_WORK = 1.2e11  # multiplications and additions of a search, some eight seconds
_KEPT = 0.35  # of them, for the last run


def search(problem: Regression, start: Mapping[str, float], accuracy: str | float) -> Fitted:
    """The best of the runs from several memories, or from `start` where the memory is known, at `accuracy`.

    Raises:
        NoContactError: the solver completes no contact from any of them.
    """
    budget = [_WORK]
    problem.options |= {"accuracy": _ACCURACY, "budget": budget}
    starts = _starts(start, set(problem.free), problem.data.duration)
    points = sorted(map(problem.point, starts), key=lambda x: float(np.sum(problem.residuals(x) ** 2)))
    runs: list[Fitted] = []
    failure = NoContactError("the solver completes no contact")
    for x in points[:_TRIED]:
        try:
            runs.append(run(problem, x, _SHORT, _CLOSENESS))
        except NoContactError as error:
            failure = error
            continue
        runs.sort(key=lambda run: run.misfit)
        met_twice = len(runs) > 1 and runs[1].misfit < _TWICE * runs[0].misfit
        if met_twice or budget[0] < _KEPT * _WORK:
            break
    if not runs:
        raise failure
    best, reached = runs[0], problem.options["accuracy"]
    problem.narrow_steps(best.jacobian)
    with suppress(NoContactError):
        problem.options["accuracy"] = accuracy
        best, reached = _last(problem, best.x), accuracy
    problem.options |= {"accuracy": reached, "budget": None}
    # A run that spends the budget has no derivatives where it ends.
    return fitted_at(problem, best.x, best.converged and budget[0] >= 0.0)


def _last(problem: Regression, x: FloatArray) -> Fitted:
    """The last run. It did not converge where the misfit falls farther along its step.

    The solver's own error makes the bottom of a valley uneven, so that a run may end on its way.
    """
    fitted = run(problem, x, _LONG, _CLOSENESS)
    step = np.linalg.lstsq(problem.jacobian(fitted.x), -problem.residuals(fitted.x), rcond=1e-9)[0]
    points = [np.clip(fitted.x + factor * step, *problem.bounds) for factor in _FARTHER]
    least = min(float(np.sum(problem.residuals(point) ** 2)) for point in points)
    return replace(fitted, converged=fitted.converged and least * _TWICE**2 > float(np.sum(fitted.residuals**2)))


def _starts(start: Mapping[str, float], free: set[str], duration: float) -> list[dict[str, float]]:
    """Points with several retardation times, modulus ratios and works of adhesion, as far as they are free.

    An approach shows a stiffer solid than the relaxed one.
    """
    memories: list[dict[str, float]] = [{}]
    if {"retardation_time", "modulus_ratio"} <= free:
        memories = [
            {"retardation_time": share * duration, "modulus_ratio": ratio}
            | {"relaxed_modulus": start["relaxed_modulus"] * ratio**0.25}
            for ratio, share in itertools.product(_RATIOS, _TIMES)
        ]
    works = [start["work_of_adhesion"] * share for share in (_ADHESIONS if "work_of_adhesion" in free else (1.0,))]
    return [{**start, **memory, "work_of_adhesion": work} for memory, work in itertools.product(memories, works)]
