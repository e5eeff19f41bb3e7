"""Errors and their summaries, the same in all measurements."""

from collections.abc import Sequence

import numpy as np

from surrogate.data.scaling import symlog

LEVELS = (0.5, 0.9, 0.99)


def force_error(force: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """Mean absolute difference of two forces over the range of the exact one.

    Args:
        force: Forces of shape (count, steps); NaN at steps for which a tool gives no force. These are left out.
        exact: Exact forces, of the same shape.

    Returns:
        Errors of shape (count,); NaN for a trajectory without any force.
    """
    finite = np.isfinite(force)
    total = np.sum(np.abs(np.where(finite, force - exact, 0.0)), axis=1)
    counted = np.count_nonzero(finite, axis=1)
    return np.where(counted > 0, total / np.maximum(counted, 1), np.nan) / np.ptp(exact, axis=1)


def answer_errors(answers: np.ndarray, exact: np.ndarray) -> dict[str, np.ndarray]:
    """Errors of pull-off force, hysteresis and force, each of shape (count,).

    Args:
        answers: Pull-off force, hysteresis and forces at the measurement steps, of shape (count, 2 + steps).
        exact: Exact answers, of the same shape.
    """
    pull_off, hysteresis = np.abs(answers[:, :2] / exact[:, :2] - 1.0).T
    force = force_error(answers[:, 2:], exact[:, 2:])
    return {"pull_off_force": pull_off, "hysteresis": hysteresis, "force": force}


def spread(values: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Count, mean, median, quartiles, 95th percentile and maximum of the finite values; NaN if there are none."""
    array = np.asarray(values, dtype=np.float64)
    array = array[np.isfinite(array)]
    names = {"median": 50.0, "low": 25.0, "high": 75.0, "p95": 95.0, "largest": 100.0}
    if array.size == 0:
        return {"count": 0, "mean": np.nan, **dict.fromkeys(names, np.nan)}
    quantiles = {name: float(np.percentile(array, percent)) for name, percent in names.items()}
    return {"count": int(array.size), "mean": float(array.mean()), **quantiles}


def quantiles(errors: np.ndarray) -> dict[str, float]:
    """Median, 90th and 99th percentile in percent."""
    return {f"p{100 * level:.0f}": 100.0 * float(np.quantile(errors, level)) for level in LEVELS}


def medians(errors: dict[str, np.ndarray]) -> dict[str, float]:
    """Median of each error."""
    return {name: float(np.median(values)) for name, values in errors.items()}


def in_units(threshold: float, training: np.ndarray, *forces: np.ndarray) -> list[np.ndarray]:
    """Forces after the symmetric logarithm, standardised by the training forces."""
    mean, deviation = (statistic(symlog(training / threshold)) for statistic in (np.mean, np.std))
    return [(symlog(force / threshold) - mean) / deviation for force in forces]
