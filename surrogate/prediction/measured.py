"""Prediction of the force along a measured indentation history.

The paper's models were trained on 50 points of loading, 20 of dwell and 50 of unloading, without noise. For a history
with other points, a protocol is fitted (`surrogate.prediction.protocol_fit`), the force is predicted at the measurement
steps of that protocol, and it is interpolated to the times of the history. Units as in `bem.protocol`.
"""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bem.dataset.measurement_steps import FMS
from bem.protocol import PiecewiseLinearProtocol, default_start_indentation
from bem.scene import Scene
from surrogate.data.features import edge_from_counts
from surrogate.prediction.checks import check_history
from surrogate.prediction.predicted import PredictedTrajectory, predicted_trajectory
from surrogate.prediction.protocol_fit import FittedProtocol, NotOneCycleError, fit_protocol
from surrogate.prediction.validity import ExtrapolationWarning, dwell_ends, has_measurement_steps

if TYPE_CHECKING:
    from surrogate.prediction.predictor import Surrogate


@dataclass(frozen=True)
class HistoryPrediction:
    """Prediction along a history; the files of `surrogate predict` hold it at the points of the history.

    Args:
        time: Times of the history, shape `(steps,)`.
        indentation: Indentations of the history, shape `(steps,)`.
        trajectory: The prediction, at the measurement steps of the fitted protocol, or at the points of the history if
            no protocol was fitted.
        fitted: The fitted protocol; `None` if the history was predicted at its own points.
        unlike: Why no protocol could be fitted, as a sentence; otherwise `""`.
    """

    time: np.ndarray
    indentation: np.ndarray
    trajectory: PredictedTrajectory
    fitted: FittedProtocol | None = None
    unlike: str = ""

    @property
    def force(self) -> np.ndarray:
        """The force at the points of the history, shape `(steps,)`."""
        return np.interp(self.time, self.trajectory.time, self.trajectory.force)

    @property
    def protocol(self) -> PiecewiseLinearProtocol:
        """The path of the prediction, as the solver takes it."""
        if self.fitted is None:
            return PiecewiseLinearProtocol(self.time, self.indentation)
        corners, keep = np.unique(self.fitted.corners, return_index=True)
        return PiecewiseLinearProtocol(corners, self.fitted.levels()[keep])

    def summary(self) -> dict[str, Any]:
        """Return the scalars and the fitted protocol by name, ready for JSON."""
        summary = self.trajectory.summary()
        return summary if self.fitted is None else summary | {"fitted": self.fitted.summary()}


def predict_measured(
    model: Surrogate, times: np.ndarray, indentations: np.ndarray, scene: Scene, edge: np.ndarray | None = None
) -> HistoryPrediction:
    """Predict the force along one measured history.

    Args:
        model: A trained model, of uniform measurement steps.
        times: Times of shape `(steps,)`, strictly increasing.
        indentations: Indentations of the same shape; they may have noise.
        scene: The scene.
        edge: Marks of the same shape, one at the first and the last point of the dwell and zero elsewhere, if known.

    Returns:
        The prediction. A history that is not one load-dwell-unload cycle is predicted at its own points, and `unlike`
        says why.

    Raises:
        ValueError: as for `Surrogate.predict_history`, the model has steps of its own, or a ramp has too few points to
            determine its rate.
    """
    if model.steps != "uniform":
        raise ValueError(
            f"Expected a model of uniform measurement steps for a measured history, such as M1-concat of the paper; "
            f"its protocol may be given to any model. Received: {model.name}, which computes at steps of its own"
        )
    check_history(times[np.newaxis], indentations[np.newaxis])
    try:
        fitted = fit_protocol(times, indentations, edge=edge, ends=float(default_start_indentation(scene.tabor)))
    except NotOneCycleError as error:
        found = _predicted(model, times, indentations, scene, edge)
        return HistoryPrediction(times, indentations, found, unlike=str(error))
    if fitted.exact and has_measurement_steps(times, indentations, edge):
        return HistoryPrediction(times, indentations, _predicted(model, times, indentations, scene, edge))
    # A dwell that is shorter than the interval between two points, or absent, is replaced by the shortest dwell of the
    # training set, or by that interval if it is smaller. Without a dwell there would be fewer steps, on which the model
    # was not trained.
    onset = min(int(np.searchsorted(times, fitted.corners[1], side="right")), len(times) - 1)
    unseen = min(float(times[onset] - times[onset - 1]), model.scaling.ranges.get("dwell_time", (0.0,))[0] or 1e-3)
    if fitted.dwell_time < unseen:
        fitted = fitted.with_dwell(unseen)
    trajectory = _predicted(model, *fitted.measurement_steps(), scene, edge_from_counts(FMS, 1)[0])
    return HistoryPrediction(times, indentations, trajectory, fitted)


def _predicted(
    model: Surrogate, times: np.ndarray, indentations: np.ndarray, scene: Scene, edge: np.ndarray | None
) -> PredictedTrajectory:
    (words,) = model.extrapolated(times, indentations, scene, edge)
    clock = time.perf_counter()
    with warnings.catch_warnings(action="ignore", category=ExtrapolationWarning):
        force = model.predict_history(times, indentations, scene, edge)
    return predicted_trajectory(
        times,
        indentations,
        force,
        unloading_from=max(int(indentations.argmax()), dwell_ends(indentations, edge)[1]),
        extrapolated=words,
        model=model.name,
        seconds=time.perf_counter() - clock,
    )
