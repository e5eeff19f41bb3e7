"""A measured curve as a fit sees it, averaged, with its noise and the points that count; and first guesses from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from scipy.fft import idct
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from bem._support.validation import FloatArray
from bem.lab.contact_point import FEWEST, STANDS_OUT, noise_of
from bem.lab.curve import ForceCurve
from bem.lab.models import Path
from bem.lab.models.contact import Jump
from bem.lab.segments import Segments, segments_of
from bem.lab.setup import Setup
from bem.lab.units import Quantity
from bem.methods.closed_forms import jkr

Segment = Literal["both", "approach", "retract"]

_MOST = 500  # points that a longer segment is averaged to
_FAR = 0.5  # of the baseline, where attraction does not bend it yet
_STEPS, _BESIDE = 6.5, 2.0  # times the noise, and times the changes beside it, that a jump changes the force by
_EXACT = 3e-5  # of the range of the force, below which the error of a model may be
_ORDER = 2  # of the autoregressive model of residuals: that of the motion of a cantilever in a fluid
_SLOWEST = 16  # cosines: more see less of noise that grows towards low frequencies, fewer widen every interval
_PLACES = 80  # of the contact point that are tried
_OWN = 0.02  # of the time out of contact, that neither place nor speed explains, for a drift to show


@dataclass(frozen=True, eq=False)
class Measurement(Path):
    """An averaged curve of n points along its path, in SI, positive in tension."""

    tension: FloatArray
    weights: FloatArray
    """Inverse of the noise of each point, in units of `noise`; zero for one that does not count, shape (n,)."""
    baseline: float
    """Tension before contact, in N; zero for a curve that begins in contact."""
    noise: float
    """Standard deviation of one measured point on the baseline, in N."""
    correlated: float
    """Variance of a sum of points of the baseline over that of independent ones, at least 1."""
    freedoms: float
    """Independent points that `correlated` rests on."""
    whitener: FloatArray
    """Weights of a residual and those before it whose sum is independent noise of variance 1, by the baseline."""
    quiet: int
    """Independent points that `noise` and `whitener` rest on."""
    first: int
    """The first point after the baseline."""
    segments: Segments
    columns: dict[str, FloatArray]
    """What enters linearly: force_offset (1), tilt (path, m), drag (minus speed, m/s), drift (time, s), each (n,)."""
    jumps: tuple[Jump, ...]
    """Of the force, into and out of contact."""

    @property
    def range(self) -> float:
        """Range of the tension, in units of the noise."""
        return float(np.ptp(self.tension)) / self.noise

    @property
    def exact(self) -> float:
        """Error of a model that counts as none, in units of the noise: below it, no model is better than another."""
        return _EXACT * self.range

    @property
    def depth(self) -> FloatArray:
        """Indentation from the place of first contact on, in m, with the spring's deflection taken off."""
        indentation = self.position + (self.tension - self.baseline) * self.compliance
        return indentation - indentation[self.first]

    @property
    def one_way(self) -> bool:
        """Whether no point of the retraction counts: adhesion and relaxation bend an approach alike."""
        return not self.weights[self.segments.leaves + 2 :].any()

    @cached_property
    def far(self) -> np.ndarray:
        """Which points are surely out of contact: the far half of both baselines, where no neck reaches, shape (n,)."""
        far = self.position < 0.5 * (self.position[0] + self.position[self.first])
        for jump in self.jumps:
            far &= ~((self.time >= self.time[self.first]) & (self.time < jump.time))
        after = np.arange(far.size) > self.segments.leaves
        if self._rise(far & after) - abs(self._rise(far & ~after)) > STANDS_OUT * self.noise:
            far &= ~after  # a neck that stretches to the end
        return far

    def _rise(self, chosen: np.ndarray) -> float:
        """By how much the tension is larger in the last quarter of some points than in the first, in N."""
        tension = self.tension[chosen]
        quarter = tension.size // 4
        return float(tension[-quarter:].mean() - tension[:quarter].mean()) if quarter else 0.0

    @cached_property
    def linear(self) -> tuple[str, ...]:
        """Columns that are always fitted: offset and tilt, drag and drift where both baselines tell them apart."""
        if self.first < FEWEST:
            return ()
        names = ["force_offset"]
        for name in ("tilt", "drag", "drift"):
            counted = (self.weights > 0.0) & (self.far if name == "drift" else True)
            columns = np.column_stack([self.columns[column][counted] for column in (name, *names)])
            columns /= np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
            own = columns[:, 0] - columns[:, 1:] @ np.linalg.lstsq(columns[:, 1:], columns[:, 0], rcond=1e-9)[0]
            if columns[:, 0].size > FEWEST and np.linalg.norm(own) > (_OWN if name == "drift" else 1e-6):
                names.append(name)
        return tuple(names)

    @property
    def duration(self) -> float:
        """From first contact to the end, in s."""
        return float(self.time[-1] - self.time[self.first])


