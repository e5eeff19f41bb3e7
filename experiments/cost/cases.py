"""The held-out protocols for `experiments.cost.accuracy_cost`, and the solver's answer to one of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bem import LoadingProtocol, Scene, Trajectory, simulate
from bem.dataset.measurement_steps import measurement_times
from experiments.common import problem


@dataclass(frozen=True)
class Case:
    """One scene and protocol."""

    scene: Scene
    protocol: LoadingProtocol

    def run(self, accuracy: str | float) -> Trajectory:
        """Simulate the case."""
        return simulate(self.scene, self.protocol, accuracy)

    def force_history(self, trajectory: Trajectory) -> np.ndarray:
        """Force at the 120 fixed measurement steps, of shape (120,)."""
        return trajectory.at(np.minimum(measurement_times(self.protocol, self.scene.tabor), trajectory.time[-1]))


def held_out(count: int, dataset: Path) -> list[Case]:
    """The first protocols of the data set's test part."""
    from surrogate.data.dataset import TrajectoryDataset

    data = TrajectoryDataset.load(dataset)
    rows = data.split(0).test[:count]
    return [Case(*problem({name: values[i] for name, values in data.protocols.items()})) for i in rows]


def answered(case: Case, solve: Callable[[Case], Trajectory]) -> np.ndarray:
    """Pull-off force, hysteresis and force at the measurement steps, of shape (122,); NaN if it did not complete."""
    trajectory = solve(case)
    if not trajectory.completed:
        return np.full(122, np.nan)
    return np.concatenate([[trajectory.pull_off_force, trajectory.hysteresis], case.force_history(trajectory)])


def solver_at(target: str | float) -> Callable[[Case], np.ndarray]:
    """The solver at one accuracy."""
    return lambda case: answered(case, lambda asked: asked.run(target))
