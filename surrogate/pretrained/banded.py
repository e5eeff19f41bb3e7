"""Predicted trajectories with bands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from surrogate.inference.predicted import PredictedTrajectory


@dataclass(frozen=True, repr=False)
class BandedTrajectory(PredictedTrajectory):
    """A predicted trajectory with bands.

    Pull-off force and time are those of a parabola through the highest step of the unloading and its neighbours, the
    hysteresis is that of monotone cubics through the steps. Outside the ranges of the training, which `extrapolated`
    names, every band is infinite.
    """

    modulus_ratio: float = np.nan
    coverage: float = np.nan
    """Share of true values that the bands are made to contain."""
    pull_off_interval: tuple[float, float] = (-np.inf, np.inf)
    """Band of the pull-off force: low, high."""
    force_lower: np.ndarray | None = None
    force_upper: np.ndarray | None = None
    """Band of the force at each step by itself, shape (steps,)."""
    results: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    """Pull-off force, its time, and the work."""

    @property
    def pull_off_force(self) -> float:
        """Largest force while unloading, tension positive."""
        return self.results[0]

    @property
    def pull_off_time(self) -> float:
        """Time of the pull-off force."""
        return self.results[1]

    def work(self) -> float:
        """Integral of -P d(delta) over the history."""
        return self.results[2]

    def summary(self) -> dict[str, Any]:
        """Return the scalars, ready for JSON; without the interval where it is infinite."""
        within = {} if self.extrapolated else {"pull_off_interval": list(self.pull_off_interval)}
        return super().summary() | {"modulus_ratio": self.modulus_ratio, "coverage": self.coverage} | within


def without_bands(trajectory: BandedTrajectory, words: tuple[str, ...]) -> BandedTrajectory:
    """Return a trajectory outside the training, which the words name: its bands are infinite."""
    far = np.full(trajectory.force.size, np.inf)
    changed = {"extrapolated": words, "pull_off_interval": (-np.inf, np.inf), "force_lower": -far, "force_upper": far}
    return type(trajectory)(**{**vars(trajectory), **changed})
