"""What the paper leaves open, each choice evaluated in more than one way by the published weights; nothing is trained.

- The symmetric logarithm, sign(x) log(1 + abs(x) / c) with a threshold c that the paper does not state: the same forces
  in each of these units. Errors of the models are those of forces predicted once.
- The step pattern of dynamic time warping: `symmetric1`, and `symmetric2`, the default of the package that it cites.
- To which phase the peak belongs, where each phase has uniformly distributed points.
- The spline: monotone, and cubic through the solver's own steps of each phase.
- Whether protocols are drawn from a grid or independently: the same weights on protocols off the grid.
- What happens at the smallest peak indentation of the text, zero.

Source: the paper's sections "Data mapping", "Surrogate-model inputs and targets" and "Model-family selection".
"""

import logging
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from bem import Trajectory
from bem.dataset.measurement_steps import FIRST_UNLOADING, FMS
from experiments import common
from experiments.cases import Case, cases_of, hidden_protocols
from experiments.common import Dataset, Models
from experiments.harness import progress
from experiments.measurements.statistics import in_units, medians
from experiments.paper.error_statistics import statistics
from experiments.paper.fms_transfer import held_out
from experiments.published_models import PAPER_TRAINED, REFERENCE, WORDED, by_recipe, paper_mse, read_model
from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.metrics import dtw_rmse, physical_errors, relative_error

Steps = Callable[[Case], tuple[np.ndarray, np.ndarray]]
THRESHOLDS = (0.01, 0.1, 1.0, 10.0)
"""Of the symmetric logarithm, in pi R dgamma; the repository's is 1."""


