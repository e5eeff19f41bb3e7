"""Intervals of the scalars of a model of any linear solid, calibrated on the converged solver.

The size of an error is expected from the features, by a polynomial fitted to trajectories of the training. Trajectories
of the calibration, computed at accuracy 1e-3, are divided into groups of like expected error, and by the kind of their
solid: few retardation terms or many. In each group a quantile of the errors over the expected ones gives the interval
its half-width (Mondrian, normalised conformal prediction).

Source: H. Bostrom, U. Johansson and T. Lofstrom, Mondrian conformal predictive distributions (2021).
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from surrogate.data.polynomial import Polynomial
from surrogate.intervals import LEVELS, UNSEEN, _quantiles

GROUPS = 5
FEW = 4
"""Largest number of terms of the first kind of solids."""
KINDS = ("few terms", "many terms")
_LEAST = 1e-5  # added to errors before their logarithm is taken


@dataclass(frozen=True)
class SolidIntervals:
    """What is known of the errors of the targets of stage one.

    Args:
        expected: Polynomial of the logarithms of their expected sizes.
        edges: Expected sizes that divide the groups, shape (targets, GROUPS - 1).
        quantiles: Of errors over expected ones, shape (kinds, targets, GROUPS, len(LEVELS)).
    """

    expected: Polynomial
    edges: np.ndarray
    quantiles: np.ndarray

    @classmethod
    def fit(cls, features: np.ndarray, errors: np.ndarray) -> SolidIntervals:
        """Fit the expected sizes to features (batch, n) and errors (batch, targets); calibrated for no kind yet."""
        expected = Polynomial.fit(features, np.log(np.abs(errors) + _LEAST))
        edges = np.quantile(expected(features), np.arange(1, GROUPS) / GROUPS, axis=0).T
        return cls(expected, edges, np.full((len(KINDS), errors.shape[1], GROUPS, len(LEVELS)), UNSEEN))

    def calibrated(self, features: np.ndarray, terms: np.ndarray, errors: np.ndarray) -> SolidIntervals:
        """Take the quantiles of each kind that is among solids with so many `terms` (batch,)."""
        sizes, groups, kinds = self._judged(features, terms)
        quantiles = self.quantiles.copy()
        for kind in np.unique(kinds):
            for target in range(errors.shape[1]):
                ratios = np.abs(errors[:, target]) / sizes[:, target]
                for group in range(GROUPS):
                    members = ratios[(kinds == kind) & (groups[:, target] == group)]
                    if members.size:
                        quantiles[kind, target, group] = _quantiles(members)
        return SolidIntervals(self.expected, self.edges, quantiles)

    def half_widths(self, features: np.ndarray, terms: np.ndarray, coverage: float) -> np.ndarray:
        """Half-widths of the targets (batch, targets) that are to contain a share `coverage` of true values."""
        sizes, groups, kinds = self._judged(features, terms)
        right = min(max(bisect_left(LEVELS, coverage), 1), len(LEVELS) - 1)
        share = (coverage - LEVELS[right - 1]) / (LEVELS[right] - LEVELS[right - 1])
        table = (1.0 - share) * self.quantiles[..., right - 1] + share * self.quantiles[..., right]
        return sizes * table[kinds[:, np.newaxis], np.arange(sizes.shape[1]), groups]

    def groups(self, features: np.ndarray) -> np.ndarray:
        """Numbers of the groups of expected error, (batch, targets)."""
        return self._judged(features, np.zeros(len(features)))[1]

    def _judged(self, features: np.ndarray, terms: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        sizes = self.expected(features)
        groups = np.stack([np.searchsorted(edge, size) for edge, size in zip(self.edges, sizes.T, strict=True)], axis=1)
        return np.exp(sizes), groups, (np.asarray(terms) > FEW).astype(int)

    def as_arrays(self) -> dict[str, np.ndarray]:
        """What to store; `of_arrays` is the inverse."""
        return {"edges": self.edges, "quantiles": self.quantiles} | vars(self.expected)

    @classmethod
    def of_arrays(cls, arrays: dict[str, np.ndarray]) -> SolidIntervals:
        """The inverse of `as_arrays`."""
        names: Sequence[str] = ("mean", "deviation", "coefficients", "offset", "scale")
        return cls(Polynomial(*(arrays[name] for name in names)), arrays["edges"], arrays["quantiles"])
