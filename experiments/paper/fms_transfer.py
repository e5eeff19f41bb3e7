"""The trained model on other numbers of measurement steps (FMS), without retraining.

The paper shows one trajectory, its sample (8). The study also treats every held-out trajectory: each is simulated once
and sampled at each number of steps. Source: the paper's appendix "FMS-resolution transferability".
"""

from pathlib import Path
from typing import Any

import numpy as np

from bem import Trajectory
from bem.dataset.measurement_steps import measurement_grid, proportional_counts
from experiments import common
from experiments.cases import Case, cases_of, native
from experiments.common import Config, Dataset, Models
from experiments.harness import progress
from experiments.paper_numbers import paper_rows
from experiments.published_models import by_recipe


def sample_transfer(protocol: dict[str, Any], trained: Any, config: dict[str, Any]) -> dict[str, Any]:
    """One protocol: the solver's trajectory, and the prediction and its error for each number of steps."""
    from surrogate.data.metrics import nmae

    case, predictions = Case.of(protocol, config["modulus_ratio"]), {}
    trajectory = case.simulated(config["accuracy"])
    for total in config["steps"]:
        steps = case.on_steps(trajectory, proportional_counts(total))
        force = common.predicted(trained, steps["time"], steps["indentation"], protocol["tabor"])
        scaled = [trained.scaling.scale_force(values) for values in (force, steps["force"])]
        predictions[str(total)] = {
            "indentation": steps["indentation"],
            "predicted": force,
            "mse": float(np.mean((scaled[0] - scaled[1]) ** 2)),
            "nmae_percent": float(nmae(force[None], steps["force"][None])[0]),
        }
    return {
        "sample": int(protocol["sample"]),
        "native": native(trajectory),
        "predictions": predictions,
    }


def held_out(folder: Path, dataset: Path, config: dict[str, Any]) -> tuple[dict[str, np.ndarray], list[Trajectory]]:
    """Protocols of the held-out trajectories of a model directory, each of shape (n,), and their simulations.

    Raises:
        ValueError: The model was trained on another data set, so that its indices are not valid.
    """
    from surrogate.data.dataset import Split, TrajectoryDataset

    common.require_dataset(folder, dataset)
    indices = Split.of(folder).test[: config["trajectories"] or None]
    protocols = TrajectoryDataset.load(dataset).protocols_of(indices)
    cases = cases_of(protocols, config["modulus_ratio"])
    return protocols, [case.simulated(config["accuracy"]) for case in progress(cases, "held-out trajectories")]


def errors_on_grid(
    total: int, protocols: dict[str, np.ndarray], simulations: list[Trajectory], trained: Any
) -> dict[str, dict[str, float]]:
    """Summary of the errors of all held-out trajectories at one number of steps."""
    from surrogate.data.metrics import summary, trajectory_errors

    points_per_phase = proportional_counts(total)
    times, indentations = measurement_grid(**protocols, counts=points_per_phase)
    reference = np.stack([trajectory.at(row) for trajectory, row in zip(simulations, times, strict=True)])
    force = common.predicted(trained, times, indentations, protocols["tabor"])
    return summary(
        trajectory_errors(
            force,
            reference,
            predicted_scaled=trained.scaling.scale_force(force),
            reference_scaled=trained.scaling.scale_force(reference),
            times=times,
            indentations=indentations,
            unloading_from=points_per_phase[0] + points_per_phase[1] - 1,
            native_pull_off_force=np.array([trajectory.pull_off_force for trajectory in simulations]),
        )
    )


def study(config: Config, models: Models, dataset: Dataset) -> dict[str, Any]:
    """Predict at each number of steps with the same weights, of a training by each recipe."""
    rows = {int(row["sample"]): row for row in paper_rows("canonical_protocols")}
    labels, transfers = by_recipe(config["model"], models), {}
    protocols, simulations = held_out(models / next(iter(labels.values())), dataset, config)
    for recipe, label in labels.items():
        trained = common.load_surrogate(label, models)
        errors = {str(total): errors_on_grid(total, protocols, simulations, trained) for total in config["steps"]}
        sample = sample_transfer(rows[config["sample"]], trained, config)
        best = {
            "best_for_the_sample": min(sample["predictions"], key=lambda total: sample["predictions"][total]["mse"]),
            "best_for_the_test_set": min(errors, key=lambda total: errors[total]["mse"]["mean"]),
        }
        test_set = {"trajectories": len(simulations), "errors": errors}
        transfers[recipe] = {"summary": best, "sample": sample, "test_set": test_set}
    return {"config": config, **transfers}
