"""Trained models: they map histories to forces and protocols to trajectories, all physical and dimensionless.

Examples:
    >>> import surrogate
    >>> from bem import LoadingProtocol
    >>> model = surrogate.load("M1-concat")  # doctest: +SKIP
    >>> protocol = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
    >>> model.trajectories([protocol], tabor=1.0)[0].pull_off_force  # doctest: +SKIP
"""

from __future__ import annotations

import time
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
    ExtrapolationWarning,
    excesses,
    history_quantities,
    of_history,
    warn_of_extrapolation,
)

if TYPE_CHECKING:
    import keras
    from numpy.typing import ArrayLike

    from bem.protocol import LoadingProtocol
    from surrogate.inference.predicted import PredictedTrajectory
    from surrogate.inference.streaming import Stream

__all__ = ["ExtrapolationWarning", "Surrogate"]


class Surrogate:
    """A trained model; `surrogate.load` returns one.

    Args:
        backend: The backend that computes the forces.
    """

    def __init__(self, backend: Backend) -> None:
        self.backend = backend

    @classmethod
    def load(
        cls,
        name: str | Path,
        root: str | Path | None = None,
        *,
        backend: str = "onnx",
        threads: int = 1,
        also: Iterable[str] = (),
    ) -> Surrogate:
        """Read a model directory or an ONNX file; see `surrogate.load` and, for `also`, `find_model`."""
        if backend not in BACKENDS:
            raise ValueError(f"Expected a backend of {', '.join(BACKENDS)}. Received: backend={shown(backend)}")
        return cls(load_backend(find_model(name, root, also=also), backend, threads))

    @property
    def name(self) -> str:
        """Name of the model."""
        return self.backend.name

    @property
    def scaling(self) -> Scaling:
        """The scaling of the training set, and its ranges."""
        return self.backend.scaling

    @property
    def modulus_ratio(self) -> float | None:
        """Modulus ratio of the training set, the only one the model is valid for; `None` if unknown."""
        return self.scaling.modulus_ratio

    @property
    def model(self) -> keras.Model:
        """The Keras model, for gradients or further training.

        Raises:
            ValueError: the model was loaded with another backend than `"keras"`.
        """
        return self._keras_backend().model

    def predict(
        self, times: np.ndarray, indentations: np.ndarray, *, tabor: ArrayLike, edge: np.ndarray | None = None
    ) -> np.ndarray:
        """Predict the force along indentation histories.

        Args:
            times: Times of shape `(batch, steps)`, strictly increasing along the steps, the first one arbitrary. The
                models were trained on the fixed measurement steps of `bem.dataset.measurement_steps.measurement_grid`.
            indentations: Indentations of the same shape.
            tabor: Tabor parameters of shape `(batch,)`, or one for all histories.
            edge: Marks of the same shape, one at the first and the last point of the dwell and zero elsewhere. By
                default, the dwell is the longest run of constant indentation; a history without one has no marks.

        Returns:
            Forces P / (pi R dgamma), tension positive, of shape `(batch, steps)`, float64.

        Raises:
            ValueError: the shapes do not match; a value is NaN, infinite or outside the bounds of `bem.protocol`; times
                do not increase strictly; a mark is neither zero nor one; a Tabor parameter is not above zero.

        Warns:
            ExtrapolationWarning: a quantity is outside the range of the training set (`surrogate.inference.validity`).
                One warning names all such quantities, with the value farthest outside and the range.
        """
        times, indentations, tabor, edge = self._checked(times, indentations, tabor, edge)
        quantities = {"tabor": tabor, **history_quantities(times, indentations, edge)}
        warn_of_extrapolation(self.name, excesses(quantities, self.scaling.ranges))
        return self.backend.force(times, indentations, tabor, edge)

    def extrapolated(
        self, times: np.ndarray, indentations: np.ndarray, *, tabor: ArrayLike, edge: np.ndarray | None = None
    ) -> list[tuple[str, ...]]:
        """Return the quantities of each history outside the ranges of the training set, as text.

        The arguments are those of `predict`.

        Returns:
            One tuple of texts per history, empty if all quantities are inside.

        Raises:
            ValueError: as for `predict`.
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
        """Predict the trajectories of loading protocols.

        Args:
            protocols: One protocol or a sequence of them.
            tabor: One Tabor parameter per protocol, or one for all.
            counts: Number of points in loading, dwell and unloading. The models were trained on the default; with far
                fewer or more points they extrapolate. A protocol without a dwell has no dwell points.

        Returns:
            One trajectory per protocol, in the same order, with the interface of `bem.Trajectory`. Its `extrapolated`
            lists the quantities outside the ranges of the training set; there is no warning.

        Raises:
            ValueError: an item is not a `bem.LoadingProtocol`, the number of Tabor parameters does not match, or a
                history is outside the bounds of `bem.protocol`.
        """
        from bem.dataset.measurement_steps import measurement_grid
        from bem.protocol import LoadingProtocol
        from surrogate.inference.predicted import predicted_trajectory

        protocols = list(protocols) if isinstance(protocols, Iterable) else [protocols]
        for protocol in protocols:
            if not isinstance(protocol, LoadingProtocol):
                raise ValueError(
                    f"Expected LoadingProtocols; `predict` takes other histories. Received: {shown(protocol)}"
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
        """Start the step-by-step prediction of one history, for control loops.

        Args:
            tabor: The Tabor parameter of the history.

        Returns:
            A `surrogate.inference.streaming.Stream`, whose `step(time, indentation, edge=False)` returns the force.

        Raises:
            ValueError: the Tabor parameter is not above zero, or the model is not causal (M5).

        Warns:
            ExtrapolationWarning: the Tabor parameter is outside the range of the training set.
        """
        from surrogate.inference.streaming import Stream

        graph = self.backend.graph()
        checked = checked_tabor(tabor, 1)
        warn_of_extrapolation(self.name, excesses({"tabor": checked}, self.scaling.ranges))
        return Stream(graph, self.scaling, tabor=float(checked[0]), name=self.name)

    def predict_channels(self, sequence: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        """Predict the force from scaled inputs (`Scaling.scale_channels`, `Scaling.scale_tabor`).

        Args:
            sequence: Scaled channels of shape `(batch, steps, channels)`.
            tabor: Scaled Tabor parameters of shape `(batch, 1)`.

        Returns:
            Physical forces of shape `(batch, steps)`, float64.

        Raises:
            ValueError: the shape of the channels is wrong, a channel is not finite, or the model was loaded with
                another backend than `"keras"`.
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
                f"Expected a model loaded with backend='keras', the only one with scaled channels and gradients. "
                f"Received: {self.name} with {type(self.backend).__name__}"
            )
        return self.backend

    def _checked(
        self, times: np.ndarray, indentations: np.ndarray, tabor: ArrayLike, edge: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        times, indentations = real_array("times", times), real_array("indentations", indentations)
        check_history(times, indentations)
        # The time channel of the models starts at zero.
        times = times - times[:, :1]
        edge = edge_from_indentations(indentations) if edge is None else checked_edge(edge, times.shape)
        return times, indentations, checked_tabor(tabor, len(times)), edge
