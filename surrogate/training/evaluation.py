"""Errors of a trained model on trajectories of its data set."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.examples import scaled_examples
from surrogate.data.metrics import trajectory_errors
from surrogate.model import Surrogate
from surrogate.networks import KerasNetwork


def evaluate(network: KerasNetwork, dataset: TrajectoryDataset, indices: np.ndarray) -> dict[str, np.ndarray]:
    """Return the errors of a model on the trajectories `indices`, by name, each of shape `(batch,)`.

    The names are those of `surrogate.data.metrics.trajectory_errors`.
    """
    times, indentations = dataset.grid(indices)
    loading, dwell, _ = dataset.points_per_phase
    scaling = network.scaling
    # The errors are those of the network's output, before it is rounded to physical forces.
    examples = scaled_examples(dataset, indices, scaling)
    parts = np.array_split(np.arange(len(indices)), -(-len(indices) // network.batch))
    scaled = [network.scaled(examples.sequence[rows], examples.tabor[rows]) for rows in parts]
    predicted = np.concatenate(scaled).astype(np.float64)
    return trajectory_errors(
        scaling.unscale_force(predicted),
        dataset.force[indices],
        predicted_scaled=predicted,
        reference_scaled=scaling.scale_force(dataset.force[indices]),
        times=times,
        indentations=indentations,
        unloading_from=loading + dwell - 1,
        native_pull_off_force=dataset.scalars["pull_off_force"][indices],
    )


def evaluate_published(
    trained: Surrogate, folder: Path, dataset_path: Path
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the test set of a model, loaded with `backend="keras"` from a directory, and its errors there.

    Returns:
        Indices, shape `(n_test,)`, and the errors of `evaluate`.

    Raises:
        FileNotFoundError: the data set file or the split does not exist.
        ValueError: the data set is not that of the training, or lacks completed trajectories of the test set.
    """
    dataset = TrajectoryDataset.load(dataset_path)
    if dataset.sha256 != trained.scaling.dataset_sha256:
        raise ValueError(
            f"the data set must be {trained.scaling.dataset_sha256[:12]}, on which {trained.name} was trained; "
            f"received {dataset_path} ({dataset.sha256[:12]})"
        )
    indices = Split.of(folder).test
    if not np.isin(indices, dataset.completed).all():
        raise ValueError(f"the test set must be of completed trajectories of {dataset_path}; received that of {folder}")
    return indices, evaluate(trained.network, dataset, indices)


def write_errors(path: Path, indices: np.ndarray, errors: dict[str, np.ndarray]) -> None:
    """Write errors as CSV: one row per trajectory, with its index in the data set and each error."""
    header, rows = ",".join(["trajectory", *errors]), np.column_stack([indices, *errors.values()])
    np.savetxt(path, rows, ["%d", *["%.7g"] * len(errors)], delimiter=",", header=header, comments="")
