"""Models of the paper's kind: scenes and protocols in, trajectories out, in the words of `bem.simulate`; dimensionless.

Examples:
    >>> import surrogate
    >>> from bem import LoadingProtocol, Scene, StandardLinearSolid
    >>> model = surrogate.load("M1-concat")  # doctest: +SKIP
    >>> protocol = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
    >>> model.predict(Scene(1.0, StandardLinearSolid(0.1)), protocol).pull_off_force  # doctest: +SKIP
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from bem._support.validation import real_array
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FMS, measurement_grid
from bem.problem.protocol import LoadingProtocol
from bem.problem.scene import Scene
from surrogate import validity
from surrogate.data.features import edge_from_counts, edge_from_indentations
from surrogate.data.scaling import Scaling
from surrogate.networks import KerasNetwork, Network
from surrogate.trajectory import PredictedTrajectory, predicted_trajectories
from surrogate.validity import ExtrapolationWarning, Scenes

if TYPE_CHECKING:
    import keras
    from numpy.typing import ArrayLike

__all__ = ["ExtrapolationWarning", "Surrogate"]


class Surrogate:
    """A trained model of one material; `surrogate.load` returns one.

    Args:
        network: What computes the forces.
    """

    any_solid = False
    """Whether the model takes every linear solid."""

    def __init__(self, network: Network) -> None:
        self.network = network

    def __repr__(self) -> str:
        return f"<Surrogate: {self.name}>"

    @property
    def name(self) -> str:
        """Name of the model."""
        return self.network.name

    @property
    def scaling(self) -> Scaling:
        """The scaling of the training set, and its ranges."""
        return self.network.scaling

    @property
    def modulus_ratio(self) -> float | None:
        """Modulus ratio of the training set, the only one the model is valid for; `None` if unknown or not one."""
        return self.scaling.modulus_ratio

    @property
    def model(self) -> keras.Model:
        """The Keras model, for gradients or further training.

        Raises:
            ValueError: the model was loaded with another backend than `"keras"`.
        """
        if not isinstance(self.network, KerasNetwork):
            raise ValueError(
                f"{self.name} must be loaded with backend='keras', the only one with gradients; received "
                f"{type(self.network).__name__}"
            )
        return self.network.model

    @overload
    def predict(self, scene: Scene, protocol: LoadingProtocol) -> PredictedTrajectory: ...
    @overload
    def predict(self, scene: Scenes, protocol: Sequence[LoadingProtocol]) -> list[PredictedTrajectory]: ...
    @overload
    def predict(self, scene: Sequence[Scene], protocol: LoadingProtocol) -> list[PredictedTrajectory]: ...
    def predict(
        self, scene: Scenes, protocol: LoadingProtocol | Sequence[LoadingProtocol]
    ) -> PredictedTrajectory | list[PredictedTrajectory]:
        """Predict what `bem.simulate` would compute, for one scene and protocol or for many.

        Args:
            scene: One scene, or one for each protocol: Lennard-Jones adhesion, a standard linear solid, no spring.
            protocol: One protocol, or one for each scene.

        Returns:
            One trajectory, or a list of them in order if either argument is a list, with the interface of
            `bem.Trajectory`. Its `extrapolated` lists the quantities outside the ranges of the training set. In a list,
            what lies outside the margin too (`surrogate.validity.MARGIN`) is NaN, and its `status` says why.

        Raises:
            ValueError: an argument is something else, numbers do not fit or are out of bounds, a scene has another
                modulus ratio than the one the model knows, or one protocol lies outside the ranges and the margin.

        Warns:
            ExtrapolationWarning: once, where protocols leave the ranges of the training set.
        """
        clock = time.perf_counter()
        scenes, protocols, single = validity.contacts(scene, protocol, "(`predict_history` takes others)")
        tabor, ratio = self._contacts(scenes, len(protocols))
        if not protocols:
            return []
        paths = [
            (mu, case.peak_indentation, case.loading_rate, case.dwell_time, case.unloading_rate, case.start(mu))
            for case, mu in zip(protocols, tabor.tolist(), strict=True)
        ]
        grid = dict(zip((*QUANTITIES, "start_indentation"), np.array(paths, dtype=np.float64).T, strict=True))
        outside = validity.excesses(grid | {"modulus_ratio": ratio}, self.scaling.ranges)
        reasons = validity.refusals(outside, len(protocols), self.name, single=single)
        predictions: dict[int, PredictedTrajectory] = {}
        # Without a dwell there are no points of it.
        for dwell, chosen in ((FMS[1], grid["dwell_time"] > 0.0), (0, grid["dwell_time"] == 0.0)):
            if (rows := np.flatnonzero(chosen)).size:
                trajectories = self._trajectories(
                    {name: values[rows] for name, values in grid.items()},
                    (FMS[0], dwell, FMS[2]),
                    refusals=[reasons[row] for row in rows],
                    extrapolated=[validity.of_history(outside, row) for row in rows] if outside else (),
                    clock=clock,
                )
                predictions |= zip(rows.tolist(), trajectories, strict=True)
        if outside:
            far = np.count_nonzero(np.any([excess.beyond > 0.0 for excess in outside], axis=0))
            where = f"{far} of {len(protocols)} protocols lie outside the training of {self.name}"
            validity.warn_of_extrapolation(self.name, outside, where, reasons)
        return predictions[0] if single else [predictions[index] for index in range(len(protocols))]

    def _trajectories(
        self, grid: dict[str, np.ndarray], counts: tuple[int, int, int], *, clock: float, **fields: Any
    ) -> list[PredictedTrajectory]:
        """Predict protocols that have the same numbers of points; `fields` are those of `predicted_trajectories`."""
        times, indentations = measurement_grid(**grid, counts=counts)
        force = self.network.force(times, indentations, grid["tabor"], edge_from_counts(counts, len(times)))
        return predicted_trajectories(
            times,
            indentations,
            force,
            unloading_from=counts[0] + counts[1] - 1,
            seconds=(time.perf_counter() - clock) / len(times),
            model=self.name,
            **fields,
        )

    def predict_history(
        self, times: ArrayLike, indentations: ArrayLike, scene: Scenes, edge: ArrayLike | None = None
    ) -> np.ndarray:
        """Predict the force along indentation histories of one's own, at their own points.

        Args:
            times: Times of shape `(steps,)` or `(batch, steps)`, strictly increasing along the steps, the first one
                arbitrary. The models were trained on measurement steps (`bem.dataset.measurement_steps`).
            indentations: Indentations of the same shape.
            scene: One scene, or one for each history; see `predict`.
            edge: Marks of the same shape, one at the first and the last point of the dwell and zero elsewhere. By
                default, the dwell is the longest run of constant indentation; a history without one has no marks.

        Returns:
            Forces P / (pi R dgamma), tension positive, of the shape of `times`, float64; NaN in a batch where a
            history lies outside the ranges and the margin.

        Raises:
            ValueError: the shapes do not match; a value is NaN, infinite or outside the bounds of
                `bem.problem.protocol`; times do not increase strictly; a mark is neither zero nor one; one history lies
                outside the ranges and the margin; or as for `predict`.

        Warns:
            ExtrapolationWarning: a quantity is outside the range of the training set (`surrogate.validity`).
                One warning names all such quantities, with the value farthest outside and the range.
        """
        histories, excesses = self._checked(times, indentations, scene, edge)
        reasons = validity.refusals(excesses, len(histories[0]), self.name, single=np.ndim(times) == 1)
        refused = np.array([bool(reason) for reason in reasons])
        validity.warn_of_extrapolation(self.name, excesses, reasons=reasons)
        force = self.network.force(*histories)
        force[refused] = np.nan
        return force.reshape(np.shape(times))

    def extrapolated(
        self, times: ArrayLike, indentations: ArrayLike, scene: Scenes, edge: ArrayLike | None = None
    ) -> list[tuple[str, ...]]:
        """Return the quantities of each history outside the ranges of the training set, as text.

        Arguments and errors are those of `predict_history`, but any number of points is judged.

        Returns:
            One tuple of texts per history, empty if all quantities are inside.
        """
        histories, excesses = self._checked(times, indentations, scene, edge)
        return [validity.of_history(excesses, index) for index in range(len(histories[0]))]

    def _contacts(self, scene: Scenes, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return Tabor parameters and modulus ratios of shape `(count,)`, those that the model knows."""
        tabor, ratio = validity.tabor_parameters(scene, count), validity.modulus_ratios(scene, count)
        own = self.modulus_ratio
        if own is not None and (wrong := np.flatnonzero(np.abs(ratio - own) > validity.RANGE_TOLERANCE * own)).size:
            raise ValueError(
                f"modulus_ratio must be {own:g}, the only one that {self.name} was trained on; fast and accurate "
                f"know any solid; received {float(ratio[wrong[0]])!r}"
            )
        return tabor, ratio

    def _checked(
        self, times: ArrayLike, indentations: ArrayLike, scene: Scenes, edge: ArrayLike | None
    ) -> tuple[tuple[np.ndarray, ...], list[validity.Excess]]:
        """Return the arguments of `Network.force`, and what of them is outside the ranges."""
        times, indentations = real_array("times", times), real_array("indentations", indentations)
        shape = times.shape
        if times.ndim == 1 and indentations.shape == shape:
            times, indentations = times[np.newaxis], indentations[np.newaxis]
        validity.check_history(times, indentations)
        # The time channel of the models starts at zero.
        times = times - times[:, :1]
        marks = edge_from_indentations(indentations) if edge is None else validity.checked_edge(edge, shape)
        marks = marks.reshape(times.shape)
        tabor, ratio = self._contacts(scene, len(times))
        quantities = {"tabor": tabor, "modulus_ratio": ratio, **validity.history_quantities(times, indentations, marks)}
        return (times, indentations, tabor, marks), validity.excesses(quantities, self.scaling.ranges)
