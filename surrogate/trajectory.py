"""Predicted trajectories, with the interface of simulated ones; units as in `bem.problem.protocol`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from bem._support.tabular import Column
from bem.results.trajectory import Statistics, Trajectory, far_field

FORCE_DOUBT = 0.05
"""Error of a predicted force at the end of a protocol, in pi R dgamma; it is smaller for 90 % of the test set."""
INTERVALS = ("pull_off_interval", "pull_off_time_interval", "hysteresis_interval")
"""Fields of a prediction with intervals."""
_BANDS = 4  # half-widths before those of the bands


class Doubt(NamedTuple):
    """What a model with intervals says of one trajectory beside its forces; intervals are computed when they are read.

    The band of the force is one of its inverse hyperbolic sine, in units that may change from step to step: absolute
    where the force is small beside its unit, relative where it is large.
    """

    coverage: float
    readings: Sequence[float]
    """Pull-off force, its time, hysteresis and largest compression, which have outputs of their own."""
    half_widths: Sequence[float]
    """Of the logarithms of pull-off force and pull-off time since the dwell, of the hysteresis and of the largest
    compression, and, as multiples of `shape`, of the force at each step by itself and at all steps at once."""
    shape: np.ndarray
    """Shape (steps,)."""
    units: np.ndarray
    """Of the force, shape (steps,)."""


@dataclass(frozen=True, repr=False)
class PredictedTrajectory(Trajectory):
    """A `bem.Trajectory` that a surrogate predicted at measurement steps.

    Pull-off force and pull-off time are those of the largest force at the steps of unloading, so the force of a peak
    that is narrower than a step is too small (`docs/dataset.md` says by how much). The hysteresis is the loop area at
    those steps by the trapezoidal rule, as in `surrogate.data.metrics`; a simulated trajectory integrates an
    interpolation instead. A surrogate predicts no contact radius (all NaN), no jumps, and no error of its own
    (`accuracy` is NaN). Of `stats`, only the seconds are set. `detached` is inferred from the force alone.

    Of a model of any linear solid, the scalar results come from outputs of their own, with which the curve agrees.
    Outside the training, which `extrapolated` names, every interval and band is infinite; far outside, all results and
    bands are NaN. Of a model of the paper, intervals and bands are `None`.
    """

    extrapolated: tuple[str, ...] = ()
    """What lies outside the training, as text; empty if nothing does."""
    model: str = ""
    """Name of the model."""
    doubt: Doubt | None = None
    """From what results, intervals and bands are computed; `None` of a model of the paper."""

    @property
    def pull_off_force(self) -> float:
        """Largest force while unloading, tension positive."""
        return super().pull_off_force if self.doubt is None or not self.completed else float(self.doubt.readings[0])

    @property
    def pull_off_time(self) -> float:
        """Time of the pull-off force."""
        return super().pull_off_time if self.doubt is None or not self.completed else float(self.doubt.readings[1])

    @property
    def max_compression(self) -> float:
        """Smallest force: largest compression, negative."""
        return super().max_compression if self.doubt is None or not self.completed else float(self.doubt.readings[3])

    @property
    def coverage(self) -> float | None:
        """Share of true values that intervals and bands are made to contain."""
        return self.doubt and self.doubt.coverage

    @property
    def pull_off_interval(self) -> tuple[float, float] | None:
        """Low and high of the pull-off force."""
        return self._interval(0, lambda width: self.pull_off_force * np.exp(width))

    @property
    def pull_off_time_interval(self) -> tuple[float, float] | None:
        """Low and high of its time."""
        begin = self.time[self.unloading.argmax()]
        return self._interval(1, lambda width: begin + (self.pull_off_time - begin) * np.exp(width))

    @property
    def hysteresis_interval(self) -> tuple[float, float] | None:
        """Low and high of the hysteresis."""
        return self._interval(2, lambda width: max(self.hysteresis + width, 0.0))

    def _interval(self, row: int, end: Callable[[float], float]) -> tuple[float, float] | None:
        if self.doubt is None:
            return None
        if not self.completed:
            return (np.nan, np.nan)
        width = self.doubt.half_widths[row]
        return (-np.inf, np.inf) if self.extrapolated else (float(end(-width)), float(end(width)))

    @property
    def force_lower(self) -> np.ndarray | None:
        """Lower end of the band of the force at each step by itself, shape (steps,)."""
        return self._band(0, -1.0)

    @property
    def force_upper(self) -> np.ndarray | None:
        """Upper end likewise."""
        return self._band(0, 1.0)

    @property
    def curve_lower(self) -> np.ndarray | None:
        """Lower end of the band that holds the force at all steps at once, shape (steps,)."""
        return self._band(1, -1.0)

    @property
    def curve_upper(self) -> np.ndarray | None:
        """Upper end likewise."""
        return self._band(1, 1.0)

    def _band(self, row: int, sign: float) -> np.ndarray | None:
        if self.doubt is None:
            return None
        if self.extrapolated:
            return np.full(len(self.force), sign * np.inf if self.completed else np.nan)
        units, width = self.doubt.units, self.doubt.half_widths[_BANDS + row] * self.doubt.shape
        return units * np.sinh(np.arcsinh(self.force / units) + sign * width)

    @property
    def detached(self) -> bool:
        """Whether the surfaces have separated by the end; False if the prediction is not finite.

        The last force is compared with the far-field attraction (`bem.results.trajectory.far_field`), with a tolerance
        of `FORCE_DOUBT`. Close to that limit the answer may be wrong.
        """
        return self.completed and bool(far_field(self.force[-1], self.indentation[-1], doubt=FORCE_DOUBT))

    def work(self) -> float:
        """Return the integral of -P d(delta) over the history."""
        if self.doubt is not None and self.completed:
            return float(self.doubt.readings[2])
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
        """Return the scalars by name, ready for JSON; intervals only where finite."""
        names = ("pull_off_force", "pull_off_time", "max_compression", "hysteresis", "end_force", "detached")
        scalars = {name: getattr(self, name) for name in names} | {"work": self.work()}
        entries = {"model": self.model, "status": self.status, **scalars, "extrapolated": list(self.extrapolated)}
        if self.pull_off_interval is None:
            return entries
        intervals = {name: list(getattr(self, name)) for name in INTERVALS}
        within = {} if self.extrapolated else intervals
        return entries | {"coverage": self.coverage} | within


def predicted_trajectories(
    times: np.ndarray,
    indentations: np.ndarray,
    force: np.ndarray,
    *,
    unloading_from: int,
    seconds: float,
    extrapolated: Sequence[tuple[str, ...]] = (),
    model: str = "",
    doubts: Sequence[Doubt | None] = (),
    refusals: Sequence[str] = (),
) -> list[PredictedTrajectory]:
    """Return the trajectories of predicted histories.

    Args:
        times, indentations, force: The histories, each of shape `(batch, steps)`.
        unloading_from: Index of the first point of unloading.
        seconds: Wall-clock time of one prediction, in seconds.
        extrapolated, doubts: Fields of `PredictedTrajectory`, one for each or none at all.
        refusals: Why each is refused, `""` if it is not; all results of one that is are NaN.
        model: Name of the model.

    Returns:
        One trajectory for each history, with the interface of `bem.Trajectory`.
    """
    steps = times.shape[1]
    radius, unloading = np.full(steps, np.nan), np.arange(steps) >= unloading_from
    refusals = refusals or [""] * len(force)
    if any(refusals):
        force = np.where([[bool(reason)] for reason in refusals], np.nan, force)
    finite = np.isfinite(force).all(axis=1).tolist()
    statuses = [
        reason or ("completed" if sound else "the prediction is not finite")
        for sound, reason in zip(finite, refusals, strict=True)
    ]
    more = zip(statuses, extrapolated or [()] * len(force), doubts or [None] * len(force), strict=True)
    return [
        PredictedTrajectory(
            time=time,
            indentation=indentation,
            force=values,
            contact_radius=radius.copy(),
            status=status,
            jumps=(),
            stats=Statistics(seconds=seconds),
            accuracy=math.nan,
            unloading=unloading.copy(),
            extrapolated=outside,
            model=model,
            doubt=doubt,
        )
        for time, indentation, values, (status, outside, doubt) in zip(times, indentations, force, more, strict=True)
    ]
