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

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bem._support.jit import kernel
from bem._support.monotone import monotone_integral, monotone_slopes
from bem.dataset.designs import QUANTITIES
from surrogate.data.scaling import Scaling

GROUPS = 8
LEVELS = np.array([0.0, 0.25, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.925, 0.95, 0.975, 0.99])
"""Coverages whose quantiles are stored; between them they are interpolated."""

KNOWN = (*QUANTITIES, "modulus_ratio")
"""Quantities of a protocol on a solid that tell how difficult it is."""


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

        Returns:
            The bands.
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
        """Return half-widths of the bands.

        Args:
            quantities: As in `calibrate`.
            coverage: The share of true values that the bands are to contain.

        Returns:
            Those of the pull-off force's logarithm, shape `(batch,)`, and of the scaled force, `(batch, steps)`.
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

    @property
    def largest_coverage(self) -> float:
        """The largest share of true values that bands can be asked to contain."""
        return float(LEVELS[-1])

    def around(
        self,
        times: np.ndarray,
        indentations: np.ndarray,
        force: np.ndarray,
        scaling: Scaling,
        quantities: dict[str, np.ndarray],
        counts: Sequence[int],
        coverage: float,
        outside: Sequence[tuple[str, ...]],
    ) -> dict[str, Sequence[Any]]:
        """Return what bands add to predicted trajectories.

        Args:
            times, indentations, force: Predicted histories of shape `(batch, steps)`.
            scaling: That of the model.
            quantities: Protocols and modulus ratios by name, each of shape `(batch,)`.
            counts: Points of loading, dwell and unloading.
            coverage: The share of true values that the bands are to contain.
            outside: What of each history lies outside the training; its bands are then infinite.

        Returns:
            The fields of `surrogate.prediction.predicted.PredictedTrajectory`, a value of each per history.
        """
        pull_off, instant, sharpness, work = results(times, indentations, force, np.array(counts))
        known = np.column_stack([*(quantities[name] for name in KNOWN), sharpness])
        log_width, width = self.widths(known, coverage)
        far = np.array([bool(words) for words in outside])
        log_width[far], width[far] = np.inf, np.inf
        interval = pull_off[:, np.newaxis] * np.exp(log_width[:, np.newaxis] * [-1.0, 1.0])
        interval[far] = [-np.inf, np.inf]
        scaled = scaling.scale_force(force)
        lower, upper = scaling.unscale_force(scaled - width), scaling.unscale_force(scaled + width)
        return {
            "modulus_ratio": quantities["modulus_ratio"].tolist(),
            "coverage": [coverage] * len(force),
            "pull_off_interval": [(low, high) for low, high in interval.tolist()],
            "force_lower": lower,
            "force_upper": upper,
            "readings": list(zip(pull_off.tolist(), instant.tolist(), work.tolist(), strict=True)),
        }

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Return what to store; `Bands(**arrays)` is the inverse."""
        return {name: np.asarray(values, dtype=np.float32) for name, values in vars(self).items()}


@kernel
def results(times: np.ndarray, indentations: np.ndarray, force: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Results of histories (batch, steps): rows pull-off force, its time, its sharpness and the work, each (batch,).

    The pull-off force is the top of the parabola through the highest step of the unloading and its neighbours; the
    sharpness is by how much the higher one of these is less, as a share. The work is the integral of -P d(indentation)
    of monotone cubics, phase by phase.
    """
    found = np.empty((4, len(times)))
    loading, turn = counts[0], counts[0] + counts[1] - 1
    for row in range(len(times)):
        time, values = times[row], force[row]
        top = turn + np.argmax(values[turn:])
        found[0, row], found[1, row] = values[top], time[top]
        if turn < top < len(time) - 1:
            before, after = time[top] - time[top - 1], time[top + 1] - time[top]
            rise, fall = (values[top] - values[top - 1]) / before, (values[top + 1] - values[top]) / after
            bend = (fall - rise) / (before + after)
            found[2, row] = 1.0 - max(values[top - 1], values[top + 1]) / max(values[top], 1e-300)
            if bend < 0.0:
                slope = rise + bend * before
                found[0, row] -= 0.25 * slope * slope / bend
                found[1, row] -= 0.5 * slope / bend
        else:
            found[2, row] = 0.0
        found[3, row] = 0.0
        for first, last in ((0, loading), (turn, len(time))):
            span = indentations[row, last - 1] - indentations[row, first]
            part, here = time[first:last], values[first:last]
            area = monotone_integral(part, here, monotone_slopes(part, here))
            found[3, row] -= area * span / (part[-1] - part[0])
    return found


def _terms(quantities: np.ndarray) -> np.ndarray:
    """Constant, logarithms and their squares, shape `(batch, 15)`."""
    logs = np.log(np.maximum(quantities, 1e-4))
    return np.concatenate([np.ones((len(logs), 1)), logs, logs**2], axis=1)


def _quantiles(errors: np.ndarray) -> np.ndarray:
    """Conformal quantiles at `LEVELS` of errors along the first axis: the ceil(level (n + 1))-th smallest."""
    ordered = np.sort(errors, axis=0)
    ranks = np.ceil(LEVELS * (len(ordered) + 1)).astype(int)
    return ordered[np.clip(ranks, 1, len(ordered)) - 1]
