"""A predicted force history with the interface of a simulated one, so that the same code can use both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bem._support.tabular import Column
from bem.trajectory import Statistics, Trajectory, far_field

FORCE_DOUBT = 0.05
"""Typical error of a predicted force at the end of a protocol, in pi R dgamma: smaller for 90 % of the test set."""


@dataclass(frozen=True, repr=False)
class PredictedTrajectory(Trajectory):
    """A `bem.Trajectory` that a surrogate predicted on measurement steps.

    Pull-off force and time are the largest force on those steps while unloading, so a peak narrower than a step is
    understated (`docs/dataset.md` says by how much). The hysteresis is the paper's too, the loop area on those steps by
    the trapezoidal rule as in `surrogate.data.metrics`, not along an interpolation as a simulated trajectory's. A
    surrogate knows no contact radius (all NaN), no jumps, and no error of its own (`accuracy` is NaN); of the
    statistics only the seconds mean anything. `detached` is inferred from the force alone.
    """

    extrapolated: tuple[str, ...] = ()
    """What lies outside the ranges of the training, in words; empty for a prediction inside them."""
    model: str = ""
    """Name of the model that predicted it."""

    @property
    def detached(self) -> bool:
        """Whether the surfaces have separated by the end; False when unfinished.

        A surrogate knows no contact edge: the force alone decides, against the far-field attraction
        (`bem.trajectory.far_field`) with room for the error of a prediction. Close to that limit it may be wrong.
        """
        return self.completed and bool(far_field(self.force[-1], self.indentation[-1], doubt=FORCE_DOUBT))

    def work(self) -> float:
        """Integral of -P d(delta) over the measurement steps by the trapezoidal rule."""
        # NumPy 2.0 has it, and the stubs of 2.0 do not.
        return -float(np.trapezoid(self.force, self.indentation))  # type: ignore[attr-defined, unused-ignore]

    def columns(self) -> dict[str, Column]:
        """The columns of `to_dataframe` and `to_xarray`, with their units; without a contact radius."""
        return {name: column for name, column in super().columns().items() if name != "contact_radius"}

    def facts(self) -> dict[str, str]:
        """Model, status, number of points and results, as texts."""
        outside = {"outside the training": ", ".join(self.extrapolated)} if self.extrapolated else {}
        return {"model": self.model} | super().facts() | outside

    def summary(self) -> dict[str, Any]:
        """Return the scalars, ready for JSON."""
        names = ("pull_off_force", "pull_off_time", "max_compression", "hysteresis", "end_force", "detached")
        scalars = {name: getattr(self, name) for name in names} | {"work": self.work()}
        return {"model": self.model, "status": self.status, **scalars, "extrapolated": list(self.extrapolated)}


def predicted_trajectory(
    times: np.ndarray,
    indentations: np.ndarray,
    force: np.ndarray,
    *,
    unloading_from: int,
    extrapolated: tuple[str, ...],
    model: str,
    seconds: float,
) -> PredictedTrajectory:
    """Wrap one predicted history.

    Args:
        times: Times of shape `(steps,)`.
        indentations: Indentations of the same shape.
        force: Forces of the same shape.
        unloading_from: Index of the first point that belongs to unloading.
        extrapolated: What lies outside the ranges, in words.
        model: Name of the model.
        seconds: What the prediction took.
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
    )
