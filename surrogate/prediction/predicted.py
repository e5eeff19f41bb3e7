"""Predicted trajectories, with the interface of simulated ones; units as in `bem.protocol`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bem._support.tabular import Column
from bem.trajectory import Statistics, Trajectory, far_field

FORCE_DOUBT = 0.05
"""Error of a predicted force at the end of a protocol, in pi R dgamma; it is smaller for 90 % of the test set."""
INTERVALS = ("pull_off_interval", "pull_off_time_interval", "hysteresis_interval")
"""Fields of a prediction with bands."""


@dataclass(frozen=True, repr=False)
class PredictedTrajectory(Trajectory):
    """A `bem.Trajectory` that a surrogate predicted at measurement steps.

    Pull-off force and pull-off time are those of the largest force at the steps of unloading, so the force of a peak
    that is narrower than a step is too small (`docs/dataset.md` says by how much). The hysteresis is the loop area at
    those steps by the trapezoidal rule, as in `surrogate.data.metrics`; a simulated trajectory integrates an
    interpolation instead. A surrogate predicts no contact radius (all NaN), no jumps, and no error of its own
    (`accuracy` is NaN). Of `stats`, only the seconds are set. `detached` is inferred from the force alone.

    Of a model with bands, pull-off force and time are those of a parabola through the highest step of the unloading and
    its neighbours, and the hysteresis is that of monotone cubics through the steps. Outside the ranges of the training,
    which `extrapolated` names, every band is infinite.
    """

    extrapolated: tuple[str, ...] = ()
    """The quantities outside the ranges of the training set, as text; empty if there are none."""
    model: str = ""
    """Name of the model."""
    modulus_ratio: float | None = None
    """Modulus ratio of the solid, of a model with bands."""
    coverage: float | None = None
    """Share of true values that the bands are made to contain."""
    pull_off_interval: tuple[float, float] | None = None
    """Low and high of the pull-off force; the next two are those of its time and of the hysteresis."""
    pull_off_time_interval: tuple[float, float] | None = None
    hysteresis_interval: tuple[float, float] | None = None
    force_lower: np.ndarray | None = None
    force_upper: np.ndarray | None = None
    """Band of the force at each step by itself, shape (steps,)."""
    curve_lower: np.ndarray | None = None
    curve_upper: np.ndarray | None = None
    """Band that holds the force at all steps at once, likewise."""
    readings: tuple[float, float, float] | None = None
    """Pull-off force, its time, and the work, where they are not those of the steps alone."""

    @property
    def pull_off_force(self) -> float:
        """Largest force while unloading, tension positive."""
        return super().pull_off_force if self.readings is None else self.readings[0]

    @property
    def pull_off_time(self) -> float:
        """Time of the pull-off force."""
        return super().pull_off_time if self.readings is None else self.readings[1]

    @property
    def detached(self) -> bool:
        """Whether the surfaces have separated by the end; False if the prediction is not finite.

        The last force is compared with the far-field attraction (`bem.trajectory.far_field`), with a tolerance of
        `FORCE_DOUBT`. Close to that limit the answer may be wrong.
        """
        return self.completed and bool(far_field(self.force[-1], self.indentation[-1], doubt=FORCE_DOUBT))

    def work(self) -> float:
        """Return the integral of -P d(delta) over the history."""
        if self.readings is not None:
            return self.readings[2]
        # NumPy 2.0 has `trapezoid`; its type stubs do not.
        return -float(np.trapezoid(self.force, self.indentation))  # type: ignore[attr-defined, unused-ignore]

    def columns(self) -> dict[str, Column]:
        """Return the columns of `to_dataframe` and `to_xarray` with their units, without the contact radius."""
        return {name: column for name, column in super().columns().items() if name != "contact_radius"}

    def facts(self) -> dict[str, str]:
        """Return model, status, number of points and results as text, by name."""
        outside = {"outside the training": ", ".join(self.extrapolated)} if self.extrapolated else {}
        return {"model": self.model} | super().facts() | outside

    def summary(self) -> dict[str, Any]:
        """Return the scalars by name, ready for JSON; intervals of a model with bands only where finite."""
        names = ("pull_off_force", "pull_off_time", "max_compression", "hysteresis", "end_force", "detached")
        scalars = {name: getattr(self, name) for name in names} | {"work": self.work()}
        found = {"model": self.model, "status": self.status, **scalars, "extrapolated": list(self.extrapolated)}
        if self.pull_off_interval is None:
            return found
        intervals = {name: list(getattr(self, name)) for name in INTERVALS}
        within = {} if self.extrapolated else intervals
        return found | {"modulus_ratio": self.modulus_ratio, "coverage": self.coverage} | within


def predicted_trajectory(
    times: np.ndarray,
    indentations: np.ndarray,
    force: np.ndarray,
    *,
    unloading_from: int,
    extrapolated: tuple[str, ...],
    model: str,
    seconds: float,
    **bands: Any,
) -> PredictedTrajectory:
    """Return the trajectory of one predicted history.

    Args:
        times: Times of shape `(steps,)`.
        indentations: Indentations of the same shape.
        force: Forces of the same shape.
        unloading_from: Index of the first point of unloading.
        extrapolated: The quantities outside the ranges of the training set, as text.
        model: Name of the model.
        seconds: Wall-clock time of the prediction, in seconds.
        **bands: Further fields, of a model with bands.

    Returns:
        The trajectory, with the interface of `bem.Trajectory`.
    """
    return PredictedTrajectory(
        time=times,
        indentation=indentations,
        force=force,
        contact_radius=np.full(len(times), np.nan),
        status="completed" if np.isfinite(force).all() else "the prediction is not finite",
        jumps=(),
        stats=Statistics(seconds=seconds),
        accuracy=float("nan"),
        unloading=np.arange(len(times)) >= unloading_from,
        extrapolated=extrapolated,
        model=model,
        **bands,
    )
