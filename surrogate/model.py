"""Trained models: scenes and protocols in, trajectories out, in the words of `bem.simulate`; all dimensionless.

Examples:
    >>> import surrogate
    >>> from bem import LoadingProtocol, Scene, StandardLinearSolid
    >>> model = surrogate.load("accurate")  # doctest: +SKIP
    >>> protocol = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
    >>> found = model.predict(Scene(1.0, StandardLinearSolid(0.3)), protocol)  # doctest: +SKIP
    >>> found.pull_off_force, found.pull_off_interval  # doctest: +SKIP
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from bem._support.validation import finite_number, real_array
from bem._support.wording import shown
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FMS
from bem.dataset.records import grid_of
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

    from surrogate.intervals import Bands

__all__ = ["ExtrapolationWarning", "Surrogate"]

STEP_TOLERANCE = 0.01  # distance of a point from its step, over the length of its phase


class Surrogate:
    """A trained model; `surrogate.load` returns one.

    Args:
        network: What computes the forces.
        steps: How the measurement steps of a protocol are placed, `"uniform"` or `"physical"`.
        counts: Points of loading, dwell and unloading.
        bands: The bands of a model that has some.
    """

    def __init__(
        self, network: Network, *, steps: str = "uniform", counts: tuple[int, ...] = FMS, bands: Bands | None = None
    ) -> None:
        self.network, self.steps, self.counts, self.bands = network, steps, counts, bands

    def __repr__(self) -> str:
        return f"<Surrogate: {self.name}{'' if self.bands is None else ', with bands'}>"

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

    @property
    def _ranges(self) -> dict[str, tuple[float, float]]:
        """Ranges of the training, and those of the points, if they are placed by the physics."""
        if self.steps == "uniform":
            return self.scaling.ranges
        points = {name: (float(count), float(count)) for name, count in zip(validity.POINTS, self.counts, strict=True)}
        return self.scaling.ranges | points | {"step_ratio": (1.0, np.inf)}

    @overload
    def predict(self, scene: Scene, protocol: LoadingProtocol, *, coverage: float = 0.9) -> PredictedTrajectory: ...
    @overload
    def predict(
        self, scene: Scenes, protocol: Sequence[LoadingProtocol], *, coverage: float = 0.9
    ) -> list[PredictedTrajectory]: ...
    @overload
    def predict(
        self, scene: Sequence[Scene], protocol: LoadingProtocol, *, coverage: float = 0.9
    ) -> list[PredictedTrajectory]: ...
    def predict(
        self, scene: Scenes, protocol: LoadingProtocol | Sequence[LoadingProtocol], *, coverage: float = 0.9
    ) -> PredictedTrajectory | list[PredictedTrajectory]:
        """Predict what `bem.simulate` would compute, for one scene and protocol or for many.

        Args:
            scene: One scene, or one for each protocol: Lennard-Jones adhesion, a standard linear solid, no spring.
            protocol: One protocol, or one for each scene. A model with bands computes one without a dwell with the
                shortest dwell of its training.
            coverage: Share of true values that the bands are to contain, up to 0.99; of a model without bands, unused.

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
        single = isinstance(scene, Scene) and not isinstance(protocol, Iterable)
        protocols = list(protocol) if isinstance(protocol, Iterable) else [protocol]
        if strange := [entry for entry in protocols if not isinstance(entry, LoadingProtocol)]:
            raise ValueError(
                f"protocol must be a LoadingProtocol (`predict_history` takes others); received {shown(strange[0])}"
            )
        if len(protocols) == 1 and isinstance(scene, Iterable):
            scene = list(scene)
            protocols *= len(scene)
        if self.bands is not None:
            coverage = finite_number("coverage", coverage, above=0.0, high=self.bands.largest_coverage)
        tabor, ratio = self._contacts(scene, len(protocols))
        if not protocols:
            return []
        paths = [
            (mu, case.peak_indentation, case.loading_rate, case.dwell_time, case.unloading_rate, case.start(mu))
            for case, mu in zip(protocols, tabor.tolist(), strict=True)
        ]
        grid = dict(zip((*QUANTITIES, "start_indentation"), np.array(paths, dtype=np.float64).T, strict=True))
        outside = validity.excesses(grid | {"modulus_ratio": ratio}, self.scaling.ranges)
        reasons = self._refusals(outside, len(protocols), single=single)
        if self.bands is not None:
            grid["dwell_time"] = np.maximum(grid["dwell_time"], self.scaling.ranges["dwell_time"][0])
        predictions: dict[int, PredictedTrajectory] = {}
        # Without a dwell there are no points of it.
        for dwell, chosen in ((self.counts[1], grid["dwell_time"] > 0.0), (0, grid["dwell_time"] == 0.0)):
            if (rows := np.flatnonzero(chosen)).size:
                subset = {name: values[rows] for name, values in grid.items()}
                trajectories = self._trajectories(
                    subset,
                    ratio[rows],
                    (self.counts[0], dwell, self.counts[2]),
                    coverage,
                    refusals=[reasons[row] for row in rows],
                    extrapolated=[validity.of_history(outside, row) for row in rows] if outside else (),
                    clock=clock,
                )
                predictions |= zip(rows.tolist(), trajectories, strict=True)
        if outside:
            far = np.count_nonzero(np.any([excess.beyond > 0.0 for excess in outside], axis=0))
            infinite = "" if self.bands is None else ", and their bands are infinite"
            where = f"{far} of {len(protocols)} protocols lie outside the training of {self.name}{infinite}"
            validity.warn_of_extrapolation(self.name, outside, where, reasons)
        return predictions[0] if single else [predictions[index] for index in range(len(protocols))]

    def _trajectories(
        self,
        grid: dict[str, np.ndarray],
        ratio: np.ndarray,
        counts: tuple[int, int, int],
        coverage: float,
        *,
        clock: float,
        **fields: Any,
    ) -> list[PredictedTrajectory]:
        """Predict protocols that have the same numbers of points; `fields` are those of `predicted_trajectories`."""
        times, indentations = grid_of(self.steps, grid, ratio, counts)
        force = self.network.force(times, indentations, grid["tabor"], ratio, edge_from_counts(counts, len(times)))
        if self.bands is not None:
            quantities = grid | {"modulus_ratio": ratio}
            fields["modulus_ratios"] = ratio.tolist()
            fields["doubts"] = self.bands.around(times, indentations, force, self.scaling, quantities, counts, coverage)
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
                `bem.problem.protocol`; times do not increase strictly; a mark is neither zero nor one; a model with
                bands is given other points than its measurement steps; one history lies outside the ranges and the
                margin; or as for `predict`.

        Warns:
            ExtrapolationWarning: a quantity is outside the range of the training set (`surrogate.validity`).
                One warning names all such quantities, with the value farthest outside and the range.
        """
        histories, excesses = self._checked(times, indentations, scene, edge)
        if self.bands is not None and histories[0].shape[1] != sum(self.counts):
            raise ValueError(
                f"histories must have the {sum(self.counts)} steps of `bem.dataset.physical_steps`, the only ones "
                f"that {self.name} knows; received {histories[0].shape[1]} points"
            )
        reasons = self._refusals(excesses, len(histories[0]), single=np.ndim(times) == 1)
        refused = np.array([bool(reason) for reason in reasons])
        if self.bands is not None:
            self._require_own_steps(*(array[~refused] for array in histories))
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

    def _refusals(self, outside: list[validity.Excess], count: int, *, single: bool) -> list[str]:
        """Return what `validity.refusals` says of each history; raise it of a single one."""
        reasons = validity.refusals(outside, count, self.name)
        if single and reasons[0]:
            raise ValueError(reasons[0])
        return reasons

    def _require_own_steps(
        self, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, ratio: np.ndarray, marks: np.ndarray
    ) -> None:
        """Refuse histories whose points are not at the measurement steps of their own protocols."""
        if not times.size:
            return
        quantities = validity.history_quantities(times, indentations, marks) | {"tabor": tabor}
        path = {name: quantities[name] for name in (*QUANTITIES, "start_indentation")}
        grid_times, grid_indentations = grid_of(self.steps, path, ratio, self.counts)
        travel = np.ptp(indentations, axis=1)
        dwell = slice(self.counts[0] - 1, self.counts[0] + self.counts[1])
        distances = np.abs(indentations - grid_indentations).max(axis=1) / travel
        waits = np.abs(times - grid_times)[:, dwell].max(axis=1) / path["dwell_time"]
        distance = float(np.maximum(distances, waits).max())
        if not distance <= STEP_TOLERANCE:
            raise ValueError(
                f"histories must be at the {sum(self.counts)} steps of `bem.dataset.physical_steps.physical_grid`, "
                f"the only ones that {self.name} knows; received a point {distance:.2g} of its phase away"
            )

    def _contacts(self, scene: Scenes, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return Tabor parameters and modulus ratios of shape `(count,)`, those that the model knows."""
        tabor, ratio = validity.contacts(scene, count)
        own = self.modulus_ratio
        if own is not None and (wrong := np.flatnonzero(np.abs(ratio - own) > validity.RANGE_TOLERANCE * own)).size:
            raise ValueError(
                f"modulus_ratio must be {own:g}, the only one that {self.name} was trained on; fast and accurate "
                f"know any standard linear solid; received {float(ratio[wrong[0]])!r}"
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
        return (times, indentations, tabor, ratio, marks), validity.excesses(quantities, self._ranges)
