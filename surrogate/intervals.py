"""Intervals of the scalars and bands of the curve of a model of any linear solid, calibrated on the converged solver.

The size of an error is expected from the features, by a polynomial fitted to trajectories of the training's accuracy;
those of a curve are the root mean square over its steps and, over the shape that tells how errors are spread over the
steps, the largest.
Trajectories of the calibration, computed at accuracy 1e-3, are divided into groups of like expected error, and by the
kind of their solid: few retardation times that lie close together, times far apart, many, or none. In each group a
quantile of the errors over the expected ones gives the interval its half-width (Mondrian, normalised conformal
prediction).

Source: H. Bostrom, U. Johansson and T. Lofstrom, Mondrian conformal predictive distributions (2021).
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, replace

import numpy as np

from surrogate.data.polynomial import Polynomial

LEVELS = (0.0, 0.25, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.925, 0.95, 0.975, 0.99)
"""Coverages whose quantiles are stored; between them they are interpolated."""
UNSEEN = 1e3
"""Half-width of a group in which nothing was judged, over the expected error."""
GROUPS = 5
FEW, DECADES = 4, 4.0
"""Largest number of terms of the first kind of solids, and decades that their times span at most."""
DENSE = 1.3
"""Least number of terms in a decade of the third kind."""
KINDS = ("few times close together", "times far apart", "many times", "elastic")
BANDS = ("force", "curve")
"""Bands of the curve: at each step by itself, and of all steps at once."""
STEP = -len(BANDS)
"""Column of the first of them."""
_LEAST = 1e-5  # added to errors before their logarithm is taken


def kinds_of(strengths: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Numbers of the `KINDS` of solids (batch,), of terms (batch, m); those of strength zero are left out."""
    used = strengths > 0.0
    decades = np.log10(np.where(used, times, 0.0).max(axis=1, initial=1e-300))
    decades -= np.log10(np.where(used, times, np.inf).min(axis=1, initial=1e300))
    terms = used.sum(axis=1)
    few = (terms <= FEW) & (decades <= DECADES)
    return np.where(terms == 0, 3, np.where(few, 0, np.where(terms < DENSE * decades, 1, 2)))