def symmetric2(predicted: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """DTW-RMSE by the step pattern `symmetric2`, in which a diagonal step counts twice, of shape (trajectories,)."""
    batch, steps = predicted.shape
    above = np.full((steps + 1, batch), np.inf)
    above[0] = 0.0
    for column in predicted.T:
        row = np.full((steps + 1, batch), np.inf)
        for index, value in enumerate(reference.T):
            local = (column - value) ** 2
            row[index + 1] = np.minimum(np.minimum(above[index + 1], row[index]) + local, above[index] + 2.0 * local)
        above = row
    return np.sqrt(above[-1] / (2 * steps))


def thresholds(data: TrajectoryDataset, split: Split, forces: dict[str, np.ndarray]) -> dict[str, Any]:
    """Errors of the reference model, and the MSE of all models, in the units of each threshold."""
    training, reference = (data.force[rows].astype(np.float64) for rows in (split.train, split.test))
    # These do not depend on the threshold.
    physical = physical_errors(forces[REFERENCE], reference, *data.grid(split.test), FIRST_UNLOADING)
    by_threshold = {}
    for threshold in THRESHOLDS:
        true, own, *scaled = in_units(threshold, training, reference, forces[REFERENCE], *forces.values())
        errors = {"mse": np.mean((own - true) ** 2, axis=1), "mae": np.mean(np.abs(own - true), axis=1)}
        errors["dtw_rmse"] = dtw_rmse(own, true)
        mse = {name: float(np.mean((values - true) ** 2)) for name, values in zip(forces, scaled, strict=True)}
        by_threshold[f"{threshold:g}"] = {
            **{name: float(values.mean()) for name, values in errors.items()},
            "quartiles": statistics(errors | physical)["quartiles"],
            "models": mse,
            "best": min(mse, key=mse.__getitem__),
        }
    return by_threshold


def peak_in_the_dwell(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Measurement steps whose peak is the first point of the dwell, and not the last of loading."""
    corners = case.protocol.phase_times(case.scene.tabor)
    start, peak = case.grid()[1][0], case.protocol.peak_indentation
    loading = np.linspace(corners[0], corners[1], FMS[0], endpoint=False)
    unloading = np.linspace(corners[2], corners[3], FMS[2] + 1)[1:]
    times = np.concatenate([loading, np.linspace(corners[1], corners[2], FMS[1]), unloading])
    return times, np.interp(times, corners, [start, peak, peak, start])


def cubic(trajectory: Trajectory, times: np.ndarray, corners: list[float]) -> np.ndarray:
    """Force at `times` by a cubic spline through the solver's steps of each phase."""
    force = np.empty(times.shape)
    for low, high in pairwise(corners):
        rows = (trajectory.time >= low) & (trajectory.time <= high)
        instants, first = np.unique(trajectory.time[rows], return_index=True)
        inside = (times >= low) & (times <= high)
        force[inside] = CubicSpline(instants, trajectory.force[rows][first])(times[inside])
    return force


def predicted_medians(trained: Any, cases: list[Case], simulations: list[Trajectory], steps: Steps) -> dict[str, float]:
    """Median errors of a surrogate at the measurement steps that a function gives for each case."""
    times, indentations = (np.stack(rows) for rows in zip(*map(steps, cases), strict=True))
    reference = np.stack([trajectory.at(row) for trajectory, row in zip(simulations, times, strict=True)])
    tabor = np.array([case.scene.tabor for case in cases])
    force = common.predicted(trained, times, indentations, tabor)
    return medians(physical_errors(force, reference, times, indentations, FIRST_UNLOADING))


def spline_change(cases: list[Case], simulations: list[Trajectory]) -> dict[str, float]:
    """What a cubic spline changes in the pull-off force of the data, in percent."""
    changes = []
    for case, trajectory in zip(cases, simulations, strict=True):
        times = case.grid()[0]
        splined = cubic(trajectory, times, case.protocol.phase_times(case.scene.tabor))
        forces = (force[FIRST_UNLOADING:].max() for force in (splined, trajectory.at(times)))
        changes.append(float(relative_error(*map(np.asarray, forces))))
    return {"median_percent": float(np.median(changes)), "p99_percent": float(np.percentile(changes, 99))}


def shallowest() -> list[float]:
    """Smallest and largest contact radius at a peak indentation of zero, over the ends of the ranges."""
    quick = {"peak_indentation": 1e-6, "dwell_time": 1.0, "unloading_rate": 1.0}
    rows = [quick | {"tabor": tabor, "loading_rate": rate} for tabor in (0.2, 3.2) for rate in (0.1, 1e3)]
    radii = [float(Case.of(row).simulated("standard").contact_radius.max()) for row in rows]
    return [min(radii), max(radii)]


def study(models: Models, dataset: Dataset) -> dict[str, Any]:
    """Evaluate the published weights of the trainings by the paper's recipe with each choice."""
    logging.getLogger("tensorflow").setLevel("ERROR")  # it warns of each model that it compiles
    data, label = TrajectoryDataset.load(dataset), next(iter(by_recipe(REFERENCE, models).values()))
    config = {"trajectories": 0, "modulus_ratio": common.MODULUS_RATIO, "accuracy": "standard"}
    protocols, simulations = held_out(models / label, dataset, config)
    split, cases = Split.of(models / label), cases_of(protocols)
    hidden = cases_of(hidden_protocols(len(cases), common.MODULUS_RATIO))
    labels, forces = PAPER_TRAINED | {REFERENCE: label}, {}
    for name, path in progress(list(labels.items()), "models"):
        if (models / path / "model.weights.h5").is_file():
            surrogate = common.load_surrogate(path, models)
            forces[name] = common.predicted(surrogate, *data.grid(split.test), protocols["tabor"])
    trained, by_threshold = common.load_surrogate(label, models), thresholds(data, split, forces)
    true, own = in_units(
        1.0, *(data.force[rows].astype(np.float64) for rows in (split.train, split.test)), forces[REFERENCE]
    )
    plateau = {name: models / path for name, path in (("keras", label), ("worded", WORDED)) if (models / path).is_dir()}
    return {
        "thresholds": by_threshold,
        "nearest": min(by_threshold, key=lambda name: abs(np.log(by_threshold[name]["mse"] / paper_mse()))),
        "best": sorted({errors["best"] for errors in by_threshold.values()}),
        "symmetric2": float(symmetric2(own, true).mean()),
        "peak_in_the_dwell": predicted_medians(trained, cases, simulations, peak_in_the_dwell),
        "cubic_spline": spline_change(cases, simulations),
        "off_the_grid": predicted_medians(trained, hidden, [case.simulated("standard") for case in hidden], Case.grid),
        "plateau": {
            name: {key: read_model(folder)[key] for key in ("epochs", "mse")} for name, folder in plateau.items()
        },
        "shallowest": shallowest(),
    }
