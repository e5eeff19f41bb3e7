"""Split-conformal intervals and bands: how far predictions were from the solver on trajectories that no training saw.

An error is judged in units of its expected size: the exponential of a polynomial in protocol, material and sharpness of
the predicted peak, fitted to some trajectories. Other trajectories are divided into cells: each corner of the ranges
(the outermost fifth of every one of them) is a cell, so is each of three ranges of nearly elastic solids, whose loop is
a small difference of large works, and the rest is divided into groups of equal size by that expected size. In each cell
the quantiles of the judged errors give the half-widths. Their rank has the correction for finite numbers and two
standard deviations more, so that intervals cover as they should at each place, not only on average.
Source: V. Vovk, A. Gammerman and G. Shafer, Algorithmic Learning in a Random World (2005), chapter 4 (Mondrian
conformal predictors).
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from bem._support.jit import kernel
from bem._support.monotone import monotone_integral, monotone_slopes
from bem.dataset.designs import OUTERMOST, QUANTITIES
from surrogate.data.scaling import Scaling
from surrogate.trajectory import Doubt

GROUPS = 8
LEVELS = (0.0, 0.25, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.925, 0.95, 0.975, 0.99)
"""Coverages whose quantiles are stored; between them they are interpolated."""

KNOWN = (*QUANTITIES, "modulus_ratio")
"""Quantities of a protocol on a solid that tell how difficult it is."""
CORNERS = 2 ** len(KNOWN)
NEARLY_ELASTIC = (0.95, 0.98, 0.995)
"""Modulus ratios at which the cells of nearly elastic solids begin."""
CELLS = CORNERS + GROUPS + len(NEARLY_ELASTIC)
"""Cells: corners, groups, nearly elastic solids."""
UNSEEN = 1e3
"""Half-width in a cell in which nothing was judged, over the expected error."""
RESULTS = ("pull_off", "pull_off_time", "hysteresis")
BANDS = ("force", "curve")
"""Intervals of results, and bands of the scaled force: at each step by itself, and of all steps at once."""
_ROWS = np.arange(len(RESULTS + BANDS))[:, np.newaxis]
LEAST = 1e-4
"""Of a quantity, for its logarithm."""
FACTORS = np.array(list(combinations_with_replacement(range(len(KNOWN) + 2), 3))).T
"""Places that each term of the expected error multiplies, shape (3, 120); the first place is 1."""


@dataclass(frozen=True)
class Bands:
    """Half-widths of intervals and bands by place.

    Args:
        ranges: Of the quantities in `KNOWN`, shape `(6, 2)`.
        coefficients: Of the logarithm of the expected errors of `RESULTS` and `BANDS`, shape `(5, 120)`.
        edges: Expected errors that divide the groups outside the corners, shape `(5, GROUPS - 1)`.
        shape: Errors of the force at each step over the expected one, by group, shape `(GROUPS, steps)`.
        quantiles: Of the judged errors of `RESULTS` and `BANDS`, shape `(5, CELLS, len(LEVELS))`.
    """

    ranges: np.ndarray
    coefficients: np.ndarray
    edges: np.ndarray
    shape: np.ndarray
    quantiles: np.ndarray
    largest_coverage = LEVELS[-1]
    """The largest share of true values that bands can be asked to contain."""

    @classmethod
    def calibrate(
        cls,
        ranges: Mapping[str, Any],
        predictors: np.ndarray,
        errors: np.ndarray,
        force_errors: np.ndarray,
        fitted: int,
    ) -> Bands:
        """Fit the expected errors to the first `fitted` trajectories, and take the quantiles of the others.

        Args:
            ranges: Low and high of each quantity in `KNOWN`, by name.
            predictors: Those quantities and the sharpness of the predicted peak, shape `(batch, 7)`.
            errors: Of `RESULTS`, as in `result_errors`, shape `(3, batch)`.
            force_errors: Absolute error of the scaled force, shape `(batch, steps)`.
            fitted: How many trajectories the expected errors are fitted to.

        Returns:
            The bands.
        """
        bounds = np.array([ranges[name] for name in KNOWN], dtype=np.float64)
        terms, own = _placed(predictors, bounds)
        outside = np.arange(len(predictors)) >= fitted
        fits: list[tuple[np.ndarray, np.ndarray]] = []

        def judge(error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """Fit the expected size of one error, and return its logarithm and the group of each trajectory."""
            coefficients = np.linalg.lstsq(terms[:fitted], np.log(error[:fitted] + 1e-5), rcond=None)[0]
            size = terms @ coefficients
            edges = np.quantile(size[outside & (own < 0)], np.arange(1, GROUPS) / GROUPS)
            fits.append((coefficients, edges))
            return size, np.searchsorted(edges, size)

        for error in errors:
            judge(error)
        size, group = judge(np.sqrt(np.mean(force_errors**2, axis=1)))
        judged = (force_errors / np.exp(size)[:, np.newaxis])[:fitted]
        shape = np.stack([np.quantile(judged[group[:fitted] == row], 0.9, axis=0) for row in range(GROUPS)])
        judge((force_errors / (shape := np.maximum(shape, 1e-6))[group]).max(axis=1))
        coefficients, edges = map(np.stack, zip(*fits, strict=True))
        bands = cls(bounds, coefficients, edges, shape, np.full((len(fits), CELLS, len(LEVELS)), UNSEEN))
        return bands.recalibrated(predictors[fitted:], errors[:, fitted:], force_errors[fitted:])

    def recalibrated(self, predictors: np.ndarray, errors: np.ndarray, force_errors: np.ndarray) -> Bands:
        """Take the quantiles of trajectories in each cell that holds some of them; other cells stay as they are.

        The arguments are those of `calibrate`.
        """
        sizes, groups, cells = _judged(predictors, self.ranges, self.coefficients, self.edges)
        judged, quantiles = force_errors / self.shape[groups[len(RESULTS)]], self.quantiles.copy()
        for row, error in enumerate([*errors, judged, judged.max(axis=1)]):
            ratio = (error.T / sizes[row]).T
            for cell in np.unique(cells[row]):
                quantiles[row, cell] = _quantiles(ratio[cells[row] == cell])
        return replace(self, quantiles=quantiles)

    def half_widths(self, predictors: np.ndarray, coverage: float) -> tuple[np.ndarray, np.ndarray]:
        """Return half-widths, and the row of `shape` of which those of `BANDS` are multiples.

        Args:
            predictors: As in `calibrate`.
            coverage: The share of true values that intervals and bands are to contain.

        Returns:
            Half-widths of `RESULTS`, in the units of `result_errors`, and of `BANDS`, shape `(5, batch)`; the rows,
            shape `(batch,)`.
        """
        half, groups, cells = _judged(predictors, self.ranges, self.coefficients, self.edges)
        half *= self.quantiles_at(coverage)[_ROWS, cells]
        return half, groups[len(RESULTS)]

    def quantiles_at(self, coverage: float) -> np.ndarray:
        """Return the quantiles at a coverage, interpolated between the levels, shape `(5, CELLS)`."""
        right = min(max(bisect_left(LEVELS, coverage), 1), len(LEVELS) - 1)
        share = (coverage - LEVELS[right - 1]) / (LEVELS[right] - LEVELS[right - 1])
        quantiles: np.ndarray = (1.0 - share) * self.quantiles[..., right - 1] + share * self.quantiles[..., right]
        return quantiles

    def around(
        self,
        times: np.ndarray,
        indentations: np.ndarray,
        force: np.ndarray,
        scaling: Scaling,
        quantities: Mapping[str, np.ndarray],
        counts: Sequence[int],
        coverage: float,
    ) -> list[Doubt]:
        """Return what bands add to each of the predicted trajectories.

        Args:
            times, indentations, force: Predicted histories of shape `(batch, steps)`.
            scaling: That of the model.
            quantities: Protocols and modulus ratios by name, each of shape `(batch,)`.
            counts: Points of loading, dwell and unloading.
            coverage: The share of true values that the bands are to contain.

        Returns:
            One for each trajectory.
        """
        *readings, sharpness, unit = results(times, indentations, force, np.array(counts))
        half, rows = self.half_widths(np.array([*(quantities[name] for name in KNOWN), sharpness]).T, coverage)
        half[RESULTS.index("hysteresis")] *= unit
        per_trajectory = zip(np.transpose(readings).tolist(), half.T.tolist(), self.shape[rows], strict=True)
        return [Doubt(coverage, scaling, *fields) for fields in per_trajectory]

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return what to store; `Bands(**arrays)` is the inverse."""
        return {name: np.asarray(values, dtype=np.float32) for name, values in vars(self).items()}


