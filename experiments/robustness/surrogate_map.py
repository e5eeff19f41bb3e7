"""Where a surrogate errs: over the box, in its worst trajectories, and outside its range.

There are three parts, all for one published model:

- The error of every test trajectory over its protocol.
- The worst trajectories, which a figure shows, each with a cause if one can be shown: a jump of the contact, or a peak
  so narrow that the measurement steps themselves miss it, if at least half of the error lies within a few steps of it.
  It is also stated whether the protocol lies in a corner of the box, that is, whether at least two of the five
  quantities lie in the outermost twentieth of their logarithmic range. This is a location and not a cause.
- Errors outside the range of training: one quantity at a time is moved beyond either bound by 5, 20 and 100 %, while
  the others are random inside the box, and the exact trajectory is simulated.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
import typer

from bem.dataset.designs import PAPER_RANGES, Design
from bem.dataset.file import Dataset, load_dataset
from bem.dataset.measurement_steps import FIRST_UNLOADING, measurement_grid
from experiments.common import (
    DATASET,
    MODELS,
    load_surrogate,
    simulated,
    without_extrapolation_warnings,
    write_result,
)
from experiments.cost.surrogate_cost import left_out
from experiments.paper.dataset_statistics import resolution_floor
from experiments.timing import FORCE_ERROR, MEASUREMENTS, DatasetFile, Models, Out, force_error, plain, progress, spread

OUT = MEASUREMENTS / "surrogate_map.json"
WORST = 20
BEYOND = (0.0, 0.05, 0.2, 1.0)
CORNER_SHARE, CORNER_QUANTITIES, NARROW = 0.05, 2, 0.05
NEAR, LOCAL_SHARE = 3, 0.5
"""Measurement steps on either side of an event, and the share of the error there that makes the event its cause."""
Predict = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def errors(predicted: np.ndarray, truth: np.ndarray, pull_off: np.ndarray) -> dict[str, np.ndarray]:
    """Force error, as `timing.force_error`, and pull-off error against the solver's own, each of shape (batch,)."""
    force = force_error(predicted, truth)
    largest = predicted[:, FIRST_UNLOADING:].max(axis=1)
    return {"force": force, "pull_off_force": np.abs(largest - pull_off) / np.abs(pull_off)}


def edges_touched(protocols: dict[str, np.ndarray]) -> np.ndarray:
    """Number of quantities in the outermost part of their logarithmic range, of shape (n,)."""
    count = 0
    for name, (low, high) in PAPER_RANGES.items():
        place = np.log(protocols[name] / low) / np.log(high / low)
        count = count + (np.abs(place - 0.5) > 0.5 - CORNER_SHARE)
    return np.asarray(count)


def share_near(place: int, predicted: np.ndarray, truth: np.ndarray) -> float:
    """Share of the sum of |dP| over the steps, (120,), that lies within `NEAR` steps of step `place`."""
    difference = np.abs(predicted - truth)
    return float(difference[max(place - NEAR, 0) : place + NEAR + 1].sum() / max(difference.sum(), 1e-300))


def causes(jumps: np.ndarray, floor: np.ndarray, predicted: np.ndarray, truth: np.ndarray) -> list[list[str]]:
    """Causes of the error of each trajectory: events near which at least `LOCAL_SHARE` of it lies. May be empty."""
    found = []
    for i in range(len(jumps)):
        # If the contact jumped, it did so where the force changes most from one step to the next.
        places = {
            "jump": (jumps[i] > 0, int(np.argmax(np.abs(np.diff(truth[i]))))),
            "narrow peak": (floor[i] > NARROW, FIRST_UNLOADING + int(np.argmax(truth[i, FIRST_UNLOADING:]))),
        }
        found.append(
            [
                name
                for name, (there, place) in places.items()
                if there and share_near(place, predicted[i], truth[i]) >= LOCAL_SHARE
            ]
        )
    return found


