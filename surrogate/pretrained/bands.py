"""Split-conformal bands: how far predictions were from the solver on trajectories that no training has seen.

A prediction's difficulty is a fit of the logarithm of its pull-off error to protocol, material and the sharpness of the
predicted peak, made on one part of the held-out trajectories. The other part is divided into groups of equal size by
difficulty, which rises above all with the unloading rate. In each group the quantiles of the errors, with the
correction for their finite number, give the half-widths of the bands, those of the pull-off force as multiples of the
difficulty: so bands cover as they should in every group, not only on average, and are wide where the truth is hard.
Source: V. Vovk, A. Gammerman and G. Shafer,
Algorithmic Learning in a Random World (2005), chapter 4 (Mondrian conformal predictors).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

GROUPS = 8
LEVELS = np.array([0.0, 0.25, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.925, 0.95, 0.975, 0.99])
"""Coverages whose quantiles are stored; between them they are interpolated."""

LARGEST_COVERAGE = float(LEVELS[-1])


@dataclass(frozen=True)
class Bands:
    """Half-widths of bands by group of difficulty.

    Args:
        coefficients: Of the fit of the difficulty, see `_terms`.
        edges: Difficulties that divide the groups, shape `(GROUPS - 1,)`.
        pull_off: Quantiles of |log(predicted / true pull-off force)| over the exponential of the difficulty, shape
            `(GROUPS, len(LEVELS))`.
        force: Quantiles of the error of the scaled force at each step, shape `(GROUPS, len(LEVELS), steps)`.
    """

    coefficients: np.ndarray
    edges: np.ndarray
    pull_off: np.ndarray
    force: np.ndarray

    @classmethod
    def calibrate(
        cls, quantities: np.ndarray, pull_off_errors: np.ndarray, force_errors: np.ndarray, fitted: int
    ) -> Bands:
        """Fit the difficulty to the first `fitted` trajectories, and take the quantiles of the others.

        Args:
            quantities: Tabor parameter, peak indentation, loading rate, dwell time, unloading rate, modulus ratio and
                sharpness of the predicted peak, shape `(batch, 7)`.
            pull_off_errors: |log(predicted / true)|, shape `(batch,)`.
            force_errors: Absolute error of the scaled force, shape `(batch, steps)`.
            fitted: How many trajectories the difficulty is fitted to.
        """
        terms = _terms(quantities)
        logs = np.log(pull_off_errors[:fitted] + 1e-4)
        coefficients, *_ = np.linalg.lstsq(terms[:fitted], logs, rcond=None)
        difficulty = terms[fitted:] @ coefficients
        edges = np.quantile(difficulty, np.arange(1, GROUPS) / GROUPS)
        group = np.searchsorted(edges, difficulty)
        shares = [group == number for number in range(GROUPS)]
        return cls(
            coefficients,
            edges,
            np.stack([_quantiles((pull_off_errors[fitted:] / np.exp(difficulty))[share]) for share in shares]),
            np.stack([_quantiles(force_errors[fitted:][share]) for share in shares]),
        )

    def widths(self, quantities: np.ndarray, coverage: float) -> tuple[np.ndarray, np.ndarray]:
        """Half-widths of the pull-off force's logarithm, shape `(batch,)`, and of the scaled force `(batch, steps)`.

        Args:
            quantities: As in `calibrate`.
            coverage: The share of true values that the bands are to contain.
        """
        # Far outside the training, where no band is used, exponentials may overflow.
        difficulty = np.minimum(_terms(quantities) @ self.coefficients, 3.0)
        group = np.searchsorted(self.edges, difficulty)
        right = min(max(int(np.searchsorted(LEVELS, coverage)), 1), len(LEVELS) - 1)
        part = (coverage - LEVELS[right - 1]) / (LEVELS[right] - LEVELS[right - 1])
        pull_off, force = (
            (1.0 - part) * table[group, right - 1] + part * table[group, right] for table in (self.pull_off, self.force)
        )
        return pull_off * np.exp(difficulty), force

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return what to store; `Bands(**arrays)` is the inverse."""
        return {name: np.asarray(values, dtype=np.float32) for name, values in vars(self).items()}


def _terms(quantities: np.ndarray) -> np.ndarray:
    """Constant, logarithms and their squares, shape `(batch, 15)`."""
    logs = np.log(np.maximum(quantities, 1e-4))
    return np.concatenate([np.ones((len(logs), 1)), logs, logs**2], axis=1)


def _quantiles(errors: np.ndarray) -> np.ndarray:
    """Conformal quantiles at `LEVELS` of errors along the first axis: the ceil(level (n + 1))-th smallest."""
    ordered = np.sort(errors, axis=0)
    ranks = np.ceil(LEVELS * (len(ordered) + 1)).astype(int)
    return ordered[np.clip(ranks, 1, len(ordered)) - 1]
