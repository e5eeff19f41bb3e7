"""Where a measured force jumps, and when a model's does: an instability falls between two samples.

How far a model's jump is from the measured one is a smooth function of the parameters; the forces between the two are
not. A fit therefore compares the instants, and leaves out the points that lie before one jump and after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label, maximum_filter1d, median_filter

from bem._support.validation import FloatArray
from bem.lab.contact_point import noise_of
from bem.lab.curve import ForceCurve

_AROUND, _ABOVE = 11, 3.0  # points around a change of the force, and how many times theirs a jump is
_NOISES = 5.0  # times the noise that a jump changes the force by, per sample
_UNSURE = 5  # points around a jump that say little of the force
_FAR = 30.0  # standard deviations of an instant, beyond which it counts as its logarithm


@dataclass(frozen=True)
class MeasuredJump:
    """A change of the tension between two samples that stands out of noise and neighbours."""

    time: float
    """Midway between the samples, in s."""
    level: float
    """Tension midway between theirs, in N."""
    rises: bool
    deviation: float
    """Standard deviation of the instant, in s: that of a uniform distribution between the samples."""


def weights_of(curve: ForceCurve, noise: float) -> FloatArray:
    """One over the uncertainty of each point: the noise, and around a jump what the force does between samples.

    A jump is a change above the noise that is several times those around it: a force that is merely steep is none.
    """
    scale, change, steep = _changes(curve, noise)
    return 1.0 / np.hypot(scale, 2.0 * maximum_filter1d(np.where(steep, change, 0.0), _UNSURE))


def measured_jumps(curve: ForceCurve, noise: float) -> tuple[MeasuredJump, ...]:
    """The jumps of a curve; `noise` is the standard deviation of its force, in N."""
    places, count = label(_changes(curve, noise)[2])
    found = []
    for jump in range(1, count + 1):
        inside = np.flatnonzero(places == jump)
        first = max(int(inside[0]) - 1, 0)
        steps = np.diff(curve.tension[first : int(inside[-1]) + 2])
        at = first + int(np.argmax(np.abs(steps)))
        sample = float(curve.time[at + 1] - curve.time[at])
        if sample > 0.0:
            level = 0.5 * float(curve.tension[at] + curve.tension[at + 1])
            rises = bool(curve.tension[at + 1] > curve.tension[at])
            found.append(MeasuredJump(float(curve.time[at]) + 0.5 * sample, level, rises, sample / np.sqrt(12.0)))
    return tuple(found)


def instants_of(jumps: Sequence[MeasuredJump], time: FloatArray, tension: FloatArray) -> FloatArray:
    """When a model passes the levels of measured jumps in their direction, in s, shape (jumps,).

    Of several passages the nearest counts; NaN stands for none.

    Args:
        jumps: those of the curve.
        time: instants of the model, (n,) in s; two are equal where it jumps.
        tension: there, (n,) in N.
    """
    found = np.full(len(jumps), np.nan)
    for i, jump in enumerate(jumps):
        above = tension > jump.level
        passed = np.flatnonzero((above[1:] != above[:-1]) & (above[1:] == jump.rises))
        if passed.size:
            share = (jump.level - tension[passed]) / (tension[passed + 1] - tension[passed])
            instants = time[passed] + share * (time[passed + 1] - time[passed])
            found[i] = instants[np.argmin(np.abs(instants - jump.time))]
    return found


def lateness(jumps: Sequence[MeasuredJump], instants: FloatArray, least: float, duration: float) -> FloatArray:
    """How late the model jumps, in standard deviations of the instant, shape (jumps,).

    Args:
        jumps: those of the curve.
        instants: of the model; NaN counts as late by `duration`.
        least: smallest standard deviation, in s.
        duration: of the curve, in s.
    """
    deviations = np.hypot([jump.deviation for jump in jumps], least)
    return np.where(np.isnan(instants), duration, instants - [jump.time for jump in jumps]) / deviations


def as_residuals(late: FloatArray) -> FloatArray:
    """Residuals of `lateness`; large ones count as their logarithm, so that the forces lead a search from far away."""
    return _FAR * np.arcsinh(late / _FAR)


def shares_between(
    jumps: Sequence[MeasuredJump], instants: FloatArray, late: FloatArray, time: FloatArray, sample: float
) -> FloatArray:
    """By what factor the residuals of the points count, (n,): 1 except between a measured jump and the model's.

    There the forces say nothing once the two are close; from far away they lead the search, and count whole.
    """
    shares = np.ones(time.size)
    for jump, instant, away in zip(jumps, instants, late, strict=True):
        if np.isfinite(instant):
            first, last = sorted((jump.time, float(instant)))
            inside = (time > first - 0.5 * sample) & (time < last + 0.5 * sample)
            shares[inside] *= away**2 / (_FAR**2 + away**2)
    return shares


def _changes(curve: ForceCurve, noise: float) -> tuple[float, FloatArray, np.ndarray]:
    """The noise, the change of the force per sample (n,), and where it is that of a jump (n,) bool."""
    scale = max(noise, noise_of(curve.tension), 1e-4 * float(np.ptp(curve.tension)))
    change = np.abs(np.gradient(curve.tension))
    usual = median_filter(change, _AROUND, mode="nearest")
    return scale, change, change > np.maximum(_NOISES * scale, _ABOVE * usual)
