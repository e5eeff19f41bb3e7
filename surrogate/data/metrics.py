"""Errors of predicted force histories against simulated ones.

Metrics of the paper, on the scaled force: mean squared error (MSE), mean absolute error (MAE) and DTW-RMSE (section
"Model-family selection"). Metrics of the paper, on the physical force at the fixed measurement steps (FMS): the
normalised mean absolute error (NMAE) and the relative errors of pull-off force, pull-off time and hysteresis (section
"Physically interpretable error statistics"). Metrics of this package: the error against the pull-off force of the
solver's native history, and the resolution floor, which is that error for a perfect prediction on the FMS. NMAE and
relative errors are in percent.

DTW-RMSE: dynamic time warping aligns two curves along the warping path with the smallest sum of *squared* differences.
Each step of the path advances one curve or both by one point. DTW-RMSE is the square root of that sum divided by the
number of points on the path. Some packages minimise absolute differences instead; with squares, DTW-RMSE never exceeds
the RMSE. Among paths of equal sum, the diagonal step is preferred. Reference: Giorgino 2009, section 3 (step pattern
`symmetric1`).
"""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True, nogil=True)
def _dtw_rmse(first: np.ndarray, second: np.ndarray) -> float:
    rows, columns = first.size, second.size
    cost = np.empty((rows, columns))
    length = np.empty((rows, columns), dtype=np.int64)
    for i in range(rows):
        for j in range(columns):
            local = (first[i] - second[j]) ** 2
            if i == 0 and j == 0:
                cost[i, j], length[i, j] = local, 1
                continue
            best, points = np.inf, 0
            if i > 0 and j > 0:
                best, points = cost[i - 1, j - 1], length[i - 1, j - 1]
            if i > 0 and cost[i - 1, j] < best:
                best, points = cost[i - 1, j], length[i - 1, j]
            if j > 0 and cost[i, j - 1] < best:
                best, points = cost[i, j - 1], length[i, j - 1]
            cost[i, j], length[i, j] = best + local, points + 1
    return np.sqrt(cost[-1, -1] / length[-1, -1])


def dtw_rmse(predicted: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return the root mean squared difference along the optimal warping path of each pair of curves.

    Args:
        predicted: A 2D array of shape `(batch, steps)`.
        reference: A 2D array of shape `(batch, reference_steps)`.

    Returns:
        An array of shape `(batch,)`, in the units of the inputs.

    Raises:
        ValueError: the batch sizes differ.
    """
    pairs = zip(np.asarray(predicted, dtype=np.float64), np.asarray(reference, dtype=np.float64), strict=True)
    return np.array([_dtw_rmse(np.ascontiguousarray(a), np.ascontiguousarray(b)) for a, b in pairs])


def pull_off(times: np.ndarray, force: np.ndarray, unloading_from: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest force while unloading and its time, each of shape `(batch,)`.

    Args:
        times: Times of shape `(batch, steps)`.
        force: Physical forces of the same shape.
        unloading_from: Index of the last point of the dwell, where unloading starts.

    Returns:
        The forces and their times, two arrays of shape `(batch,)`.
    """
    at = unloading_from + np.argmax(force[:, unloading_from:], axis=1)
    rows = np.arange(len(force))
    return force[rows, at], times[rows, at]


def hysteresis(indentations: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return the hysteresis |closed integral of P d(delta)| by the trapezoidal rule, shape `(batch,)`.

    Args:
        indentations: Indentations of shape `(batch, steps)`.
        force: Physical forces of the same shape.

    Returns:
        Array of shape `(batch,)`, not negative.
    """
    # NumPy 2.0 has `trapezoid`; its type stubs do not.
    return np.abs(np.trapezoid(force, indentations, axis=1))  # type: ignore[attr-defined, unused-ignore]


def nmae(predicted: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return 100 sum |predicted - reference| / sum |reference| of each history, in percent, shape `(batch,)`."""
    return 100.0 * np.abs(predicted - reference).sum(axis=1) / np.abs(reference).sum(axis=1)


def relative_error(predicted: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return 100 |predicted - reference| / |reference| element by element, in percent."""
    return 100.0 * np.abs(predicted - reference) / np.abs(reference)


def physical_errors(
    predicted: np.ndarray, reference: np.ndarray, times: np.ndarray, indentations: np.ndarray, unloading_from: int
) -> dict[str, np.ndarray]:
    """Return those errors of `trajectory_errors` that compare physical forces at the steps; arguments as there."""
    force, time = pull_off(times, predicted, unloading_from)
    true_force, true_time = pull_off(times, reference, unloading_from)
    return {
        "nmae_percent": nmae(predicted, reference),
        "pull_off_force_percent": relative_error(force, true_force),
        "pull_off_time_percent": relative_error(time, true_time),
        "hysteresis_percent": relative_error(hysteresis(indentations, predicted), hysteresis(indentations, reference)),
    }


def trajectory_errors(
    predicted: np.ndarray,
    reference: np.ndarray,
    *,
    predicted_scaled: np.ndarray,
    reference_scaled: np.ndarray,
    times: np.ndarray,
    indentations: np.ndarray,
    unloading_from: int,
    native_pull_off_force: np.ndarray,
) -> dict[str, np.ndarray]:
    """Return all errors of each trajectory.

    Args:
        predicted: Predicted physical forces of shape `(batch, steps)`.
        reference: Simulated physical forces of the same shape.
        predicted_scaled: Predicted scaled forces of the same shape, the output of the network.
        reference_scaled: Simulated scaled forces of the same shape.
        times: Times of the same shape.
        indentations: Indentations of the same shape.
        unloading_from: Index of the last point of the dwell.
        native_pull_off_force: Pull-off force of the solver's native history, shape `(batch,)`.

    Returns:
        Arrays of shape `(batch,)` by name: `mse`, `mae`, `dtw_rmse` on the scaled force; `nmae_percent`,
        `pull_off_force_percent`, `pull_off_time_percent`, `hysteresis_percent`, `native_pull_off_force_percent` and
        `resolution_floor_percent` on the physical force.
    """
    residual = predicted_scaled - reference_scaled
    predicted_pull_off, _ = pull_off(times, predicted, unloading_from)
    reference_pull_off, _ = pull_off(times, reference, unloading_from)
    return {
        "mse": np.mean(residual**2, axis=1),
        "mae": np.mean(np.abs(residual), axis=1),
        "dtw_rmse": dtw_rmse(predicted_scaled, reference_scaled),
        **physical_errors(predicted, reference, times, indentations, unloading_from),
        "native_pull_off_force_percent": relative_error(predicted_pull_off, native_pull_off_force),
        "resolution_floor_percent": relative_error(reference_pull_off, native_pull_off_force),
    }


def summary(errors: dict[str, np.ndarray]) -> dict[str, dict[str, float]]:
    """Return `mean`, `median`, `p90` (90th percentile) and `max` over all trajectories of each error, by name."""
    return {
        name: {
            "mean": float(np.mean(values)),
            "median": float(np.median(values)),
            "p90": float(np.percentile(values, 90)),
            "max": float(np.max(values)),
        }
        for name, values in errors.items()
    }
