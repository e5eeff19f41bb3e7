"""What a trained model predicts along a measured indentation history.

The models learned from 50 points of loading, 20 of dwell and 50 of unloading, without noise. A history
with other points is therefore fitted by a protocol (`surrogate.inference.protocol_fit`), the force is predicted
on that protocol's measurement steps, and interpolated to the history's own instants.
"""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bem.dataset.measurement_steps import FMS
from bem.protocol import PiecewiseLinearProtocol, default_start_indentation
from surrogate.data.features import edge_from_counts
from surrogate.inference.checks import check_history
from surrogate.inference.fitted_protocol import FittedProtocol
from surrogate.inference.predicted import PredictedTrajectory, predicted_trajectory
from surrogate.inference.protocol_fit import NotOneCycleError, fit_protocol
from surrogate.inference.validity import ExtrapolationWarning, dwell_ends, has_measurement_steps

if TYPE_CHECKING:
    from surrogate.inference.predictor import Surrogate


@dataclass(frozen=True)
class HistoryPrediction:
    """A prediction along a history; the files of `surrogate predict` hold it at the history's own points.

    Args:
        time: The history's instants, shape `(steps,)`.
        indentation: Its indentations.
        trajectory: The prediction, on measurement steps where the history was fitted, else at its points.
        fitted: The protocol it was fitted by, if it was.
        unlike: Why it could not be fitted, where its points are not measurement steps; else empty.
    """

    time: np.ndarray
    indentation: np.ndarray
    trajectory: PredictedTrajectory
    fitted: FittedProtocol | None = None
    unlike: str = ""

    @property
    def force(self) -> np.ndarray:
        """The force at the history's points."""
        return np.interp(self.time, self.trajectory.time, self.trajectory.force)

    @property
    def protocol(self) -> PiecewiseLinearProtocol:
        """The path the prediction is of, for the solver."""
        if self.fitted is None:
            return PiecewiseLinearProtocol(self.time, self.indentation)
        corners, keep = np.unique(self.fitted.corners, return_index=True)
        return PiecewiseLinearProtocol(corners, self.fitted.levels()[keep])

    def at_points(self) -> PredictedTrajectory:
        """Return the prediction at the history's points as a trajectory of its own."""
        absent = np.full(self.time.shape, np.nan)
        return replace(
            self.trajectory,
            time=self.time,
            indentation=self.indentation,
            force=self.force,
            contact_radius=absent,
            unloading=self.time >= self.trajectory.time[self.trajectory.unloading][0],
        )

    def summary(self) -> dict[str, Any]:
        """Return the scalars, and the fitted protocol, ready for JSON."""
        summary = self.trajectory.summary()
        return summary if self.fitted is None else summary | {"fitted": self.fitted.summary()}


def predict_history(
    model: Surrogate, times: np.ndarray, indentations: np.ndarray, *, tabor: float, edge: np.ndarray | None = None
) -> HistoryPrediction:
    """Predict the force along one measured history.

    Args:
        model: A trained model.
        times: Instants of shape `(steps,)`, strictly increasing.
        indentations: Indentations of the same shape, with noise.
        tabor: The Tabor parameter.
        edge: Marks of the dwell's ends, where they are known.

    Returns:
        The prediction. Of a history that is not one load-dwell-unload cycle it is made at its points as they are, and
        says so.

    Raises:
        ValueError: as `Surrogate.predict`; or a ramp has too few points to determine its rate.
    """
    check_history(times[np.newaxis], indentations[np.newaxis])
    try:
        fitted = fit_protocol(times, indentations, edge=edge, ends=float(default_start_indentation(tabor)))
    except NotOneCycleError as error:
        return HistoryPrediction(
            times, indentations, _predicted(model, times, indentations, tabor, edge), unlike=str(error)
        )
    if fitted.exact and has_measurement_steps(times, indentations, edge):
        return HistoryPrediction(times, indentations, _predicted(model, times, indentations, tabor, edge))
    # A dwell too short to be seen between two points is taken for the shortest of the training: without one there are
    # fewer steps, of which the model has seen none.
    onset = min(int(np.searchsorted(times, fitted.corners[1], side="right")), len(times) - 1)
    unseen = min(float(times[onset] - times[onset - 1]), model.scaling.ranges.get("dwell_time", (0.0,))[0] or 1e-3)
    if fitted.dwell_time < unseen:
        fitted = fitted.with_dwell(unseen)
    trajectory = _predicted(model, *fitted.measurement_steps(), tabor, edge_from_counts(FMS, 1)[0])
    return HistoryPrediction(times, indentations, trajectory, fitted)


def _predicted(
    model: Surrogate, times: np.ndarray, indentations: np.ndarray, tabor: float, edge: np.ndarray | None
) -> PredictedTrajectory:
    history = (times[np.newaxis], indentations[np.newaxis])
    marks = None if edge is None else edge[np.newaxis]
    (words,) = model.extrapolated(*history, tabor=tabor, edge=marks)
    clock = time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        (force,) = model.predict(*history, tabor=tabor, edge=marks)
    return predicted_trajectory(
        times,
        indentations,
        force,
        unloading_from=max(int(indentations.argmax()), dwell_ends(indentations, edge)[1]),
        extrapolated=words,
        model=model.name,
        seconds=time.perf_counter() - clock,
    )
