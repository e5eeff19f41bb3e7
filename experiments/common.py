"""Code shared by the studies: configurations, simulations, predictions and result files.

A study that has settings reads `experiments/configs/NAME.toml`. A study writes one JSON result file: under
`results/studies/`, or under `published/` if its computation takes hours. All quantities are dimensionless, as in
`bem.trajectory`.
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
from experiments.places import CONFIGS as CONFIGS

if TYPE_CHECKING:
    from bem import LoadingProtocol, Scene, Trajectory
    from surrogate.inference.predictor import Surrogate

DATASET = Path("published/dataset.h5")
MODELS = Path("published/models")
MODULUS_RATIO = 0.1
"""Relaxed over instantaneous modulus, k = E0/Einf, of the paper's solid."""


def read_config(path: Path, *keys: str) -> dict[str, Any]:
    """Read a study's TOML file. It must hold exactly the given keys.

    Raises:
        FileNotFoundError: The file does not exist.
        ValueError: The file is not TOML, or holds other keys.
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
    """Write a result file atomically, together with its provenance (command, versions, host, revision)."""
    out.parent.mkdir(parents=True, exist_ok=True)
    complete = {**provenance(f"python -m experiments {study}"), **content}
    write_whole(out, json.dumps(complete, allow_nan=False) + "\n")


def problem(quantities: Mapping[str, float], modulus_ratio: float = MODULUS_RATIO) -> tuple[Scene, LoadingProtocol]:
    """Scene of a standard linear solid, and protocol, from the five `QUANTITIES`; other keys are ignored."""
    # Imported here, so that a study that simulates nothing does not depend on the solver.
    from bem import LoadingProtocol, Scene, StandardLinearSolid

    values = {name: float(quantities[name]) for name in QUANTITIES}
    return Scene(values.pop("tabor"), StandardLinearSolid(modulus_ratio)), LoadingProtocol(**values)


def simulated(
    quantities: Mapping[str, float], *, accuracy: str | float, modulus_ratio: float = MODULUS_RATIO
) -> Trajectory:
    """Simulate the protocol that the five values of `QUANTITIES` define, in a standard linear solid.

    Raises:
        RuntimeError: The simulation did not complete.
    """
    from bem import simulate

    trajectory = simulate(*problem(quantities, modulus_ratio), accuracy)
    if not trajectory.completed:
        raise RuntimeError(f"protocol {quantities} did not complete: {trajectory.status}")
    return trajectory


def on_steps(
    quantities: dict[str, float], trajectory: Trajectory, points_per_phase: tuple[int, int, int] = FMS
) -> dict[str, np.ndarray]:
    """Time, indentation and simulated force at the measurement steps, each of shape (steps,)."""
    times, indentations = measurement_grid(**{name: quantities[name] for name in QUANTITIES}, counts=points_per_phase)
    force = trajectory.at(times[0].clip(max=trajectory.time[-1]))
    return {"time": times[0], "indentation": indentations[0], "force": force}


def load_surrogate(model: str, models: Path, backend: str | None = None) -> Surrogate:
    """Load a trained model for one thread: by ONNX Runtime if the model was exported, otherwise by Keras.

    Raises:
        ValueError: The name of the model is not a plain name.
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
    """Silence the extrapolation warning of surrogates, for studies that report the extrapolation themselves."""
    from surrogate.inference.predictor import ExtrapolationWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ExtrapolationWarning)
        yield


def predicted(
    trained: Surrogate, steps: dict[str, np.ndarray], points_per_phase: tuple[int, int, int], tabor: float
) -> np.ndarray:
    """Force that a surrogate predicts at the measurement steps, of shape (steps,), without extrapolation warnings."""
    from surrogate.data.features import edge_from_counts

    with without_extrapolation_warnings():
        force = trained.predict(
            steps["time"][np.newaxis],
            steps["indentation"][np.newaxis],
            tabor=np.array([tabor]),
            edge=edge_from_counts(points_per_phase, 1),
        )
    return force[0]


def percent(value: float, reference: float) -> float:
    """Relative error in percent."""
    return 100.0 * abs(value - reference) / abs(reference)


def lists(arrays: dict[str, np.ndarray]) -> dict[str, list[float]]:
    """Convert arrays to lists, for JSON."""
    return {name: np.asarray(values, dtype=float).tolist() for name, values in arrays.items()}
