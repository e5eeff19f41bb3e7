"""A model of any linear solid: scene and protocol in, scalar results and then the curve around them.

Stage one predicts the scalars from features of the very solid along the protocol. Stage two predicts the force at steps
around the predicted pull-off, in units of the predicted force, so that scalars and curve agree: the step at the
predicted pull-off time carries the predicted force. Units as in `bem.problem.protocol`.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import fields
from io import BytesIO
from pathlib import Path
from typing import Any, overload

import numpy as np

from bem._support.validation import finite_number
from bem._support.wording import shown
from bem.dataset.lee_radok import relaxation_spectra
from bem.dataset.measurement_steps import PULL_OFF
from bem.dataset.pull_off_steps import around_pull_off, protocol_rows
from bem.problem.protocol import LoadingProtocol, default_start_indentation
from bem.problem.scene import Scene
from surrogate.data.dense import Stage
from surrogate.data.fronts import front_steps, places
from surrogate.data.reach import Reach
from surrogate.data.solid_features import PROTOCOL, forces_without_adhesion, solid_features
from surrogate.files import STAGES, read_intact, read_record, write_run
from surrogate.intervals import LEVELS, SolidIntervals, kinds_of
from surrogate.trajectory import Doubt, PredictedTrajectory, predicted_trajectories
from surrogate.validity import OTHERWISE, ExtrapolationWarning, Scenes, contacts, tabor_parameters

SCALARS = ("pull_off_force", "pull_off_time", "hysteresis", "max_compression")
"""Results with outputs of their own."""
LEAST_LOOP = 0.05
"""Added to a hysteresis, in pi R dgamma h0, before its logarithm: that of an elastic contact may be zero."""
FORMAT = "viscoelastic-contact-solids"
INTERVALS = "intervals.npz"
_BATCH = 4096


def scalar_targets(scalars: Mapping[str, np.ndarray], begin: np.ndarray, unloading_rate: np.ndarray) -> np.ndarray:
    """What stage one learns, shape (batch, 4).

    Logarithms of the pull-off force, of the travel from the end of the dwell, `begin`, to the pull-off, and of the
    hysteresis and `LEAST_LOOP`; the inverse hyperbolic sine of the largest compression.
    """
    force, time, hysteresis, compression = (scalars[name] for name in SCALARS)
    travel = np.maximum((time - begin) * unloading_rate, 1e-2)
    return np.column_stack(
        [
            np.log(np.maximum(force, 1e-6)),
            np.log(travel),
            np.log(np.abs(hysteresis) + LEAST_LOOP),
            np.arcsinh(compression),
        ]
    )


def scalars_of(targets: np.ndarray, begin: np.ndarray, unloading_rate: np.ndarray) -> dict[str, np.ndarray]:
    """The inverse of `scalar_targets`."""
    force, travel, loop = np.exp(targets[:, :3]).T
    values = (force, begin + travel / unloading_rate, np.maximum(loop - LEAST_LOOP, 0.0), np.sinh(targets[:, 3]))
    return dict(zip(SCALARS, values, strict=True))


def curve_targets(
    force: np.ndarray, without: np.ndarray, pull_off_force: np.ndarray, counts: Sequence[int]
) -> np.ndarray:
    """What stage two learns of the force (batch, steps), beside that without adhesion.

    It is the difference of their inverse hyperbolic sines, which is relative where forces are large. Their unit is that
    of adhesion until the unloading, of which nothing before depends, and the pull-off force from there on.
    """
    units = force_units(force, pull_off_force, counts)
    return np.arcsinh(force / units) - np.arcsinh(without / units)


def curve_of(targets: np.ndarray, without: np.ndarray, pull_off_force: np.ndarray, counts: Sequence[int]) -> np.ndarray:
    """The inverse of `curve_targets`."""
    units = force_units(targets, pull_off_force, counts)
    return units * np.sinh(targets + np.arcsinh(without / units))


def force_units(like: np.ndarray, pull_off_force: np.ndarray, counts: Sequence[int]) -> np.ndarray:
    """Units of the force at steps, of the shape (batch, steps) of `like`; see `curve_targets`."""
    units = np.ones(like.shape)
    units[:, sum(counts[:2]) :] = pull_off_force[:, np.newaxis]
    return units


class SolidSurrogate:
    """A model of any linear solid; `SolidSurrogate.load` reads the folder of one.

    Args:
        stages: The two stages.
        reach: What their training covers.
        counts: Points of loading, dwell and unloading.
        name: Name of the model.
        intervals: What is known of the errors.
    """

    any_solid = True
    """Whether the model takes every linear solid."""
    modulus_ratio: float | None = None
    """The only modulus ratio that the model is valid for: of this one there is none."""

    def __init__(
        self,
        stages: tuple[Stage, Stage],
        reach: Reach,
        *,
        counts: tuple[int, int, int] = PULL_OFF,
        name: str = "",
        intervals: SolidIntervals | None = None,
    ) -> None:
        self.stages, self.reach, self.counts, self.name, self.intervals = stages, reach, counts, name, intervals

    def __repr__(self) -> str:
        return f"<SolidSurrogate: {self.name}>"

    @classmethod
    def load(cls, folder: str | Path) -> SolidSurrogate:
        """Read the folder of a model.

        Raises:
            FileNotFoundError: a file is missing.
            ValueError: a file is damaged.
        """
        folder = Path(folder)
        run = read_record(folder)
        arrays = _arrays(folder / STAGES, run)
        stages = Stage.of_arrays(arrays, "scalars"), Stage.of_arrays(arrays, "curve")
        reach = Reach(*(arrays[f"reach/{field.name}"] for field in fields(Reach)))
        intervals = SolidIntervals.of_arrays(_arrays(folder / INTERVALS, run)) if INTERVALS in run["sha256"] else None
        return cls(stages, reach, counts=tuple(run["counts"]), name=folder.name, intervals=intervals)

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
            scene: One scene, or one for each protocol: Lennard-Jones adhesion, a paraboloid, no spring, and any
                material of the package.
            protocol: One protocol, or one for each scene, each with a dwell, in the units of the material's times.
            coverage: Share of true values that intervals and bands are to contain, up to 0.99.

        Returns:
            One trajectory, or a list of them in order if either argument is a list. Its `extrapolated` lists what lies
            outside the training, where intervals are infinite; far outside (`surrogate.data.reach`), results are NaN.

        Raises:
            ValueError: a scene is of another kind, a protocol has no dwell, numbers do not fit, or one contact lies far
                outside.

        Warns:
            ExtrapolationWarning: once, where contacts leave the training.
        """
        clock = time.perf_counter()
        scenes, paths, single = contacts(scene, protocol, "with a dwell")
        coverage = finite_number("coverage", coverage, above=0.0, high=LEVELS[-1])
        tabor = tabor_parameters(scenes, len(paths))
        if any(path.dwell_time <= 0.0 for path in paths):
            raise ValueError(
                f"protocol must be one with a dwell, as in the training of {self.name}; received dwell_time 0"
            )
        if default := [path for path in paths if path.start_indentation is not None]:
            raise ValueError(f"protocol must begin where it does by default; received {shown(default[0])}")
        if not paths:
            return []
        strengths, times = _spectra(scenes * len(paths) if len(scenes) == 1 else scenes)
        quantities = {name: np.array([getattr(path, name) for path in paths]) for name in PROTOCOL[1:]}
        prediction = self.predict_many({"tabor": tabor} | quantities, strengths, times)
        outside = self.reach.outside(prediction["features"])
        reasons = self._refusals(outside, single=single)
        trajectories = predicted_trajectories(
            *(prediction[name] for name in ("times", "indentations", "force")),
            unloading_from=sum(self.counts[:2]) - 1,
            seconds=(time.perf_counter() - clock) / len(outside),
            model=self.name,
            extrapolated=[texts for texts, _ in outside],
            doubts=self._doubts(prediction, kinds_of(strengths, times), coverage),
            refusals=reasons,
        )
        return trajectories[0] if single else trajectories

    def _refusals(self, outside: list[tuple[tuple[str, ...], bool]], *, single: bool) -> list[str]:
        """Why each contact is refused, `""` if it is not; that of a single one is raised, the others are warned of."""
        reasons = [
            f"the contact must be like those of the training of {self.name}, `bem.simulate` takes others; received "
            f"{', '.join(texts)}" * far
            for texts, far in outside
        ]
        if single and reasons[0]:
            raise ValueError(reasons[0])
        if strange := [texts[0] for texts, _ in outside if texts]:
            message = f"{self.name} extrapolates beyond its training: {strange[0]}; {len(strange)} of {len(outside)} do"
            warnings.warn(f"{message}. Advice: {OTHERWISE}", ExtrapolationWarning, stacklevel=3)
        return reasons

    def _doubts(self, prediction: dict[str, np.ndarray], kinds: np.ndarray, coverage: float) -> list[Doubt]:
        """What is known of the errors of each result of `predict_many`."""
        half, shape = np.full((len(kinds), len(SCALARS) + 2), np.inf), np.ones(prediction["force"].shape)
        if self.intervals is not None:
            half, shape = self.intervals.half_widths(prediction["features"], kinds, coverage)
        half[:, SCALARS.index("hysteresis")] *= prediction["hysteresis"] + LEAST_LOOP
        readings = np.column_stack([prediction[name] for name in SCALARS])
        units = force_units(shape, prediction["pull_off_force"], self.counts)
        columns = zip(readings.tolist(), half.tolist(), shape, units, strict=True)
        return [Doubt(coverage, *fields) for fields in columns]

    def predict_many(
        self, protocols: Mapping[str, np.ndarray], strengths: np.ndarray, times: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Predict many contacts at once.

        Args:
            protocols: The five quantities by name, each of shape (batch,).
            strengths, times: Retardation terms of each solid, shape (batch, terms); those of strength zero are left
                out.

        Returns:
            `SCALARS` by name, shape (batch,), the `features` they follow from, and, of the curve, the steps' `times`,
            `indentations` and `force`, shape (batch, steps).
        """
        # An elastic contact knows no time: neither rates nor the dwell are outside any range.
        elastic = ~(strengths > 0.0).any(axis=1)
        timed = {name: np.where(elastic, 1.0, protocols[name]) for name in PROTOCOL[2:]}
        spectra = relaxation_spectra(strengths, times)
        features = solid_features({**protocols, **timed}, strengths, times, spectra)
        parts = [slice(at, at + _BATCH) for at in range(0, len(features), _BATCH)]
        results = [self._part(features[part], protocols, spectra, part) for part in parts]
        return {name: np.concatenate([result[name] for result in results]) for name in results[0]}

    def _part(
        self,
        features: np.ndarray,
        protocols: Mapping[str, np.ndarray],
        spectra: tuple[np.ndarray, np.ndarray],
        part: slice,
    ) -> dict[str, np.ndarray]:
        quantities = {name: np.asarray(protocols[name], dtype=np.float64)[part] for name in PROTOCOL}
        rate = quantities["unloading_rate"]
        travel = quantities["peak_indentation"] - default_start_indentation(quantities["tabor"])
        begin = travel / quantities["loading_rate"] + quantities["dwell_time"]
        targets = self.stages[0](features)
        scalars = scalars_of(targets, begin, rate)
        # The protocol ends where it began.
        scalars["pull_off_time"] = np.minimum(scalars["pull_off_time"], begin + travel / rate)
        moduli, relaxations = (terms[part] for terms in spectra)
        path = protocol_rows([*quantities.values(), None, scalars["pull_off_time"]])
        times, indentations = around_pull_off(path, moduli, relaxations, np.array(self.counts))
        without = forces_without_adhesion(times, indentations, quantities["tabor"], moduli, relaxations)
        where = (times, indentations, quantities["tabor"], rate, scalars["pull_off_time"])
        fronts = [(steps, places(*where, steps)) for steps in front_steps(self.counts)]
        shape = self.stages[1](np.column_stack([features, targets]), fronts)
        force = curve_of(shape, without, scalars["pull_off_force"], self.counts)
        turn = sum(self.counts[:2])
        # No force of the unloading exceeds the pull-off force, which is the one at its instant.
        force[:, turn:] = np.minimum(force[:, turn:], scalars["pull_off_force"][:, np.newaxis])
        pull_off = turn + np.abs(times[:, turn:] - scalars["pull_off_time"][:, np.newaxis]).argmin(axis=1)
        force[np.arange(len(force)), pull_off] = scalars["pull_off_force"]
        histories = {"times": times, "indentations": indentations, "force": force}
        return scalars | {"features": features, "targets": targets} | histories


def _spectra(scenes: Sequence[Scene]) -> tuple[np.ndarray, np.ndarray]:
    """Strengths and retardation times (batch, terms) of the materials, filled with terms of strength zero."""
    terms = max(1, *(len(scene.material.times) for scene in scenes))
    strengths, times = np.zeros((len(scenes), terms)), np.ones((len(scenes), terms))
    for row, material in enumerate(scene.material for scene in scenes):
        strengths[row, : len(material.times)] = material.strengths
        times[row, : len(material.times)] = material.times
    return strengths, times


def write_intervals(folder: Path, intervals: SolidIntervals) -> None:
    """Write the intervals of a model into its folder."""
    np.savez_compressed(folder / INTERVALS, **intervals.as_arrays())
    write_run(folder, read_record(folder))


def write_model(
    folder: Path, stages: tuple[Stage, Stage], reach: Reach, counts: Sequence[int], facts: Mapping[str, Any]
) -> None:
    """Write the folder of a model: its stages, what its training covers, and `facts` of it."""
    folder.mkdir(parents=True, exist_ok=True)
    arrays = {f"reach/{name}": values for name, values in vars(reach).items()}
    for name, stage in zip(("scalars", "curve"), stages, strict=True):
        arrays |= stage.as_arrays(name)
    np.savez_compressed(folder / STAGES, **arrays)
    run = {"format": FORMAT, "format_version": 1, "name": folder.name, "counts": list(counts)}
    write_run(folder, run | dict(facts))


def _arrays(path: Path, run: Mapping[str, Any]) -> dict[str, np.ndarray]:
    with np.load(BytesIO(read_intact(path, dict(run)))) as arrays:
        return dict(arrays)
