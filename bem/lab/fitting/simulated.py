"""The search of the solver's parameters: several memories at draft accuracy, then the best at the wanted one.

A force that decays over a dwell looks like the beginning of a slow relaxation or the whole of a faster and smaller one,
and a search does not cross from one to the other. It therefore begins at several retardation times and modulus ratios,
until it has found the lowest misfit twice. Adhesion and relaxation trade off along a bent valley of nearly one misfit:
it is followed in both directions, for a lower misfit further along it and for the ends of the intervals.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from contextlib import suppress

import numpy as np
from scipy.interpolate import CubicSpline

from bem._support.validation import FloatArray
from bem.lab.fitting.regression import Fitted, Regression
from bem.lab.models.solver import NoContactError
from bem.problem.accuracy import TIGHTEST, resolve_accuracy

_TIMES, _RATIOS = (0.003, 0.01, 0.03, 0.1, 0.25, 1.0), (0.5, 0.2)  # of the duration, and of the moduli, to begin with
_SHORT, _LONG, _TRIED = 8, 20, 6  # evaluations of a run from a start and of one that ends, and starts that are run
_TWICE = 1.002  # times the misfit, up to which two runs have found the same
_CLOSENESS = 1e-4  # relative change of chi-square, from which on a run has ended
_WORK = 5e10  # multiplications and additions of a search, some ten seconds
_TIGHTER = 4.0  # of the last run of a curve that tells such an error
_TELLS = 2e-4  # noise of the mean of all points over the range of the force, below which it does
_STEPS, _CORRECTED = 6, 3  # of a standard deviation along a valley at most, and evaluations of each
_WIDEST = 1.0  # standard deviation of a search, beyond which a valley has no end
_LOWER = 0.5  # of chi-square, by which a point of the valley is lower than the end of a search
_AGAIN = 3  # times that a search goes on from there


def search(problem: Regression, starts: Iterable[Mapping[str, float]], accuracy: str | float) -> Fitted:
    """The best of the runs from `starts`, parameters in SI, at `accuracy`, with the ends of its intervals.

    Raises:
        NoContactError: the solver completes no contact from any of them.
    """
    data, budget = problem.data, [_WORK]
    problem.options |= {"accuracy": "draft", "budget": budget}
    points = sorted(map(problem.point, starts), key=lambda x: float(np.sum(problem.residuals(x) ** 2)))
    best = _best_of_runs(problem, points[:_TRIED])
    found_with = "draft", False
    with suppress(NoContactError):
        best = problem.run(best.x, _LONG, _CLOSENESS)
        # The solver's own error makes the misfit rough, and a search stops in a dent: central differences go on, and
        # where the curve tells it a finer accuracy.
        problem.central = True
        tells = data.noise < _TELLS * float(np.ptp(data.tension)) * len(problem) ** 0.5
        problem.options["accuracy"] = max(resolve_accuracy(accuracy).target / (_TIGHTER if tells else 1.0), TIGHTEST)
        best = problem.run(best.x, _LONG, _CLOSENESS)
        found_with = problem.options["accuracy"], True
        for _ in range(_AGAIN):
            problem.options["budget"] = None
            best, lower = followed(best)
            problem.options["budget"] = budget
            if lower is None or budget[0] < 0.0:
                break
            best = min(best, problem.run(lower, _LONG, _CLOSENESS), key=lambda run: run.misfit)
    problem.options["budget"] = None
    problem.options["accuracy"], problem.central = found_with
    # A run that spends the budget has no derivatives where it ends.
    return dataclasses.replace(problem.fitted(best.x, budget[0] >= 0.0), ends=best.ends)


def memories(start: Mapping[str, float], duration: float) -> list[dict[str, float]]:
    """Points with several retardation times and modulus ratios.

    An approach shows a stiffer solid than the relaxed one, and a retraction a larger adhesion than the work of it.
    """
    return [
        {**start, "retardation_time": share * duration, "modulus_ratio": ratio,
         "relaxed_modulus": start["relaxed_modulus"] * ratio**0.25,
         "work_of_adhesion": start["work_of_adhesion"] * ratio**0.6}
        for ratio in _RATIOS
        for share in _TIMES
    ]  # fmt: skip


def _best_of_runs(problem: Regression, points: Iterable[FloatArray]) -> Fitted:
    """The best of short runs from points, of which no more are made after two with the lowest misfit."""
    runs: list[Fitted] = []
    failure = NoContactError("the solver completes no contact")
    for x in points:
        try:
            runs.append(problem.run(x, _SHORT, _CLOSENESS))
        except NoContactError as error:
            failure = error
            continue
        runs.sort(key=lambda run: run.misfit)
        if len(runs) > 1 and runs[1].misfit < _TWICE * runs[0].misfit:
            break
    if not runs:
        raise failure
    return runs[0]


def followed(best: Fitted) -> tuple[Fitted, FloatArray | None]:
    """A solution with the ends of its intervals, and a point along its valley of a lower misfit, if there is one.

    The valley is the curve of least squares across the direction that the data determine least, in steps of a standard
    deviation. Chi-square's 95 % region is taken for the ellipsoids across the valley along it, which in a linear
    problem it is.
    """
    problem, reach = best.problem, best.quantile**2
    jacobian, least = problem.jacobian(best.x), float(best.residuals @ best.residuals)
    values, vectors = np.linalg.eigh(jacobian.T @ jacobian)
    deviations = vectors * np.sqrt(best.variance / np.maximum(values, 1e-14))
    if np.abs(deviations[:, 0]).max() > _WIDEST:
        return best, None
    correction = -vectors[:, 1:] @ np.linalg.pinv(jacobian @ vectors[:, 1:])
    found = [(0.0, 0.0, best.x)]
    for side in (-1.0, 1.0):
        x, place, length, direction = best.x, 0.0, side, deviations[:, 0]
        for _ in range(_STEPS):
            tried, ahead = [], x + length * direction
            for _ in range(_CORRECTED):
                ahead = np.clip(ahead, *problem.bounds)
                residuals = problem.residuals(ahead)
                tried.append((float(residuals @ residuals - least) / best.variance, ahead))
                ahead = ahead + correction @ residuals
            rise, ahead = min(tried, key=lambda each: each[0])
            if rise > 3.0 * reach:
                length *= 0.5
                continue
            place += length
            found.append((place, rise, ahead))
            if rise > reach:
                break
            x, direction = ahead, (ahead - x) / length
    _, rise, lowest = min(found, key=lambda each: each[1])
    if rise < -_LOWER:
        return best, lowest
    if len(found) < 3:  # walls on both sides
        return best, None
    places, rises, points = map(np.array, zip(*sorted(found, key=lambda each: each[0]), strict=True))
    fine = np.linspace(places[0], places[-1], 500)
    left = reach - CubicSpline(places, rises)(fine)
    across = np.sqrt(np.maximum(left, 0.0))[:, None] * np.linalg.norm(deviations[:, 1:], axis=1)
    middle = CubicSpline(places, points)(fine)
    ends = (middle - across)[left >= 0.0].min(axis=0), (middle + across)[left >= 0.0].max(axis=0)
    return dataclasses.replace(best, ends=ends), None