def over_the_box(predict: Predict, dataset: Dataset, rows: np.ndarray) -> tuple[dict[str, Any], np.ndarray]:
    """Protocols, errors and causes of the test trajectories, and the predicted forces of shape (n, 120)."""
    times, indentations = (values[rows] for values in dataset.grid())
    predicted = predict(times, indentations, dataset.protocols["tabor"][rows])
    truth = dataset.force[rows].astype(np.float64)
    protocols = {name: values[rows] for name, values in dataset.protocols.items()}
    everywhere = np.full(len(dataset), np.nan)
    everywhere[dataset.completed] = resolution_floor(dataset)["pull_off_force"]
    floor = everywhere[rows]
    content = {
        "index": rows,
        "protocols": protocols,
        "errors": errors(predicted, truth, dataset.scalars["pull_off_force"][rows]),
        "floor": floor,
        "causes": causes(dataset.scalars["jump_count"][rows], floor, predicted, truth),
        "corner": edges_touched(protocols) >= CORNER_QUANTITIES,
    }
    return content, predicted


def worst(content: dict[str, Any], dataset: Dataset, predicted: np.ndarray) -> list[dict[str, Any]]:
    """The trajectories with the largest force errors, with exact and predicted forces."""
    times, indentations = dataset.grid()
    found = []
    for place in np.argsort(-content["errors"]["force"])[:WORST]:
        index = int(content["index"][place])
        found.append(
            {
                "index": index,
                "protocol": {name: float(values[place]) for name, values in content["protocols"].items()},
                "causes": content["causes"][place],
                "corner": bool(content["corner"][place]),
                "errors": {name: float(values[place]) for name, values in content["errors"].items()},
                "time": times[index],
                "indentation": indentations[index],
                "force": dataset.force[index].astype(np.float64),
                "predicted": predicted[place],
            }
        )
    return found


def shares(content: dict[str, Any]) -> dict[str, Any]:
    """Force error of the trajectories with each cause, and of those without, by whether they lie in a corner."""
    force, corner = content["errors"]["force"], np.asarray(content["corner"])
    none = np.array([not own for own in content["causes"]])
    chosen = {name: np.array([name in own for own in content["causes"]]) for name in ("jump", "narrow peak")}
    chosen |= {"corner of the box": none & corner, "none of these": none & ~corner}
    return {name: spread(force[rows]) for name, rows in chosen.items()}


def out_of_range(predict: Predict, count: int, seed: int) -> list[dict[str, Any]]:
    """Errors with one quantity beyond one of its bounds."""
    drawn = Design("log-uniform").protocols(count, seed)
    rows = []
    for name, (low, high) in progress(PAPER_RANGES.items(), "out of range"):
        for side in ("below", "above"):
            for share in BEYOND:
                value = low / (1.0 + share) if side == "below" else high * (1.0 + share)
                columns = drawn | {name: np.full(count, value)}
                times, indentations = measurement_grid(**columns)
                force, pull_off = np.empty(times.shape), np.empty(count)
                for i in range(count):
                    quantities = {key: float(values[i]) for key, values in columns.items()}
                    trajectory = simulated(quantities, accuracy="standard")
                    force[i] = trajectory.at(np.minimum(times[i], trajectory.time[-1]))
                    pull_off[i] = trajectory.pull_off_force
                found = errors(predict(times, indentations, columns["tabor"]), force, pull_off)
                summary = {key: spread(values) for key, values in found.items()}
                rows.append({"quantity": name, "side": side, "beyond": share, "value": value, "errors": summary})
    return rows


def main(
    model: Annotated[str, typer.Option(help="Published model.")] = "M1-concat",
    count: Annotated[int, typer.Option(help="Protocols of each point out of range.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of the protocols out of range.")] = 8,
    dataset: DatasetFile = DATASET,
    models: Models = MODELS,
    out: Out = OUT,
) -> None:
    """Map the errors of one model."""
    from surrogate.data.dataset import Split

    trained = load_surrogate(model, models)

    def predict(times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray) -> np.ndarray:
        return trained.predict(times, indentations, tabor=tabor)

    data = load_dataset(dataset)
    with without_extrapolation_warnings():
        content, predicted = over_the_box(predict, data, Split.load(models / model / "split.json").test)
        result = {
            "model": model,
            "outdated": left_out(models, dataset).get(model, []),
            "force_error": FORCE_ERROR,
            "test": content,
            "by_cause": shares(content),
            "worst": worst(content, data, predicted),
            "out_of_range": out_of_range(predict, count, seed),
        }
    write_result(out, f"surrogate_map --model {model} --count {count} --seed {seed}", plain(result))
    print(f"{model}: median force error {100 * np.median(content['errors']['force']):.3g} % of the range")
