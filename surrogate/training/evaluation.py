"""Errors of a trained model on the trajectories of a data set."""

from __future__ import annotations

import csv
from pathlib import Path

import keras
import numpy as np

from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.features import channels, edge_from_counts
from surrogate.data.metrics import trajectory_errors
from surrogate.data.scaling import Scaling
from surrogate.inference.keras_backend import predict_scaled
from surrogate.inference.predictor import Surrogate
from surrogate.training.loop import Examples


def physical_channels(dataset: TrajectoryDataset, indices: np.ndarray, features: str) -> np.ndarray:
    """Return the physical channels of the trajectories `indices`, of shape `(batch, steps, channels)`, float64.

    Raises:
        ValueError: the feature set is unknown.
    """
    times, indentations = dataset.grid(indices)
    return channels(
        times,
        indentations,
        edge_from_counts(dataset.points_per_phase, len(indices)),
        features,
        tabor=dataset.protocols["tabor"][indices],
        modulus_ratio=dataset.modulus_ratios(indices),
    )


def scaled_examples(dataset: TrajectoryDataset, indices: np.ndarray, scaling: Scaling) -> Examples:
    """Return the scaled inputs and the scaled force of the trajectories `indices`."""
    return Examples(
        sequence=scaling.scale_channels(physical_channels(dataset, indices, scaling.features)),
        tabor=scaling.scale_tabor(dataset.protocols["tabor"][indices]),
        force=scaling.scale_force(dataset.force[indices])[..., np.newaxis].astype(np.float32),
    )


def evaluate(
    model: keras.Model, scaling: Scaling, dataset: TrajectoryDataset, indices: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the errors of a model on the trajectories `indices`, by name, each of shape `(batch,)`.

    The names are those of `surrogate.data.metrics.trajectory_errors`.
    """
    times, indentations = dataset.grid(indices)
    loading, dwell, _ = dataset.points_per_phase
    examples = scaled_examples(dataset, indices, scaling)
    predicted = predict_scaled(model, examples.sequence, examples.tabor).astype(np.float64)
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
    """Return the errors of a trained model on its test set.

    Args:
        trained: The model, loaded with `backend="keras"`.
        folder: Its model directory, with `split.json`.
        dataset_path: The data set file it was trained on.

    Returns:
        Indices of the test set, shape `(n_test,)`, and the errors of `evaluate`.

    Raises:
        FileNotFoundError: the data set file or `split.json` does not exist.
        ValueError: the data set is not that of the training, or lacks completed trajectories of the test set.
    """
    dataset = TrajectoryDataset.load(dataset_path)
    if dataset.sha256 != trained.scaling.dataset_sha256:
        raise ValueError(
            f"Expected the data set {trained.scaling.dataset_sha256[:12]}, on which {trained.name} was trained. "
            f"Received: {dataset_path} ({dataset.sha256[:12]})"
        )
    indices = Split.load(folder / "split.json").test
    if not np.isin(indices, dataset.completed).all():
        raise ValueError(
            f"Expected a test set of completed trajectories of {dataset_path}. Received: {folder / 'split.json'}"
        )
    return indices, evaluate(trained.model, trained.scaling, dataset, indices)


def write_errors(path: Path, indices: np.ndarray, errors: dict[str, np.ndarray]) -> None:
    """Write errors as CSV: one row per trajectory, with its index in the data set and each error."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["trajectory", *errors])
        for row, index in enumerate(indices):
            writer.writerow([int(index), *(f"{values[row]:.7g}" for values in errors.values())])
