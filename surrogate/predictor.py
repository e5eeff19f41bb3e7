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
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from surrogate.backends import ONNX_NAME, Backend, KerasBackend, OnnxBackend, keras_model
from surrogate.checks import check_history, checked_tabor, protocol_quantities
from surrogate.features import edge_from_counts, edge_from_indentations
from surrogate.model_files import existing, find_model, read_run
from surrogate.scaling import Scaling

if TYPE_CHECKING:
    import keras
    from numpy.typing import ArrayLike

    from bem.protocol import LoadingProtocol
    from surrogate.predicted import PredictedTrajectory
    from surrogate.streaming import Stream

BACKENDS = ("onnx", "keras")

# Leaves room for rates recovered from rounded times.
RANGE_TOLERANCE = 1e-6


class ExtrapolationWarning(UserWarning):
    """A prediction was asked for outside the ranges the model was trained on."""


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
            raise ValueError(f"Expected a backend of {', '.join(BACKENDS)}. Received: backend={backend!r}")
        place = find_model(name, root)
        if place.is_file():
            if backend != "onnx":
                raise ValueError(f"Expected a model directory for the {backend} backend. Received: {place}")
            return cls(OnnxBackend(place, threads))
        run, scaling = read_run(place)
        if backend == "keras":
            return cls(KerasBackend(keras_model(place, run), scaling, name=run["name"]))
        if not (place / ONNX_NAME).is_file():
            existing(place / "model.weights.h5")
            raise FileNotFoundError(
                f"No {ONNX_NAME} in {place}; make it with `surrogate export {place}`, or load with backend='keras'"
            )
        loaded = OnnxBackend(place / ONNX_NAME, threads)
        loaded.require_weights_of(place)
        return cls(loaded)

    @property
    def name(self) -> str:
        """The name shown in messages."""
        return self.backend.name

    @property
    def scaling(self) -> Scaling:
        """The scaling of the training set, with its ranges."""
        return self.backend.scaling

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
            times: Times of shape `(batch, steps)`, strictly increasing along the steps. The models were trained on the
                fixed measurement steps of `bem.measurement.measurement_grid`.
            indentations: Indentations of the same shape.
            tabor: Tabor parameters of shape `(batch,)`, or one for all.
            edge: Marks of the dwell's onset and end, of the same shape as `times`. By default they are found: the first
                and last point of each history's longest run of constant indentation, none where nothing is constant.

        Returns:
            Forces P / (pi R dgamma), tension positive, of shape `(batch, steps)`, float64.

        Raises:
            ValueError: shapes that do not fit, NaN or infinity, times that do not increase, Tabor parameters not above
                zero.

        Warns:
            ExtrapolationWarning: once, when protocols leave the ranges of the training set.
        """
        times, indentations = (np.asarray(values, dtype=np.float64) for values in (times, indentations))
        check_history(times, indentations)
        tabor = checked_tabor(tabor, len(times))
        if edge is None:
            edge = edge_from_indentations(indentations)
        else:
            edge = np.asarray(edge, dtype=np.float64)
            if edge.shape != times.shape:
                raise ValueError(f"Expected edge marks of shape {times.shape}. Received: shape {edge.shape}")
            if not np.isfinite(edge).all():
                raise ValueError("Expected edge marks of zero or one. Received: NaN or infinity")
        self._warn_outside_ranges({"tabor": tabor, **protocol_quantities(times, indentations)})
        return self.backend.force(times, indentations, tabor, edge)

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
            counts: Points of loading, dwell and unloading; the models were trained on the default. A protocol without
                dwell gets no dwell points.

        Returns:
            One trajectory per protocol, in order, with the interface of `bem.Trajectory`. What lies outside the ranges
            of the training is said in each one's `extrapolated`; no warning is issued.

        Raises:
            ValueError: something else than loading protocols, or Tabor parameters that do not fit.
        """
        from bem.measurement import measurement_grid
        from bem.protocol import LoadingProtocol
        from surrogate.predicted import predicted_trajectory

        protocols = [protocols] if isinstance(protocols, LoadingProtocol) else list(protocols)
        for protocol in protocols:
            if not isinstance(protocol, LoadingProtocol):
                raise ValueError(f"Expected LoadingProtocols; other histories go to `predict`. Received: {protocol!r}")
        tabor = checked_tabor(tabor, len(protocols))
        fields = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
        quantities = {name: np.array([getattr(p, name) for p in protocols], dtype=np.float64) for name in fields}
        start = np.array([p.start(mu) for p, mu in zip(protocols, tabor, strict=True)])
        outside = self._outside_ranges({"tabor": tabor, **quantities})
        usual_start = np.array([p.start_indentation is None for p in protocols])
        found: list[PredictedTrajectory | None] = [None] * len(protocols)
        for still in (False, True):
            chosen = np.flatnonzero((quantities["dwell_time"] > 0.0) == still)
            if not chosen.size:
                continue
            clock = time.perf_counter()
            points = counts if still else (counts[0], 0, counts[2])
            times, indentations = measurement_grid(
                tabor=tabor[chosen],
                start_indentation=start[chosen],
                counts=points,
                **{name: values[chosen] for name, values in quantities.items()},
            )
            edge = edge_from_counts(points, len(chosen))
            force = self.backend.force(times, indentations, tabor[chosen], edge)
            seconds = (time.perf_counter() - clock) / len(chosen)
            for row, index in enumerate(chosen):
                words = [f"{name} = {values[index]:.6g} {where}" for name, values, where in _at(outside, index)]
                if not usual_start[index]:
                    words.append(f"start_indentation = {start[index]:.6g} is not the training's -pi^(2/3) mu")
                found[index] = predicted_trajectory(
                    times[row],
                    indentations[row],
                    force[row],
                    unloading_from=points[0] + points[1] - 1,
                    extrapolated=tuple(words),
                    model=self.name,
                    seconds=seconds,
                )
        return found

    def stream(self, *, tabor: float) -> Stream:
        """Start a step-by-step prediction of one history, for control loops.

        Args:
            tabor: The Tabor parameter, which stays.

        Returns:
            A `surrogate.streaming.Stream`, whose `step(time, indentation, edge=False)` returns the force.

        Raises:
            ValueError: a Tabor parameter not above zero, or a model that is not causal (M5).
        """
        from surrogate.streaming import Stream

        (tabor,) = checked_tabor(tabor, 1)
        return Stream(self.backend.plan(), self.scaling, tabor=float(tabor), name=self.name)

    def predict_channels(self, sequence: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        """Predict the force from scaled channels of shape `(batch, steps, channels)` and scaled Tabor `(batch, 1)`.

        Raises:
            ValueError: a wrong number of channels, NaN, or another backend than Keras.
        """
        backend = self._keras_backend()
        expected = backend.model.inputs[0].shape[-1]
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

    def _outside_ranges(self, quantities: dict[str, np.ndarray]) -> list[tuple[str, np.ndarray, np.ndarray, str]]:
        """Quantities that leave their range somewhere: name, values, how far beyond, and the range in words."""
        outside = []
        for name, (low, high) in self.scaling.ranges.items():
            values = quantities[name]
            slack = RANGE_TOLERANCE * max(abs(low), abs(high))
            beyond = np.nan_to_num(np.maximum(low - values, values - high), nan=-np.inf)
            if values.size and beyond.max() > slack:
                outside.append(
                    (name, values, np.where(beyond > slack, beyond, 0.0), f"lies outside [{low:.6g}, {high:.6g}]")
                )
        return outside

    def _warn_outside_ranges(self, quantities: dict[str, np.ndarray]) -> None:
        outside = self._outside_ranges(quantities)
        if outside:
            worst = [f"{name} = {values[beyond.argmax()]:.6g} {where}" for name, values, beyond, where in outside]
            message = f"{self.name} extrapolates beyond its training: {'; '.join(worst)}"
            warnings.warn(message, ExtrapolationWarning, stacklevel=3)


def _at(outside: list[tuple[str, np.ndarray, np.ndarray, str]], index: int) -> list[tuple[str, np.ndarray, str]]:
    return [(name, values, where) for name, values, beyond, where in outside if beyond[index] > 0.0]
