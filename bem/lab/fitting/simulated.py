"""The search of the solver's parameters: several memories at draft accuracy, then the best at the wanted one.

A force that decays over a dwell looks like the beginning of a slow relaxation or the whole of a faster and smaller one.
A search does not cross from one to the other. It therefore begins at several retardation times and modulus ratios, and
from what it finds at faster and slower memories, until the residuals are noise.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from contextlib import suppress

import numpy as np

from bem._support.validation import FloatArray
from bem.accuracy import TIGHTEST, resolve_accuracy
from bem.lab.contact_point import noise_of
from bem.lab.fitting.regression import Fitted, Regression
from bem.lab.models.solver import MEMORY, NoContactError

_TIMES, _RATIOS = (0.02, 0.07, 0.25), (0.5, 0.2)  # of the duration, and of the moduli, to begin with
_SHORT, _LONG, _LAST, _KEPT = 4, 14, 5, 2  # evaluations of a run, and runs that are continued
_AGAIN = 4  # times the last run is continued
_ALONG = 3.0  # standard deviations
_LOWER = 0.995  # of the misfit, above which a search from further along found nothing new
_FASTER = (8.0, 1 / 8.0)
_CLOSENESS = 1e-5
_WORK = 1e11  # multiplications and additions of a search, some ten seconds
_NOISE = 1.04  # times the scatter between neighbours, up to which residuals are noise
_TIGHTER = 4.0  # of the last run of a curve that tells such an error
_TELLS = 2e-4  # noise of the mean of all points over the range of the force, below which it does
LONGER = 1.5  # times the effective range, with which its bias is estimated


def search(problem: Regression, starts: Iterable[Mapping[str, float]], accuracy: str | float) -> Fitted:
    """The best of the runs from `starts`, parameters in SI; at `accuracy`, and intervals with a tighter one.

    Raises:
        NoContactError: the solver completes no contact from any of them.
    """
    problem.options |= {"accuracy": "draft", "budget": [_WORK]}
    points = sorted((problem.point(start) for start in starts), key=lambda x: float(np.sum(problem.residuals(x) ** 2)))
    runs = _runs(problem, points, _SHORT)
    best = _runs(problem, [run.x for run in runs[:_KEPT]], _LONG)[0]
    if set(MEMORY) <= set(problem.free) and not _leaves_noise(best):
        others = [problem.point(memory) for memory in _other_memories(best.values)]
        best = min([best, *_runs(problem, others, _LONG)], key=lambda run: run.misfit)
    with suppress(NoContactError):
        problem.options["accuracy"] = accuracy
        best = problem.run(best.x, _LONG, _CLOSENESS)
        # The solver's own error makes the misfit rough, and a search stops in a dent: central differences go on, and
        # where the curve tells it a finer accuracy.
        data, problem.stride = problem.data, problem.model.difference
        if data.noise < _TELLS * float(np.ptp(data.tension)) * len(problem) ** 0.5:
            problem.options["accuracy"] = max(resolve_accuracy(accuracy).target / _TIGHTER, TIGHTEST)
        best = _ended(problem, best.x)
        # The valley of parameters that trade off is bent and uneven: a search from further along it may end lower.
        for _ in range(_AGAIN):
            before, along = best.misfit, _ALONG * best.valley()
            further = [_ended(problem, best.x + each) for each in (-along, along)]
            best = min([best, *further], key=lambda run: run.misfit)
            if best.misfit > _LOWER * before:
                break
    spent = problem.options["budget"][0] < 0.0
    problem.options["budget"] = None
    return dataclasses.replace(best, converged=not spent)


def _ended(problem: Regression, x: FloatArray) -> Fitted:
    """Least squares from a point that ends by itself, as far as the budget goes."""
    found = problem.run(x, _LAST, _CLOSENESS)
    for _ in range(_AGAIN):
        if found.converged or problem.options["budget"][0] < 0.0:
            break
        found = problem.run(found.x, _LAST, _CLOSENESS)
    return found


def memories(start: Mapping[str, float], duration: float) -> list[dict[str, float]]:
    """Points with several retardation times and modulus ratios; fast curves show a stiffer solid than the relaxed."""
    return [
        {**start, "retardation_time": share * duration, "modulus_ratio": ratio,
         "relaxed_modulus": start["relaxed_modulus"] * ratio**0.5}
        for ratio in _RATIOS
        for share in _TIMES
    ]  # fmt: skip


def _other_memories(found: Mapping[str, float]) -> list[dict[str, float]]:
    """Points of faster and slower memories with the instantaneous modulus of a solution."""
    points = []
    for faster in _FASTER:
        stiffer = 1.0 / (found["modulus_ratio"] + (1.0 - found["modulus_ratio"]) * faster**-0.5)
        factors = {"retardation_time": 1.0 / faster, "modulus_ratio": stiffer}
        factors |= {"relaxed_modulus": stiffer, "work_of_adhesion": stiffer**0.5}
        points.append({**found, **{name: factor * found[name] for name, factor in factors.items()}})
    return points


def _runs(problem: Regression, points: Iterable[FloatArray], evaluations: int) -> list[Fitted]:
    """Least squares from each point, the best first; after one that leaves noise alone no other is tried."""
    runs: list[Fitted] = []
    failure = NoContactError("the solver completes no contact")
    for x in points:
        try:
            runs.append(problem.run(x, evaluations, _CLOSENESS))
        except NoContactError as error:
            failure = error
            continue
        if _leaves_noise(runs[-1]):
            break
    if not runs:
        raise failure
    return sorted(runs, key=lambda run: run.misfit)


def _leaves_noise(run: Fitted) -> bool:
    """Whether the residuals are as small as what neighbouring points differ by."""
    data = run.problem.data
    return run.misfit * data.noise < _NOISE * noise_of(data.tension)


def bias_of_range(best: Fitted) -> str:
    """How much the solver's parameters change with a longer effective range, in words."""
    data = best.problem.data
    tabor = max(best.model.setup_of(best.values, data.path.setup).tabor / LONGER, 0.05)
    path = dataclasses.replace(data.path, setup=data.path.setup.replaced(largest_tabor=tabor))
    data = dataclasses.replace(data, path=path)
    other = dataclasses.replace(best.problem, data=data, start=best.values).run(np.zeros(best.x.size), 2)
    changes = [
        f"{name} by {100.0 * (other.values[name] / best.values[name] - 1.0):+.1f} %"
        for name in best.problem.free
        if name != "contact_point"
    ]
    return f"An effective range {LONGER:g} times longer changes {', '.join(changes)}: as much may be the range's."
