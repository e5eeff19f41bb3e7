"""What the studies share: their configurations, the simulations and predictions they compare, and their result files.

Each study reads `experiments/configs/NAME.toml` (another file with `--config`) and writes one JSON result file under
`results/studies/`, or under `published/` where computing it takes hours.
"""

from __future__ import annotations

import contextlib
import json
import os
import tomllib
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.outputs import write_whole
from bem._support.provenance import provenance
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FMS, measurement_grid
from experiments.paper_numbers import PAPER_VALUES as PAPER_VALUES

if TYPE_CHECKING:
    from bem import LoadingProtocol, Scene, Trajectory
    from surrogate.inference.predictor import Surrogate

CONFIGS = Path(__file__).parent / "configs"
DATASET = Path("published/dataset.h5")
MODELS = Path("published/models")
MODULUS_RATIO = 0.1
"""Relaxed over instantaneous modulus of the paper's solid."""


def read_config(path: Path, *keys: str) -> dict[str, Any]:
    """Read a study's TOML file, which must hold exactly these keys.

    Raises:
        FileNotFoundError: no such file.
        ValueError: not TOML, or other keys.
    """
    if not path.is_file():
        raise FileNotFoundError(f"configuration not found; received {str(path)!r}")
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"configuration must be TOML; received {str(path)!r} ({error})") from error
    if set(content) != set(keys):
        raise ValueError(f"configuration must hold {', '.join(sorted(keys))}; received {', '.join(sorted(content))}")
    return content


def write_result(out: Path, study: str, content: dict[str, Any]) -> None:
    """Write a result file with where it comes from; whole or not at all."""
    out.parent.mkdir(parents=True, exist_ok=True)
    complete = {**provenance(f"python -m experiments {study}"), **content}
    write_whole(out, json.dumps(complete, allow_nan=False) + "\n")


def problem(quantities: Mapping[str, float], modulus_ratio: float = MODULUS_RATIO) -> tuple[Scene, LoadingProtocol]:
    """Scene and protocol of `QUANTITIES`, of which others are left out, in a standard linear solid."""
    # What simulates nothing is not to depend on the solver.
    from bem import LoadingProtocol, Scene, StandardLinearSolid

    values = {name: float(quantities[name]) for name in QUANTITIES}
    return Scene(values.pop("tabor"), StandardLinearSolid(modulus_ratio)), LoadingProtocol(**values)


def simulated(
    quantities: Mapping[str, float], *, accuracy: str | float, modulus_ratio: float = MODULUS_RATIO
) -> Trajectory:
    """Simulate one protocol of `QUANTITIES`.

    Raises:
        RuntimeError: the simulation did not complete.
    """
    from bem import simulate

    trajectory = simulate(*problem(quantities, modulus_ratio), accuracy)
    if not trajectory.completed:
        raise RuntimeError(f"protocol {quantities} did not complete: {trajectory.status}")
    return trajectory


def on_steps(
    quantities: dict[str, float], trajectory: Trajectory, counts: tuple[int, int, int] = FMS
) -> dict[str, np.ndarray]:
    """Times, indentations and simulated force on the measurement steps, each of shape (steps,)."""
    times, indentations = measurement_grid(**{name: quantities[name] for name in QUANTITIES}, counts=counts)
    force = trajectory.at(times[0].clip(max=trajectory.time[-1]))
    return {"time": times[0], "indentation": indentations[0], "force": force}


def load_surrogate(model: str, models: Path, backend: str | None = None) -> Surrogate:
    """A trained model on one thread; ONNX Runtime where it is exported, else Keras.

    Raises:
        ValueError: the model's name is no plain one.
    """
    from surrogate.backend import limit_threads
    from surrogate.training.publishing import model_name

    model_name(model, "a published model's name")
    if "TF_NUM_INTRAOP_THREADS" not in os.environ:
        with contextlib.suppress(RuntimeError):
            limit_threads(1)
    from surrogate.inference.predictor import Surrogate

    exported = (models / model / "model.onnx").is_file()
    return Surrogate.load(model, root=models, backend=backend or ("onnx" if exported else "keras"))


@contextlib.contextmanager
def without_extrapolation_warnings() -> Iterator[None]:
    """Let surrogates predict beyond their range in silence, where the study itself speaks of it."""
    from surrogate.inference.predictor import ExtrapolationWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        yield


def predicted(
    trained: Surrogate, steps: dict[str, np.ndarray], counts: tuple[int, int, int], tabor: float
) -> np.ndarray:
    """Force a surrogate predicts on measurement steps, shape (steps,); extrapolation is the study's to mention."""
    from surrogate.data.features import edge_from_counts

    with without_extrapolation_warnings():
        force = trained.predict(
            steps["time"][np.newaxis],
            steps["indentation"][np.newaxis],
            tabor=np.array([tabor]),
            edge=edge_from_counts(counts, 1),
        )
    return force[0]


def percent(value: float, reference: float) -> float:
    """Relative error in percent."""
    return 100.0 * abs(value - reference) / abs(reference)


def lists(arrays: dict[str, np.ndarray]) -> dict[str, list[float]]:
    """Arrays as lists, ready for JSON."""
    return {name: np.asarray(values, dtype=float).tolist() for name, values in arrays.items()}
