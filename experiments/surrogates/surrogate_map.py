"""Where a surrogate errs: over the box, in its worst trajectories, and outside its range.

There are three parts, all for one published model: the error of every test trajectory over its protocol; the worst
trajectories, which a figure shows; and errors outside the range of training, where one quantity at a time is moved
beyond either bound by 5, 20 and 100 %, the others are random inside the box, and the exact trajectory is simulated.
"""

from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem.dataset.designs import PAPER_RANGES, Design
from bem.dataset.file import Dataset, load_dataset
from bem.dataset.measurement_steps import FIRST_UNLOADING, measurement_grid
from experiments.common import MODULUS_RATIO, load_surrogate, scenes, without_extrapolation_warnings
from experiments.measurements.cases import Hidden, results_of
from experiments.measurements.harness import Count, Seed, progress
from experiments.measurements.statistics import force_error, spread
from experiments.measurements.tools import Predict, left_out

WORST = 20
BEYOND = (0.0, 0.05, 0.2, 1.0)


def errors(predicted: np.ndarray, truth: np.ndarray, pull_off: np.ndarray) -> dict[str, np.ndarray]:
    """Force error, as `statistics.force_error`, and pull-off error against the solver's own, each of shape (batch,)."""
    force = force_error(predicted, truth)
    largest = predicted[:, FIRST_UNLOADING:].max(axis=1)
    return {"force": force, "pull_off_force": np.abs(largest - pull_off) / np.abs(pull_off)}


def over_the_box(predict: Predict, dataset: Dataset, rows: np.ndarray) -> tuple[dict[str, Any], np.ndarray]:
    """Protocols and errors of the test trajectories, and the predicted forces of shape (n, 120)."""
    protocols = {name: values[rows] for name, values in dataset.protocols.items()}
    predicted = predict(*(values[rows] for values in dataset.grid()), protocols["tabor"])
    found = errors(predicted, dataset.force[rows].astype(np.float64), dataset.scalars["pull_off_force"][rows])
    return {"index": rows, "protocols": protocols, "errors": found}, predicted


def worst(content: dict[str, Any], dataset: Dataset, predicted: np.ndarray) -> list[dict[str, Any]]:
    """The trajectories with the largest force errors, with exact and predicted forces."""

    def of(part: str, place: int) -> dict[str, float]:
        return {name: float(values[place]) for name, values in content[part].items()}

    return [
        {
            "index": int(content["index"][place]),
            "protocol": of("protocols", place),
            "errors": of("errors", place),
            "force": dataset.force[content["index"][place]].astype(np.float64),
            "predicted": predicted[place],
        }
        for place in np.argsort(-content["errors"]["force"])[:WORST]
    ]


def out_of_range(predict: Predict, count: int, seed: int) -> list[dict[str, Any]]:
    """Errors with one quantity beyond one of its bounds."""
    drawn, rows = Design("log-uniform").protocols(count, seed), []
    for name, side, share in progress(list(product(PAPER_RANGES, ("below", "above"), BEYOND)), "out of range"):
        low, high = PAPER_RANGES[name]
        value = low / (1.0 + share) if side == "below" else high * (1.0 + share)
        columns = drawn | {name: np.full(count, value)}
        times, indentations = measurement_grid(**columns)
        true = list(Hidden(columns | {"modulus_ratio": np.full(count, MODULUS_RATIO)}).simulated())
        force = np.array([one.at(np.minimum(row, one.time[-1])) for one, row in zip(true, times, strict=True)])
        found = errors(predict(times, indentations, columns["tabor"]), force, results_of(true)[:, 0])
        summary = {key: spread(values) for key, values in found.items()}
        rows.append({"quantity": name, "side": side, "beyond": share, "value": value, "errors": summary})
    return rows


def study(
    dataset: Path,
    models: Path,
    *,
    model: Annotated[str, typer.Option(help="Published model.")] = "M1-concat",
    count: Count = 100,
    seed: Seed = 8,
) -> dict[str, Any]:
    """Map the errors of one model; the cases are the protocols of each point out of range."""
    from surrogate.data.dataset import Split

    trained, data = load_surrogate(model, models), load_dataset(dataset)

    def predict(times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        return trained.predict_history(times, indentations, scenes(tabor))

    with without_extrapolation_warnings():
        content, predicted = over_the_box(predict, data, Split.load(models / model / "split.json").test)
        return {
            "model": model,
            "outdated": left_out(models, dataset).get(model, []),
            "test": content,
            "worst": worst(content, data, predicted),
            "out_of_range": out_of_range(predict, count, seed),
        }
