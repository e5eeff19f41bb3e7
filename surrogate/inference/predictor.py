"""Trained models for users: physical arrays or protocols in, forces or trajectories out.

Example:
    >>> import surrogate
    >>> from bem import LoadingProtocol
    >>> model = surrogate.load("M1-concat")  # doctest: +SKIP
    >>> protocol = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
    >>> model.trajectories([protocol], tabor=1.0)[0].pull_off_force  # doctest: +SKIP
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bem._support.validation import real_array
from bem._support.wording import shown
from surrogate.data.features import edge_from_counts, edge_from_indentations
from surrogate.data.scaling import Scaling
from surrogate.inference.backends import BACKENDS, Backend, load_backend
from surrogate.inference.checks import check_history, checked_edge, checked_tabor
from surrogate.inference.keras_backend import KerasBackend
from surrogate.inference.model_files import find_model
from surrogate.inference.validity import (
    POINTS,
    Excess,
    ExtrapolationWarning,
    advice,
    excesses,
    history_quantities,
    of_history,
    worst,
)

if TYPE_CHECKING:
    import keras
    from numpy.typing import ArrayLike

    from bem.protocol import LoadingProtocol
    from surrogate.inference.predicted import PredictedTrajectory
    from surrogate.inference.streaming import Stream


class Surrogate:
    """A trained model.

    Args:
        backend: What computes its forces.
    """

    def __init__(self, backend: Backend) -> None:
        self.backend = backend

    @classmethod
    def load(
        cls, name: str | Path, root: str | Path | None = None, *, backend: str = "onnx", threads: int = 1
    ) -> Surrogate:
        """Read a model directory or an ONNX file; see `surrogate.load`."""
        if backend not in BACKENDS:
            raise ValueError(f"Expected a backend of {', '.join(BACKENDS)}. Received: backend={shown(backend)}")
        return cls(load_backend(find_model(name, root), backend, threads))

    @property
    def name(self) -> str:
        """The name shown in messages."""
        return self.backend.name

    @property
    def scaling(self) -> Scaling:
        """The scaling of the training set, with its ranges."""
        return self.backend.scaling

    @property
    def modulus_ratio(self) -> float | None:
        """Modulus ratio of the material it was trained on, the only one it is valid for; `None` if unknown."""
        return self.scaling.modulus_ratio

    @property
    def model(self) -> keras.Model:
        """The Keras model, to be differentiated or trained further.

        Raises:
            ValueError: the model was loaded with another backend.
        """
        return self._keras_backend().model

    def predict(
        self, times: np.ndarray, indentations: np.ndarray, *, tabor: ArrayLike, edge: np.ndarray | None = None
    ) -> np.ndarray:
        """Predict the force along indentation histories.

        Args:
            times: Times of shape `(batch, steps)`, strictly increasing along the steps; a history may begin at any. The
                models were trained on the fixed measurement steps of `bem.dataset.measurement_steps.measurement_grid`.
            indentations: Indentations of the same shape.
            tabor: Tabor parameters of shape `(batch,)`, or one for all.
            edge: Marks of the dwell's onset and end, one there and zero elsewhere, of the same shape as `times`. By
                default they are found: the first and last point of each history's longest run of constant indentation,
                none where nothing is constant.

        Returns:
            Forces P / (pi R dgamma), tension positive, of shape `(batch, steps)`, float64.

        Raises:
            ValueError: shapes that do not fit, NaN or infinity, times that do not increase, numbers beyond the bounds
                of `bem.protocol`, marks other than zero and one, Tabor parameters not above zero.

        Warns:
            ExtrapolationWarning: once, naming every quantity in which a history leaves what the model was trained on
                (see `surrogate.inference.validity`), its worst value and the range.
        """
        times, indentations, tabor, edge = self._checked(times, indentations, tabor, edge)
        self._warn(excesses({"tabor": tabor, **history_quantities(times, indentations, edge)}, self.scaling.ranges))
        return self.backend.force(times, indentations, tabor, edge)

    def extrapolated(
        self, times: np.ndarray, indentations: np.ndarray, *, tabor: ArrayLike, edge: np.ndarray | None = None
    ) -> list[tuple[str, ...]]:
        """Say in words what of each history lies outside the training, for the arguments of `predict`.

        Returns:
            One tuple per history, empty where nothing does.

        Raises:
            ValueError: as `predict`.
        """
        times, indentations, tabor, edge = self._checked(times, indentations, tabor, edge)
        found = excesses({"tabor": tabor, **history_quantities(times, indentations, edge)}, self.scaling.ranges)
        return [of_history(found, index) for index in range(len(times))]

    def trajectories(
        self,
        protocols: Sequence[LoadingProtocol] | LoadingProtocol,
        *,
        tabor: ArrayLike,
        counts: tuple[int, int, int] = (50, 20, 50),
    ) -> list[PredictedTrajectory]:
        """Predict whole trajectories of loading protocols.

        Args:
            protocols: One protocol or many.
            tabor: One Tabor parameter per protocol, or one for all.
            counts: Points of loading, dwell and unloading; the models were trained on the default, and much fewer or
                more are extrapolation. A protocol without dwell gets no dwell points.

        Returns:
            One trajectory per protocol, in order, with the interface of `bem.Trajectory`. Each one's
            `extrapolated` lists what lies outside the ranges of the training; no warning is issued.

        Raises:
            ValueError: something else than loading protocols, or Tabor parameters that do not fit.
        """
        from bem.dataset.measurement_steps import measurement_grid
        from bem.protocol import LoadingProtocol
        from surrogate.inference.predicted import predicted_trajectory

        protocols = list(protocols) if isinstance(protocols, Iterable) else [protocols]
        for protocol in protocols:
            if not isinstance(protocol, LoadingProtocol):
                raise ValueError(
                    f"Expected LoadingProtocols; other histories go to `predict`. Received: {shown(protocol)}"
                )
        tabor = checked_tabor(tabor, len(protocols))
        if not protocols:
            return []
        fields = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
        quantities = {name: np.array([getattr(p, name) for p in protocols], dtype=np.float64) for name in fields}
        start = np.array([p.start(mu) for p, mu in zip(protocols, tabor, strict=True)])
        unchanged = {"tabor": tabor, **quantities, "start_indentation": start}
        loading, dwell, unloading = counts
        found: dict[int, PredictedTrajectory] = {}
        for still in (False, True):
            chosen = np.flatnonzero((quantities["dwell_time"] > 0.0) == still)
            if not chosen.size:
                continue
            clock = time.perf_counter()
            points = (loading, dwell if still else 0, unloading)
            times, indentations = measurement_grid(
                tabor=tabor[chosen],
                start_indentation=start[chosen],
                counts=points,
                **{name: values[chosen] for name, values in quantities.items()},
            )
            edge = edge_from_counts(points, len(chosen))
            check_history(times, indentations)
            force = self.backend.force(times, indentations, tabor[chosen], edge)
            counted = dict(zip(POINTS, (np.full(chosen.size, float(count)) for count in points), strict=True))
            if not still:
                del counted["dwell_points"]
            outside = excesses(
                {name: values[chosen] for name, values in unchanged.items()} | counted, self.scaling.ranges
            )
            seconds = (time.perf_counter() - clock) / len(chosen)
            for row, index in enumerate(chosen):
                found[int(index)] = predicted_trajectory(
                    times[row],
                    indentations[row],
                    force[row],
                    unloading_from=sum(points[:2]) - 1,
                    extrapolated=of_history(outside, row),
                    model=self.name,
                    seconds=seconds,
                )
        return [found[index] for index in range(len(protocols))]

    def stream(self, *, tabor: float) -> Stream:
        """Start a step-by-step prediction of one history, for control loops.

        Args:
            tabor: The Tabor parameter, which stays.

        Returns:
            A `surrogate.inference.streaming.Stream`, whose `step(time, indentation, edge=False)` returns the force.

        Raises:
            ValueError: a Tabor parameter not above zero, or a model that is not causal (M5).

        Warns:
            ExtrapolationWarning: the Tabor parameter lies outside the training's.
        """
        from surrogate.inference.streaming import Stream

        graph = self.backend.graph()
        checked = checked_tabor(tabor, 1)
        self._warn(excesses({"tabor": checked}, self.scaling.ranges))
        return Stream(graph, self.scaling, tabor=float(checked[0]), name=self.name)

    def predict_channels(self, sequence: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        """Predict the force from scaled channels of shape `(batch, steps, channels)` and scaled Tabor `(batch, 1)`.

        Raises:
            ValueError: a wrong number of channels, NaN, or another backend than Keras.
        """
        backend = self._keras_backend()
        expected = backend.model.inputs[0].shape[-1]
        sequence = real_array("sequence", sequence)
        if np.ndim(sequence) != 3 or np.shape(sequence)[-1] != expected:
            raise ValueError(
                f"Expected channels of shape (batch, steps, {expected}) for {self.name}. "
                f"Received: shape {np.shape(sequence)}"
            )
        if not np.isfinite(sequence).all():
            raise ValueError("Expected finite channels. Received: NaN or infinity")
        return backend.force_from_channels(sequence, tabor)

    def _keras_backend(self) -> KerasBackend:
        if not isinstance(self.backend, KerasBackend):
            raise ValueError(
                f"Expected a model loaded with backend='keras', which alone knows scaled channels and gradients. "
                f"Received: {type(self.backend).__name__} of {self.name}"
            )
        return self.backend

    def _checked(
        self, times: np.ndarray, indentations: np.ndarray, tabor: ArrayLike, edge: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        times, indentations = real_array("times", times), real_array("indentations", indentations)
        check_history(times, indentations)
        # The models' clock starts with the protocol; close times of a late clock have lost their last digits already.
        times = times - times[:, :1]
        edge = edge_from_indentations(indentations) if edge is None else checked_edge(edge, times.shape)
        return times, indentations, checked_tabor(tabor, len(times)), edge

    def _warn(self, found: list[Excess]) -> None:
        if found:
            words = worst(found)
            message = f"{self.name} extrapolates beyond its training: {'; '.join(words)}. Advice: {advice(words)}"
            warnings.warn(message, ExtrapolationWarning, stacklevel=3)
