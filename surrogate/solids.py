"""A model of any linear solid: scene and protocol in, scalar results and then the curve around them.

Stage one predicts the scalars from features of the very solid along the protocol. Stage two predicts the force at steps
around the predicted pull-off, in units of the predicted force, so that scalars and curve agree: the step at the
predicted pull-off time carries the predicted force. Units as in `bem.problem.protocol`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bem.dataset.lee_radok import relaxation_spectra
from bem.dataset.measurement_steps import PHYSICAL
from bem.dataset.pull_off_steps import pull_off_grid
from bem.problem.protocol import default_start_indentation
from surrogate.data.solid_features import FEATURES, PROTOCOL, forces_without_adhesion, solid_features
from surrogate.files import STAGES, read_intact, read_record, write_run
from surrogate.onnx.file import session_of

SCALARS = ("pull_off_force", "pull_off_time", "hysteresis", "max_compression")
"""Results with outputs of their own."""
FORMAT = "viscoelastic-contact-solids"
_BATCH = 4096


def scalar_targets(scalars: Mapping[str, np.ndarray], begin: np.ndarray, unloading_rate: np.ndarray) -> np.ndarray:
    """What stage one learns, shape (batch, 4).

    Logarithms of the pull-off force, of the travel from the end of the dwell, `begin`, to the pull-off, and of the
    hysteresis; the inverse hyperbolic sine of the largest compression.
    """
    force, time, hysteresis, compression = (scalars[name] for name in SCALARS)
    travel = np.maximum((time - begin) * unloading_rate, 1e-2)
    return np.column_stack(
        [
            np.log(np.maximum(force, 1e-6)),
            np.log(travel),
            np.log(np.maximum(np.abs(hysteresis), 1e-3)),
            np.arcsinh(compression),
        ]
    )


def scalars_of(targets: np.ndarray, begin: np.ndarray, unloading_rate: np.ndarray) -> dict[str, np.ndarray]:
    """The inverse of `scalar_targets`."""
    force, travel, hysteresis = np.exp(targets[:, :3]).T
    values = (force, begin + travel / unloading_rate, hysteresis, np.sinh(targets[:, 3]))
    return dict(zip(SCALARS, values, strict=True))


def curve_targets(force: np.ndarray, without: np.ndarray, pull_off_force: np.ndarray) -> np.ndarray:
    """What stage two learns: of the force (batch, steps), less that without adhesion, in units of the pull-off force."""
    return np.arcsinh((force - without) / pull_off_force[:, np.newaxis])


def curve_of(targets: np.ndarray, without: np.ndarray, pull_off_force: np.ndarray) -> np.ndarray:
    """The inverse of `curve_targets`."""
    return without + np.sinh(targets) * pull_off_force[:, np.newaxis]


def values_of(content: bytes, inputs: np.ndarray) -> np.ndarray:
    """Run the ONNX file of a stage on inputs (batch, n), and return its targets (batch, m)."""
    session = session_of(content)
    parts = [{"features": inputs[at : at + _BATCH]} for at in range(0, len(inputs), _BATCH)]
    return np.concatenate([session.run(["targets"], part)[0] for part in parts])


class SolidSurrogate:
    """A model of any linear solid; `SolidSurrogate.load` reads the folder of one.

    Args:
        stages: ONNX files of the two stages.
        counts: Points of loading, dwell and unloading.
        name: Name of the model.
        ranges: Low and high of each feature in the training, shape (features, 2).
        intervals: What is known of the errors of the scalars; `None` if nothing is.
    """

    def __init__(
        self,
        stages: tuple[bytes, bytes],
        *,
        counts: tuple[int, int, int] = PHYSICAL,
        name: str = "",
        ranges: np.ndarray | None = None,
    ) -> None:
        self.stages, self.counts, self.name, self.ranges = stages, counts, name, ranges

    @classmethod
    def load(cls, folder: str | Path) -> SolidSurrogate:
        """Read the folder of a model.

        Raises:
            FileNotFoundError: a file is missing.
            ValueError: a file is damaged.
        """
        folder = Path(folder)
        run = read_record(folder)
        scalars, curve = (read_intact(folder / name, run) for name in STAGES)
        counts, ranges = tuple(run["counts"]), np.array([run["ranges"][name] for name in FEATURES])
        return cls((scalars, curve), counts=counts, name=folder.name, ranges=ranges)

    @cached_property
    def _sessions(self) -> list[Any]:
        return [session_of(content) for content in self.stages]

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if name != "_sessions"}

    def predict_many(
        self, protocols: Mapping[str, np.ndarray], strengths: np.ndarray, times: np.ndarray, *, curve: bool = True
    ) -> dict[str, np.ndarray]:
        """Predict many contacts at once.

        Args:
            protocols: The five quantities by name, each of shape (batch,).
            strengths, times: Retardation terms of each solid, shape (batch, terms); those of strength zero are left
                out.
            curve: Whether to predict the force too.

        Returns:
            `SCALARS` by name, shape (batch,), the `features` they follow from, and, of the curve, the steps' `times`,
            `indentations` and `force`, shape (batch, steps).
        """
        features, _ = solid_features(dict(protocols), strengths, times)
        parts = [slice(at, at + _BATCH) for at in range(0, len(features), _BATCH)]
        results = [self._part(features[part], protocols, strengths, times, part, curve) for part in parts]
        return {name: np.concatenate([result[name] for result in results]) for name in results[0]}

    def _part(
        self,
        features: np.ndarray,
        protocols: Mapping[str, np.ndarray],
        strengths: np.ndarray,
        times: np.ndarray,
        part: slice,
        curve: bool,
    ) -> dict[str, np.ndarray]:
        quantities = {name: np.asarray(protocols[name], dtype=np.float64)[part] for name in PROTOCOL}
        rate = quantities["unloading_rate"]
        travel = quantities["peak_indentation"] - default_start_indentation(quantities["tabor"])
        begin = travel / quantities["loading_rate"] + quantities["dwell_time"]
        targets = self._sessions[0].run(["targets"], {"features": features})[0]
        scalars = scalars_of(targets, begin, rate)
        # The protocol ends where it began.
        scalars["pull_off_time"] = np.minimum(scalars["pull_off_time"], begin + travel / rate)
        results = scalars | {"features": features, "targets": targets}
        if not curve:
            return results
        terms = {"strengths": strengths[part], "retardation_times": times[part]}
        grid = pull_off_grid(**quantities, **terms, pull_off_time=scalars["pull_off_time"], counts=self.counts)
        without = forces_without_adhesion(*grid, quantities["tabor"], *relaxation_spectra(*terms.values()))
        shape = self._sessions[1].run(["targets"], {"features": np.column_stack([features, targets])})[0]
        force = curve_of(shape, without, scalars["pull_off_force"])
        return results | {"times": grid[0], "indentations": grid[1], "force": force}


def write_model(
    folder: Path, stages: tuple[bytes, bytes], features: np.ndarray, counts: Sequence[int], facts: Mapping[str, Any]
) -> None:
    """Write the folder of a model: its stages, the ranges of its features, and `facts` of its training."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in zip(STAGES, stages, strict=True):
        (folder / name).write_bytes(content)
    ranges = np.stack([features.min(axis=0), features.max(axis=0)], axis=1).tolist()
    run = {"format": FORMAT, "format_version": 1, "name": folder.name, "counts": list(counts)}
    write_run(folder, run | {"ranges": dict(zip(FEATURES, ranges, strict=True))} | dict(facts))
