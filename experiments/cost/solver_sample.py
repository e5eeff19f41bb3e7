"""The sample of protocols on which the solver is judged, and a solution of each refined until it stops moving.

The refined solutions ("truth") take minutes, so they are kept in `results/` and computed again only for another sample
or another solver. They are converged, not exact: two refinements, each with all discretisation errors several times
below `reference`, and the difference of the two is reported with them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from bem import LoadingProtocol, Scene, StandardLinearSolid, Trajectory, simulate
from bem.dataset.designs import Design
from bem.dataset.measurement_steps import measurement_times
from bem.solver.version import SOLVER_VERSION
from experiments.timing import fingerprint, progress

MODULUS_RATIO = 0.1
TRUTH_TARGET = 7e-5
CHECK_TARGET = 1.5e-4
RESULTS = Path("results/solver")
QUANTITIES = ("pull_off_force", "hysteresis", "force")


@dataclass(frozen=True)
class Case:
    """One scene and protocol of the sample."""

    scene: Scene
    protocol: LoadingProtocol

    def run(self, accuracy: str | float) -> Trajectory:
        """Simulate it."""
        return simulate(self.scene, self.protocol, accuracy)

    def force_history(self, trajectory: Trajectory) -> np.ndarray:
        """Force at the 120 fixed measurement steps."""
        return trajectory.at(np.minimum(measurement_times(self.protocol, self.scene.tabor), trajectory.time[-1]))


def sample_cases(count: int, seed: int) -> list[Case]:
    """Random protocols of the paper's design."""
    drawn = Design("paper").protocols(count, seed)
    return [
        Case(
            Scene(tabor=drawn["tabor"][i], material=StandardLinearSolid(MODULUS_RATIO)),
            LoadingProtocol(
                peak_indentation=drawn["peak_indentation"][i],
                loading_rate=drawn["loading_rate"][i],
                dwell_time=drawn["dwell_time"][i],
                unloading_rate=drawn["unloading_rate"][i],
            ),
        )
        for i in range(count)
    ]


def measured(case: Case, accuracy: str | float) -> np.ndarray:
    """Pull-off force, hysteresis, seconds and the force at 120 instants, (123,); NaN where not completed."""
    trajectory = case.run(accuracy)
    if not trajectory.completed:
        return np.full(123, np.nan)
    scalars = [trajectory.pull_off_force, trajectory.hysteresis, trajectory.stats.seconds]
    return np.concatenate([scalars, case.force_history(trajectory)])


def truth(count: int, seed: int, target: float = TRUTH_TARGET, jobs: int = 2) -> np.ndarray:
    """Refined solutions of the sample, (count, 123) as `measured`; computed once and kept in `results/`."""
    path = RESULTS / f"truth-{fingerprint(solver=SOLVER_VERSION, count=count, seed=seed, target=target)}.npy"
    if path.exists():
        return np.load(path)
    cases = sample_cases(count, seed)
    rows = Parallel(n_jobs=jobs, return_as="generator")(delayed(measured)(case, target) for case in cases)
    table = np.array(list(progress(rows, f"refined solutions at {target:g}", count)))
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, table)
    return table


def relative_errors(rows: np.ndarray, exact: np.ndarray) -> dict[str, np.ndarray]:
    """Relative errors of pull-off force, hysteresis and force history (sum |dP| / sum |P|), each (count,)."""
    history = np.sum(np.abs(rows[:, 3:] - exact[:, 3:]), axis=1) / np.sum(np.abs(exact[:, 3:]), axis=1)
    scalars = np.abs(rows[:, :2] / exact[:, :2] - 1.0)
    return dict(zip(QUANTITIES, (scalars[:, 0], scalars[:, 1], history), strict=True))
