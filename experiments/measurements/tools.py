"""Tools: ways to answer a case, by the solver, by the paper's method, and by each way of calling a surrogate.

An answer is an array of pull-off force, hysteresis and the forces at the 120 measurement steps, of shape (122,); NaN
where a tool does not complete. The timed work runs from the protocol to this answer. Closed forms are in
`experiments.measurements.closed_forms`, other software in `experiments.measurements.peers`.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import surrogate
from bem import Trajectory, simulate_paper_method
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FIRST_UNLOADING, FMS, measurement_grid
from bem.methods.version import SOLVER_VERSION
from experiments.cases import Case, cases_of
from experiments.common import MODULUS_RATIO, dataset_digest, load_surrogate, scenes, without_extrapolation_warnings
from experiments.harness import fingerprint, in_parallel, kept
from experiments.published_models import published, training_differences
from surrogate.architectures.naming import names
from surrogate.files import PRETRAINED as NAMES
from surrogate.files import PUBLISHED_PRETRAINED, weights_sha256

EXACT_TARGET = 7e-5
"""Accuracy of solutions that count as exact: all discretisation errors lie several times below `reference`'s."""
KEPT = Path("results/solver/refined")
Tool = Callable[[Case], np.ndarray]
Answers = Callable[[Sequence[Case]], np.ndarray]
Predict = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def answer_of(case: Case, trajectory: Trajectory) -> np.ndarray:
    """The answer in a trajectory."""
    if not trajectory.completed:
        return np.full(122, np.nan)
    return np.concatenate([[trajectory.pull_off_force, trajectory.hysteresis], case.on_steps(trajectory)["force"]])


def solver_at(accuracy: str | float) -> Tool:
    """The solver at one accuracy."""
    return lambda case: answer_of(case, case.run(accuracy))


def paper_method_at(size: int) -> Tool:
    """The paper's discretisation with `size` nodes and at least `size` steps in each segment."""
    return lambda case: answer_of(case, simulate_paper_method(case.scene, case.protocol, nodes=size, steps=size))


def refined(cases: Sequence[Case], jobs: int) -> np.ndarray:
    """Answers of the solver at `EXACT_TARGET`, of shape (count, 122); computed once and kept."""
    key = fingerprint(solver=SOLVER_VERSION, target=EXACT_TARGET, cases=list(map(repr, cases)))
    exact, tasks = solver_at(EXACT_TARGET), [(case,) for case in cases]
    solutions = kept(KEPT / f"{key}.json", lambda: in_parallel(exact, tasks, jobs=jobs, label="refined solutions"))
    return np.array(solutions, dtype=float)


def from_steps(force: np.ndarray, indentations: np.ndarray) -> np.ndarray:
    """Answers of shape (count, 122), from forces and indentations at the measurement steps, (count, 120)."""
    pull_off = force[:, FIRST_UNLOADING:].max(axis=1)
    loop = np.abs(np.trapezoid(force, indentations, axis=1))
    return np.column_stack([pull_off, loop, force])


def predictions(predict: Predict, cases: Sequence[Case]) -> np.ndarray:
    """Answers of a surrogate to several cases in one batch, of shape (count, 122): the work that is timed."""
    columns = {name: np.array([getattr(case.protocol, name) for case in cases]) for name in QUANTITIES[1:]}
    tabor = np.array([case.scene.tabor for case in cases])
    times, indentations = measurement_grid(tabor=tabor, **columns)
    return from_steps(predict(times, indentations, tabor), indentations)


def pretrained(name: str) -> Answers:
    """A pretrained model of any solid: its pull-off force and hysteresis, and its forces between its own steps."""
    model = surrogate.load(name, PUBLISHED_PRETRAINED)

    def answers(cases: Sequence[Case]) -> np.ndarray:
        predictions = model.predict([case.scene for case in cases], [case.protocol for case in cases])
        return np.array([answer_of(case, prediction) for case, prediction in zip(cases, predictions, strict=True)])

    return answers


def ways_to_call(name: str, models: Path) -> tuple[dict[str, Answers], dict[str, Any]]:
    """Two calls on one thread: `model.predict` of Keras, as most scripts do it, and the predictor, by ONNX Runtime.

    Returns:
        The calls by name, and what identifies the model.
    """
    from surrogate.data.features import channels, edge_from_counts

    trained, light = load_surrogate(name, models, backend="keras"), load_surrogate(name, models)
    scaling = trained.scaling

    def keras_call(times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        physical = channels(times, indentations, edge_from_counts(FMS, len(times)), scaling.features)
        scaled = trained.model.predict([scaling.scale_channels(physical), scaling.scale_tabor(tabor)], verbose=0)
        return scaling.unscale_force(np.asarray(scaled)[..., 0])

    def predictor(times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        return light.predict_history(times, indentations, scenes(tabor))

    weights = {"parameters": trained.model.count_params(), "weights_sha256": weights_sha256(models / name)}
    calls = {"Keras call": partial(predictions, keras_call), "ONNX": partial(predictions, predictor)}
    return calls, {"model": name, **weights}


def predicted(model: Any, name: str, columns: dict[str, np.ndarray]) -> list[Trajectory]:
    """What a model predicts of the protocols of columns; only one of any solid is told the modulus ratio."""
    solids = scenes(columns["tabor"], columns["modulus_ratio"] if name in NAMES else MODULUS_RATIO)
    with without_extrapolation_warnings():
        return model.predict(solids, [case.protocol for case in cases_of(columns)])


FILES = ("model.weights.h5", "model.onnx", "run.json", "scaling.json", "metrics.json")
"""What a model directory must hold to be measured."""


def complete(models: Path) -> list[str]:
    """Names of the complete model directories, in the order of the architectures."""
    return [name for name in names() if all((models / name / file).is_file() for file in FILES)]


def absent(models: Path, dataset: Path) -> dict[str, list[str]]:
    """Architectures that are not published completely, and published ones that the comparison leaves out."""
    present, otherwise = complete(models), training_differences(published(models), dataset_digest(dataset))
    missing = [name for name in names() if name not in present]
    return {"missing": missing, "outdated": [name for name in present if name in otherwise]}