def measurement_of(curve: ForceCurve, setup: Setup, segment: Segment = "both") -> Measurement:
    """Prepare a curve.

    Args:
        curve: the measurement.
        setup: with its spring, the stage was moved; without one, the sphere.
        segment: which points count.

    Raises:
        ValueError: a curve without contact, or of several cycles.
    """
    contact = curve.contact()
    if not curve.time[-1] > curve.time[min(contact.index, len(curve) - 1)]:
        raise ValueError(f"time must increase after contact; received {curve.time[-1]:g} s to the end")
    position, index = prescribed_path(curve, setup), contact.index
    shaken = noise_of(position)  # noise of the path, which the contact turns into force
    parts = segments_of(curve.time, position, -curve.tension, index)
    starts = _bins(curve.time, parts)
    counts = np.diff(np.append(starts, len(curve)))
    time, position, tension = (
        np.add.reduceat(values, starts) / counts for values in (curve.time, position, curve.tension)
    )
    first, top, leaves = (int(np.searchsorted(starts, n, "right")) - 1 for n in (index, parts.top, parts.leaves))
    averaged = Segments(top, leaves, parts.held, parts.pauses)
    number, first = np.arange(time.size), max(first, 2)
    counted = {"both": number >= 0, "approach": number <= top, "retract": number >= leaves}[segment]
    once = np.maximum.accumulate(time + 1e-12 * np.ptp(time) * number)
    columns = {"force_offset": np.ones(time.size), "tilt": position - position[first]}
    columns |= {"drag": -np.gradient(position, once), "drift": time - time[first]}
    quiet, whitener = int(_FAR * first), np.ones(1)
    noise, correlated, freedoms = noise_of(curve.tension), 1.0, float(len(curve))
    if not (index >= FEWEST and quiet > 8):
        quiet = len(curve)
    else:
        line = np.column_stack([np.ones(quiet), position[:quiet] - position[0]][: 1 + (quiet > 16)])
        scatter = np.sqrt(counts[:quiet]) * (
            tension[:quiet] - line @ np.linalg.lstsq(line, tension[:quiet], rcond=1e-9)[0]
        )
        noise, freedoms = float(np.std(scatter)), float(max(quiet - 2, 1))
        if quiet > 2 * _SLOWEST:
            basis = np.linalg.qr(np.vander(np.arange(quiet) / quiet, 2))[0]
            slow, freedoms = slow_noise(scatter, basis)
            correlated = max(slow / max(noise**2, 1e-300), 1.0)
            whitener = whitening(scatter)
            whitener *= noise / max(float(np.std(lfilter(whitener, 1.0, scatter)[_ORDER:])), 1e-300)
    noise = max(noise, _EXACT * float(np.ptp(tension)) * float(np.sqrt(np.median(counts))), 1e-300)
    baseline = contact.force_offset if curve.force_sign == "tension" else -contact.force_offset
    jumps = _jumps(time, tension, top, leaves, baseline)
    # A mean over a jump is neither force; the points on either side of it do not count.
    for jump in jumps:
        counted &= ~(np.abs(number - np.searchsorted(time, jump.time) + 0.5) < 1.1)
    pressed, depth = np.maximum(baseline - tension, 0.0), np.maximum(position - position[first], 0.0)
    slope = 1.5 * pressed / np.maximum(depth, 0.02 * float(depth.max()) + 1e-300)
    counted = counted / np.hypot(1.0, slope * shaken / noise)
    return Measurement(
        time, position, setup, tension, counted * np.sqrt(counts), baseline, noise, correlated, freedoms, whitener,
        quiet, first, averaged, columns, jumps,
    )  # fmt: skip


def _bins(time: FloatArray, parts: Segments) -> np.ndarray:
    """First points of the bins that a curve is averaged in: even in each ramp, and short at the beginning of a hold."""
    starts, turn, leaves = [np.zeros(1, dtype=int)], parts.top + 1, max(parts.leaves, parts.top + 1)
    for begin, end, held in ((0, turn, False), (turn, leaves, parts.held is not None), (leaves, time.size, False)):
        size, shares = end - begin, np.linspace(0.0, 1.0, _MOST + 1)[:-1] ** (2 if held else 1)
        starts.append(begin + ((size * shares).astype(int) if size > _MOST else np.arange(size)))
    return np.unique(np.concatenate(starts))


def whitening(residuals: FloatArray) -> FloatArray:
    """Weights of a residual and the `_ORDER` before it whose sum is nearly independent, by Yule and Walker."""
    centred = residuals - residuals.mean()
    covariance = np.array([centred[: centred.size - k] @ centred[k:] for k in range(_ORDER + 1)])
    covariance[0] += 1e-9 * covariance[0] + 1e-300
    return np.append(1.0, -solve_toeplitz(covariance[:-1], covariance[1:]))