def result_errors(predicted: np.ndarray, true: np.ndarray, begin: np.ndarray) -> np.ndarray:
    """Errors of `RESULTS`, shape (3, batch), of what `results` found against the true values, in its order.

    Those of the pull-off force and of the time since `begin`, the end of the dwell, are absolute differences of
    logarithms; that of the hysteresis is in units of the predicted loop area, or of a hundredth of the work of loading
    if this is more.
    """
    instants = [np.maximum(time - begin, 1e-300) for time in (predicted[1], true[1])]
    return np.stack(
        [
            np.abs(np.log(np.maximum(predicted[0], 1e-6) / true[0])),
            np.abs(np.log(instants[0] / instants[1])),
            np.abs(np.abs(predicted[2]) - true[2]) / predicted[4],
        ]
    )


@kernel
def results(times: np.ndarray, indentations: np.ndarray, force: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Pull-off force, its time, work, sharpness, and unit of the error of the loop, of histories (batch, steps).

    The pull-off force is the top of the parabola through the highest step of the unloading and its neighbours; the
    sharpness is by how much the higher one of these is less, as a share. The work is the integral of -P d(indentation)
    of monotone cubics, phase by phase. The unit is the absolute work, or a hundredth of that of loading if this is
    more.

    Returns:
        Array of shape (5, batch).
    """
    readings = np.empty((5, len(times)))
    loading, turn = counts[0], counts[0] + counts[1] - 1
    for row in range(len(times)):
        time, values = times[row], force[row]
        top = turn + np.argmax(values[turn:])
        readings[0, row], readings[1, row] = values[top], time[top]
        if turn < top < len(time) - 1:
            before, after = time[top] - time[top - 1], time[top + 1] - time[top]
            rise, fall = (values[top] - values[top - 1]) / before, (values[top + 1] - values[top]) / after
            bend = (fall - rise) / (before + after)
            readings[3, row] = 1.0 - max(values[top - 1], values[top + 1]) / max(values[top], 1e-300)
            if bend < 0.0:
                slope = rise + bend * before
                readings[0, row] -= 0.25 * slope * slope / bend
                readings[1, row] -= 0.5 * slope / bend
        else:
            readings[3, row] = 0.0
        readings[2, row] = 0.0
        for first, last in ((0, loading), (turn, len(time))):
            span = indentations[row, last - 1] - indentations[row, first]
            instants, forces = time[first:last], values[first:last]
            area = monotone_integral(instants, forces, monotone_slopes(instants, forces))
            readings[2, row] -= area * span / (instants[-1] - instants[0])
            if first == 0:
                readings[4, row] = max(0.01 * abs(readings[2, row]), 1e-300)
        readings[4, row] = max(readings[4, row], abs(readings[2, row]))
    return readings


@kernel
def _placed(predictors: np.ndarray, bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where quantities and sharpness (batch, 7) lie in the ranges (6, 2).

    Returns:
        The constant, the places in the logarithms of the ranges, from -1 to 1, and their products of two and three,
        shape (batch, 120); and the number of the cell, -1 where the expected error decides it, shape (batch,).
    """
    batch, count = predictors.shape
    terms, own = np.ones((batch, FACTORS.shape[1])), np.empty(batch, np.int64)
    places = np.ones(count + 1)
    for row in range(batch):
        number, outermost = 0, True
        for i in range(count - 1):
            low, high = math.log(bounds[i, 0]), math.log(bounds[i, 1])
            position = (2.0 * math.log(max(predictors[row, i], LEAST)) - low - high) / (high - low)
            places[i + 1] = position = min(max(position, -1.0), 1.0)
            number += (position > 0.0) << i
            outermost = outermost and abs(position) >= 1.0 - 2.0 * OUTERMOST - 1e-9
        places[count] = 1.0 + math.log(max(predictors[row, count - 1], LEAST)) / 4.0
        own[row] = number if outermost else -1
        for number in range(len(NEARLY_ELASTIC)):
            if predictors[row, count - 2] >= NEARLY_ELASTIC[number]:
                own[row] = CORNERS + GROUPS + number
        for term in range(terms.shape[1]):
            for factor in FACTORS[:, term]:
                terms[row, term] *= places[factor]
    return terms, own


@kernel
def _judged(
    predictors: np.ndarray, bounds: np.ndarray, coefficients: np.ndarray, edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Expected errors, numbers of groups and of cells, each (5, batch), of `predictors` and `bounds` as above."""
    terms, own = _placed(predictors, bounds)
    sizes = np.zeros((len(coefficients), len(predictors)))
    groups = np.zeros(sizes.shape, np.int64)
    cells = np.empty_like(groups)
    for row in range(len(predictors)):
        for index in range(len(coefficients)):
            size = 0.0
            for term in range(terms.shape[1]):
                size += coefficients[index, term] * terms[row, term]
            for edge in edges[index]:
                groups[index, row] += size > edge
            sizes[index, row] = math.exp(size)
            cells[index, row] = own[row] if own[row] >= 0 else CORNERS + groups[index, row]
    return sizes, groups, cells


def _quantiles(errors: np.ndarray) -> np.ndarray:
    """Quantiles at `LEVELS` of errors of any shape, by the rank level (n + 1) and two of its standard deviations."""
    ordered = np.sort(errors, axis=None)
    count = len(errors)
    levels = np.array(LEVELS)
    share = (levels * (count + 1) + 2.0 * np.sqrt(count * levels * (1.0 - levels))) / count
    ranks = np.ceil(share * ordered.size).astype(int)
    return ordered[np.clip(ranks, 1, ordered.size) - 1]
