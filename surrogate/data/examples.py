"""Trajectories of a data set as scaled inputs and targets of a network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from surrogate.data.dataset import TrajectoryDataset
from surrogate.data.features import channels, edge_from_counts
from surrogate.data.scaling import Scaling

Part = tuple[TrajectoryDataset, np.ndarray]
"""A data set and some of its trajectories."""


@dataclass(frozen=True)
class Examples:
    """Scaled trajectories: the two inputs of a model and the target.

    Args:
        sequence: A 3D float32 array of shape `(batch, steps, channels)`.
        tabor: A 2D float32 array of shape `(batch, 1)`.
        force: A 3D float32 array of shape `(batch, steps, 1)`.
    """

    sequence: np.ndarray
    tabor: np.ndarray
    force: np.ndarray

    def __len__(self) -> int:
        return len(self.sequence)

    @classmethod
    def scaled(cls, channels: np.ndarray, tabor: np.ndarray, force: np.ndarray, scaling: Scaling) -> Examples:
        """Scale physical channels, Tabor parameters and forces, of the shapes that `Scaling.fit` takes."""
        return cls(
            sequence=scaling.scale_channels(channels),
            tabor=scaling.scale_tabor(tabor),
            force=scaling.scale_force(force)[..., np.newaxis].astype(np.float32),
        )


def physical_channels(dataset: TrajectoryDataset, indices: np.ndarray, features: str) -> np.ndarray:
    """Return the physical channels of the trajectories `indices`, of shape `(batch, steps, channels)`, float64.

    Raises:
        ValueError: the feature set is unknown.
    """
    times, indentations = dataset.grid(indices)
    return channels(times, indentations, edge_from_counts(dataset.points_per_phase, len(indices)), features)


def scaled_examples(dataset: TrajectoryDataset, indices: np.ndarray, scaling: Scaling) -> Examples:
    """Return the scaled inputs and the scaled force of the trajectories `indices`."""
    channels = physical_channels(dataset, indices, scaling.features)
    return Examples.scaled(channels, dataset.protocols["tabor"][indices], dataset.force[indices], scaling)
