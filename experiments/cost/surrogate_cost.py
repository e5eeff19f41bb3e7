"""Times of every published surrogate: plain Keras call, ONNX Runtime one trajectory at a time, ONNX Runtime in batches.

The plain call is `model.predict` on one trajectory, features included, as most scripts do it; the others are
`surrogate.load(...).predict`. The timed work runs from the protocol to pull-off force, hysteresis and forces, as for
the solver, on one thread. Single calls are timed on the first `SINGLE_CALLS` protocols: every trajectory has the same
number of steps, so that all calls take the same time. Models that are not published are listed by name.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bem.dataset.measurement_steps import FIRST_UNLOADING, FMS, measurement_grid
from experiments.common import QUANTITIES, without_extrapolation_warnings
from experiments.lineage import dataset_digest
from experiments.paper.model_comparison import trained_otherwise
from experiments.timing import progress, timed
from surrogate.inference.model_files import weights_sha256
from surrogate.training.identity import read_identity
from surrogate.training.publishing import MODEL_FILES as FILES

if TYPE_CHECKING:
    from experiments.cost.cases import Case

Predict = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
Answer = Callable[[dict[str, np.ndarray]], np.ndarray]
BATCH_REPEATS = 5
SINGLE_CALLS = 40


def states(models: Path) -> dict[str, str]:
    """What each architecture lacks to be published: nothing (""), everything ("not trained"), or the missing files."""
    from surrogate.architectures.naming import names

    found = {}
    for name in names():
        absent = [file for file in FILES if not (models / name / file).is_file()]
        found[name] = "not trained" if len(absent) == len(FILES) else ", ".join(f"no {file}" for file in absent)
        if not absent:
            try:
                read_identity(models / name)
            except ValueError:
                found[name] = "no record of its training"
    return found


def published(models: Path) -> list[str]:
    """Names of the complete model directories, in the order of the architectures."""
    return [name for name, lacking in states(models).items() if not lacking]


def missing(models: Path) -> list[str]:
    """Architectures that are not published completely, with what an unfinished one lacks."""
    lacks = {name: lacking for name, lacking in states(models).items() if lacking}
    return [name if lacking == "not trained" else f"{name} ({lacking})" for name, lacking in lacks.items()]


def left_out(models: Path, dataset: Path) -> dict[str, list[str]]:
    """Models that the comparison leaves out, with the differences that `model_comparison.trained_otherwise` finds.

    Args:
        models: Folder of trained models; a model without a record of its training is skipped.
        dataset: Data set file on which the models must have been trained.
    """
    lineages = {}
    for path in sorted(models.glob("*/run.json")):
        with contextlib.suppress(FileNotFoundError, ValueError):
            lineages[path.parent.name] = read_identity(path.parent)
    return trained_otherwise(lineages, dataset_digest(dataset))


def outdated(models: Path, dataset: Path) -> list[str]:
    """Published models that the comparison leaves out, by name."""
    otherwise = left_out(models, dataset)
    return [name for name in published(models) if name in otherwise]


def protocol_columns(cases: list[Case]) -> dict[str, np.ndarray]:
    """Tabor parameters and quantities of the protocols, each of shape (count,)."""
    columns = {name: np.array([getattr(case.protocol, name) for case in cases]) for name in QUANTITIES[1:]}
    return {"tabor": np.array([case.scene.tabor for case in cases]), **columns}


def from_steps(force: np.ndarray, indentations: np.ndarray) -> np.ndarray:
    """Pull-off force, hysteresis and forces, of shape (count, 122), from forces and indentations (count, 120)."""
    pull_off = force[:, FIRST_UNLOADING:].max(axis=1)
    loop = np.abs(np.trapezoid(force, indentations, axis=1))
    return np.column_stack([pull_off, loop, force])


def whole_call(predict: Predict) -> Answer:
    """Function from protocols to pull-off force, hysteresis and forces, the work that is timed."""

    def answer(protocols: dict[str, np.ndarray]) -> np.ndarray:
        times, indentations = measurement_grid(**protocols)
        return from_steps(predict(times, indentations, protocols["tabor"]), indentations)

    return answer


def scaled_inputs(trained: Any, times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray) -> list[np.ndarray]:
    """Scaled inputs of a Keras model for trajectories of shape (count, 120)."""
    from surrogate.data.features import channels, edge_from_counts

    physical = channels(times, indentations, edge_from_counts(FMS, len(times)), trained.scaling.features)
    return [trained.scaling.scale_channels(physical), trained.scaling.scale_tabor(tabor)]


def keras_call(trained: Any) -> Predict:
    """Function that calls `model.predict` on physical inputs."""

    def call(*inputs: np.ndarray) -> np.ndarray:
        scaled = trained.model.predict(scaled_inputs(trained, *inputs), verbose=0)
        return trained.scaling.unscale_force(np.asarray(scaled)[..., 0])

    return call


def one_at_a_time(answer: Answer, protocols: dict[str, np.ndarray], repeats: int) -> list[np.ndarray]:
    """Seconds of shape (count,) of each repeat, after one call that is not counted."""
    count = len(protocols["tabor"])
    each = [{name: values[i : i + 1] for name, values in protocols.items()} for i in range(count)]
    answer(each[0])
    return [np.concatenate([timed(partial(answer, one), 1, first=False) for one in each]) for _ in range(repeats)]


def in_batches(answer: Answer, protocols: dict[str, np.ndarray], repeats: int, size: int = 1024) -> list[np.ndarray]:
    """Seconds per trajectory of each repeat, of shape (count,), all equal, in a batch of `size` repeated protocols."""
    count = len(protocols["tabor"])
    chosen = np.arange(size) % count
    many = {name: values[chosen] for name, values in protocols.items()}
    return [np.full(count, seconds / size) for seconds in timed(partial(answer, many), repeats)]


def surrogate_tools(cases: list[Case], models: Path, repeats: int) -> tuple[list[dict[str, Any]], list[str]]:
    """Answers (count, 122) and seconds (repeats, calls) of every published model in each way, and the missing models.

    A model that cannot be loaded is listed as missing, with the reason; the others are still measured.
    """
    names, absent = published(models), missing(models)
    if not names:
        return [], absent
    from surrogate.backend import limit_threads

    with contextlib.suppress(RuntimeError):  # the backend is loaded already: its caller has chosen the threads
        limit_threads(1)
    protocols = protocol_columns(cases)
    tools: list[dict[str, Any]] = []
    with without_extrapolation_warnings():
        for name in progress(names, "surrogates"):
            try:
                tools += _by_every_way(name, models, protocols, repeats)
            except (OSError, ValueError, KeyError) as error:
                absent.append(f"{name} ({str(error).splitlines()[0]})")
    return tools, absent


def _by_every_way(name: str, models: Path, protocols: dict[str, np.ndarray], repeats: int) -> list[dict[str, Any]]:
    from surrogate.inference.predictor import Surrogate

    trained, light = Surrogate.load(name, models, backend="keras"), Surrogate.load(name, models)
    plain, quick = whole_call(keras_call(trained)), whole_call(lambda t, d, mu: light.predict(t, d, tabor=mu))
    common = {
        "model": name,
        "parameters": trained.model.count_params(),
        "weights_sha256": weights_sha256(models / name),
    }
    answers, quick_answers = plain(protocols), quick(protocols)
    single = {quantity: values[:SINGLE_CALLS] for quantity, values in protocols.items()}
    seconds = {
        "Keras call": one_at_a_time(plain, single, repeats),
        "ONNX single": one_at_a_time(quick, single, repeats),
        "ONNX batch": in_batches(quick, protocols, BATCH_REPEATS),
    }
    return [
        {
            **common,
            "answers": answers if way == "Keras call" else quick_answers,
            "setting": f"{name}, {way}",
            "way": way,
            "seconds": runs,
        }
        for way, runs in seconds.items()
    ]