def slow_noise(residuals: FloatArray, basis: FloatArray) -> tuple[float, float]:
    """Variance of independent noise as strong as this at the lowest frequencies, where parameters act, and its degrees.

    The mean square of `_SLOWEST` cosines over the whitened residuals (n,) (Mueller, J. Econometrics 141 (2007) 1331),
    after what a fit by orthonormal columns `basis` (n, m) has taken up of them is given back.
    """
    weights = whitening(residuals)
    cosines = idct(np.eye(residuals.size, _SLOWEST, -1), axis=0, norm="ortho")
    sums = cosines.T @ lfilter(weights, 1.0, residuals)
    left = lfilter(weights, 1.0, cosines[::-1], axis=0)[::-1]
    left = lfilter([1.0], weights, (left - basis @ (basis.T @ left))[::-1], axis=0)
    expected = left.T @ left
    share = max(float(np.trace(expected)), 1e-9)
    return float(sums @ sums) / share / max(weights.sum(), 0.01) ** 2, share**2 / max(np.sum(expected**2), 1e-18)


def prescribed_path(curve: ForceCurve, setup: Setup) -> FloatArray:
    """What the instrument moved at each point of a curve, in m: the sphere, or the stage behind the setup's spring.

    A curve without a stage gives it as indentation plus compression over stiffness.
    """
    if setup.stiffness is None:
        return curve.indentation
    return curve.indentation - curve.tension / setup.stiffness if curve.stage is None else curve.stage


def _jumps(time: FloatArray, tension: FloatArray, top: int, leaves: int, baseline: float) -> tuple[Jump, ...]:
    """The largest rise of the approach and the largest fall of the retraction, where they stand out."""
    jumps, noise = [], noise_of(tension)
    for out, begin, end in ((False, 0, top), (True, leaves, time.size - 1)):
        steps = np.diff(tension[begin : end + 1]) * (-1.0 if out else 1.0)
        if steps.size < 5:
            continue
        at = int(np.argmax(steps))
        beside = np.abs(np.concatenate([steps[max(at - 4, 0) : max(at - 1, 0)], steps[at + 2 : at + 5]]))
        if steps[at] > _STEPS * noise and steps[at] > _BESIDE * beside.max(initial=0.0):
            sides = slice(begin + at, begin + at + 2)
            jumps.append(Jump(float(time[sides].mean()), float(tension[sides].mean()) - baseline, out))
    return tuple(jumps)


def guess_setup(curve: ForceCurve, *, radius: Quantity, **quantities: Any) -> Setup:
    """A setup whose modulus and work of adhesion are estimated from the curve.

    The work of adhesion is that of the JKR pull-off force, (3/2) pi R dgamma, and the modulus Hertz's at the deepest
    point. Both are elastic: a viscoelastic contact has a smaller work of adhesion and another modulus.

    Args:
        curve: the measurement.
        radius: of the sphere, in m.
        quantities: other quantities of a `Setup`; a modulus or work of adhesion among them is kept.

    Raises:
        ValueError: the curve shows no contact, or a quantity is out of range.
    """
    unknown = {"work_of_adhesion": 1.0, "relaxed_modulus": 1.0}
    r = Setup(**unknown | quantities, radius=radius).radius
    curve = curve.with_sign("tension")
    contact = curve.contact()
    pressed = max(contact.force_offset - float(np.min(curve.force)), 3.0 * contact.noise)
    depth = max(float(np.max(curve.indentation)) - contact.contact_point, 1e-12)
    pulled = max(curve.pull_off_force - contact.force_offset, 3.0 * contact.noise, 1e-6 * pressed)
    quantities.setdefault("work_of_adhesion", pulled / (jkr.PULL_OFF_FORCE * np.pi * r))
    quantities.setdefault("relaxed_modulus", 0.75 * 0.75 * pressed / (np.sqrt(r) * depth**1.5))
    return Setup(radius=r, **quantities)


def hertz_line(data: Measurement) -> dict[str, float]:
    """Modulus and contact point by which Hertz's force, a line in depth^(3/2), misses the approach least."""
    setup, depth, top = data.setup, data.depth, data.segments.top
    counted = slice(0, top + 1) if np.any(data.weights[: top + 1]) else slice(0, None)
    depth, tension = depth[counted], data.tension[counted]
    deepest = float(depth.max())
    if not deepest > 0.0:
        raise ValueError("the sphere must move into the sample after first contact; received a curve that only leaves")
    points = np.linspace(-0.7, 0.95, _PLACES) * deepest
    power = np.maximum(depth - points[:, None], 0.0) ** 1.5
    centred, tension_off_mean = power - power.mean(axis=1, keepdims=True), tension - tension.mean()
    square, product = np.sum(centred**2, axis=1), centred @ tension_off_mean
    best = int(np.argmax(np.where(product < 0.0, product**2, 0.0) / np.maximum(square, 1e-300)))
    slope = min(float(product[best] / max(square[best], 1e-300)), -1e-15 / deepest**1.5)
    modulus = -0.75 * slope / np.sqrt(setup.radius) * (1.0 - setup.poisson_ratio**2)
    return {
        "relaxed_modulus": float(np.clip(modulus, 1.0, 5e11)),
        "contact_point": float(data.position[data.first] + points[best]),
    }