@dataclass(frozen=True)
class SolidIntervals:
    """What is known of the errors of the targets of stage one, and of the curve where stage two learns it.

    Args:
        expected: Polynomial of the logarithms of their expected sizes; after the targets, those of both `BANDS`.
        edges: Expected sizes that divide the groups, shape (targets + 2, GROUPS - 1).
        shape: Errors of the curve at each step over the expected one, by group of the first band, shape
            (GROUPS, steps).
        quantiles: Of errors over expected ones, shape (kinds, targets + 2, GROUPS, len(LEVELS)).
    """

    expected: Polynomial
    edges: np.ndarray
    shape: np.ndarray
    quantiles: np.ndarray

    @classmethod
    def fit(cls, features: np.ndarray, errors: np.ndarray, curve_errors: np.ndarray) -> SolidIntervals:
        """Fit the expected sizes; calibrated for no kind yet.

        Args:
            features: Shape (batch, n).
            errors: Of the targets, shape (batch, targets).
            curve_errors: Of the curve, shape (batch, steps).

        Returns:
            Intervals whose half-widths are `UNSEEN` times the expected sizes.
        """
        overall = np.sqrt(np.mean(curve_errors**2, axis=1, keepdims=True))
        own = cls._of_sizes(features, np.column_stack([np.abs(errors), overall]), np.ones((GROUPS, 1)))
        sizes, groups = own.sizes_and_groups(features)
        ratios = np.abs(curve_errors) / sizes[:, -1:]
        shape = np.stack([np.quantile(ratios[groups[:, -1] == group], 0.9, axis=0) for group in range(GROUPS)])
        shape = np.maximum(shape, _LEAST)
        largest = (np.abs(curve_errors) / shape[groups[:, -1]]).max(axis=1)
        return cls._of_sizes(features, np.column_stack([np.abs(errors), overall, largest]), shape)

    @classmethod
    def _of_sizes(cls, features: np.ndarray, sizes: np.ndarray, shape: np.ndarray) -> SolidIntervals:
        expected = Polynomial.fit(features, np.log(sizes + _LEAST))
        edges = np.quantile(expected(features), np.arange(1, GROUPS) / GROUPS, axis=0).T
        return cls(expected, edges, shape, np.full((len(KINDS), sizes.shape[1], GROUPS, len(LEVELS)), UNSEEN))

    def calibrated(
        self, features: np.ndarray, kinds: np.ndarray, errors: np.ndarray, curve_errors: np.ndarray
    ) -> SolidIntervals:
        """Take the quantiles of each kind that is among `kinds` (batch,); the other arguments are those of `fit`."""
        sizes, groups = self.sizes_and_groups(features)
        curve = np.abs(curve_errors) / self.shape[groups[:, STEP]]
        ratios = [
            *(np.abs(errors) / sizes[:, :STEP]).T,
            curve / sizes[:, STEP, np.newaxis],
            curve.max(axis=1) / sizes[:, -1],
        ]
        quantiles = self.quantiles.copy()
        for kind in np.unique(kinds):
            for row, values in enumerate(ratios):
                for group in range(GROUPS):
                    members = values[(kinds == kind) & (groups[:, row] == group)]
                    if members.size:
                        quantiles[kind, row, group] = _quantiles(members)
        return replace(self, quantiles=quantiles)

    def half_widths(self, features: np.ndarray, kinds: np.ndarray, coverage: float) -> tuple[np.ndarray, np.ndarray]:
        """Half-widths that are to contain a share `coverage` of true values.

        Returns:
            Those of the targets and, as multiples of the second array, of both `BANDS`, shape (batch, targets + 2); and
            the shape of each curve's errors, (batch, steps).
        """
        sizes, groups = self.sizes_and_groups(features)
        right = min(max(bisect_left(LEVELS, coverage), 1), len(LEVELS) - 1)
        share = (coverage - LEVELS[right - 1]) / (LEVELS[right] - LEVELS[right - 1])
        table = (1.0 - share) * self.quantiles[..., right - 1] + share * self.quantiles[..., right]
        half = sizes * table[kinds[:, np.newaxis], np.arange(sizes.shape[1]), groups]
        return half, self.shape[groups[:, STEP]]

    def sizes_and_groups(self, features: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Expected sizes of the errors and the numbers of their groups, each of shape (batch, targets + 2)."""
        sizes = self.expected(features)
        groups = np.stack([np.searchsorted(edge, size) for edge, size in zip(self.edges, sizes.T, strict=True)], axis=1)
        return np.exp(sizes), groups

    def as_arrays(self) -> dict[str, np.ndarray]:
        """What to store; `of_arrays` is the inverse."""
        return {"edges": self.edges, "shape": self.shape, "quantiles": self.quantiles} | vars(self.expected)

    @classmethod
    def of_arrays(cls, arrays: dict[str, np.ndarray]) -> SolidIntervals:
        """The inverse of `as_arrays`."""
        return cls(Polynomial.of_arrays(arrays), arrays["edges"], arrays["shape"], arrays["quantiles"])


def _quantiles(errors: np.ndarray) -> np.ndarray:
    """Quantiles at `LEVELS` of errors of any shape, by the rank level (n + 1) and two of its standard deviations.

    With the deviations, intervals cover as they should in each group, not only on average.
    """
    ordered = np.sort(errors, axis=None)
    count = len(errors)
    levels = np.array(LEVELS)
    share = (levels * (count + 1) + 2.0 * np.sqrt(count * levels * (1.0 - levels))) / count
    ranks = np.ceil(share * ordered.size).astype(int)
    return ordered[np.clip(ranks, 1, ordered.size) - 1]
