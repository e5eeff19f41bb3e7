"""A measured curve as a fit sees it, averaged, with its noise and the points that count; and first guesses from it."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from scipy.fft import idct
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from bem._support.validation import FloatArray, finite_number
from bem.lab.contact_point import FEWEST, noise_of
from bem.lab.curve import ForceCurve
from bem.lab.models import Jump, Path
from bem.lab.setup import Setup
from bem.lab.units import Quantity, readable, to_si
from bem.methods.closed_forms import jkr

MOST = 1500
"""Points that a longer curve is averaged to."""
Segment = Literal["both", "approach", "retract"]

_FAR = 0.5  # of the baseline, where attraction does not bend it yet
_TOP = 0.005  # of the path, within which the instrument is at its deepest
_QUIET = 0.1  # of a step, up to which the noise of a path does not disturb its speed
_STEPS, _BESIDE = 6.5, 2.0  # times the noise, and times the changes beside it, that a jump changes the force by
_EXACT = 3e-5  # of the range of the force, below which the error of a model may be
_ORDER = 2  # of the autoregressive model of residuals: that of the motion of a cantilever in a fluid
_SLOWEST = 16  # cosines: more see less of noise that grows towards low frequencies, fewer widen every interval
_SEEN = 2.0  # standard deviations by which the correlation of neighbours is seen
_CHANGES, _FAR_LONGER = 0.05, 5.0  # logarithm of the ratio of two steps; a long one over most
_PLACES = 80  # of the contact point that are tried
_OWN = 0.02  # of the time out of contact, that neither place nor speed explains, for a drift to show
_TURNS, _BEYOND = 0.2, 10.0  # of the depth, and times the noise of the path, by which an instrument turns


@dataclass(frozen=True, eq=False)
class Measurement(Path):
    """An averaged curve of n points along its path, in SI, positive in tension."""

    tension: FloatArray
    weights: FloatArray
    """One for a point that counts and zero for one that does not, shape (n,)."""
    baseline: float
    """Tension before contact, in N."""
    noise: float
    """Standard deviation of an averaged point on the baseline, in N."""
    correlated: float
    """Variance of a sum of points of the baseline over that of independent ones, at least 1."""
    white: bool
    """Whether neighbours on the baseline look independent."""
    first: int
    """The first point after the baseline."""
    top: int
    """The last point of the approach."""
    columns: dict[str, FloatArray]
    """What enters linearly: force_offset (1), tilt (path, m), drag (minus speed, m/s), drift (time, s), each (n,)."""
    jumps: tuple[Jump, ...]
    """Of the force, into and out of contact."""

    @property
    def exact(self) -> float:
        """Error of a model that counts as none, in units of the noise: below it, no model is better than another."""
        return _EXACT * float(np.ptp(self.tension)) / self.noise

    @property
    def depth(self) -> FloatArray:
        """Indentation from the place of first contact on, in m, with the spring's deflection taken off."""
        indentation = self.place + (self.tension - self.baseline) * self.compliance
        return indentation - indentation[self.first]

    @property
    def one_way(self) -> bool:
        """Whether no point of the retraction counts: adhesion and relaxation bend an approach alike."""
        back = self.place[self.top :] < self.place.max() - _TOP * np.ptp(self.place)
        return not self.weights[self.top :][back].any()

    @cached_property
    def far(self) -> np.ndarray:
        """Which points are surely out of contact: the far half of both baselines, where no neck reaches, shape (n,)."""
        far = self.place < 0.5 * (self.place[0] + self.place[self.first])
        for jump in self.jumps:
            far &= ~((self.time >= self.time[self.first]) & (self.time < jump.time))
        return far

    @property
    def linear(self) -> tuple[str, ...]:
        """Columns that are always fitted: tilt, and drag where the stage moves both ways."""
        signs = {name: np.ptp(np.sign(column[self.weights > 0.0])) for name, column in self.columns.items()}
        return "force_offset", *(name for name in ("tilt", "drag") if signs[name] > 0.0)

    @property
    def shows_drift(self) -> bool:
        """Whether both baselines count, which tell a drift from a tilt and from relaxation in contact."""
        far = self.far & (self.weights > 0.0)
        time, known = self.columns["drift"][far], np.column_stack([self.columns[name][far] for name in self.linear])
        known /= np.maximum(np.linalg.norm(known, axis=0), 1e-300)
        own = time - known @ np.linalg.lstsq(known, time, rcond=1e-6)[0]
        return bool(time.size > FEWEST and np.linalg.norm(own) > _OWN * np.linalg.norm(time - time.mean()))

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
        ValueError: a curve without contact or baseline, or of several cycles.
    """
    contact = curve.contact()
    if not curve.time[-1] > curve.time[min(contact.index, len(curve) - 1)]:
        raise ValueError(f"time must increase after contact; received {curve.time[-1]:g} s to the end")
    place, index = prescribed_path(curve, setup), contact.index
    once = np.maximum.accumulate(curve.time + 1e-12 * np.ptp(curve.time) * np.arange(len(curve)))
    all_columns: tuple[FloatArray, ...] = (curve.time, place, curve.tension, np.gradient(_smooth(place), once))
    steps = np.diff(once)
    changes = np.abs(np.log(steps[1:] / steps[:-1]))
    # Most steps of a solver differ from the one before, and some are far longer than most, as no instrument's are.
    if np.median(changes) > _CHANGES and steps.max() > _FAR_LONGER * np.median(steps):
        even = np.linspace(once[0], once[-1], MOST)
        index = int(np.searchsorted(even, once[index]))
        all_columns = tuple(np.interp(even, once, each) for each in all_columns)
    size = -(-len(all_columns[0]) // MOST)
    starts = np.arange(0, len(all_columns[0]), size)
    counts = np.diff(np.append(starts, len(all_columns[0])))
    time, place, tension, speed = (np.add.reduceat(each, starts) / counts for each in all_columns)
    first = max(index // size, 2)
    _one_cycle(time, place, first)
    deep = np.flatnonzero(place >= place.max() - _TOP * np.ptp(place))
    top, leaves = int(deep[0]), int(deep[-1])
    number = np.arange(time.size)
    counted = {"both": number >= 0, "approach": number <= top, "retract": number >= leaves}[segment]
    quiet = int(_FAR * first)
    line = np.polynomial.Polynomial.fit(place[:quiet], tension[:quiet], min(quiet // 8, 1))
    rest = tension[:quiet] - line(place[:quiet])
    white = quiet >= 8 and rest[1:] @ rest[:-1] < _SEEN / np.sqrt(quiet) * (rest @ rest)
    noise, correlated = float(np.std(rest)) if quiet >= 8 else noise_of(tension), 1.0
    if quiet > _SLOWEST:
        basis = np.linalg.qr(np.vander(np.arange(quiet) / quiet, 2))[0]
        correlated = max(slow_noise(rest, basis)[0] / max(noise**2, 1e-300), 1.0)
    columns = {"force_offset": np.ones(time.size), "tilt": place - place[first], "drag": -speed}
    columns["drift"] = time - time[first]
    baseline = float(np.median(tension[:first]))
    jumps = _jumps(time, tension, top, leaves, baseline)
    # A mean over a jump is neither force; the points on either side of it do not count.
    for jump in jumps:
        counted &= ~(np.abs(time - jump.time) < 1.1 * size * float(np.median(np.diff(curve.time))))
    weights, noise = counted.astype(float), max(noise, _EXACT * float(np.ptp(tension)), 1e-300)
    return Measurement(
        time, place, setup, tension, weights, baseline, noise, correlated, bool(white), first, top, columns, jumps
    )


def _one_cycle(time: FloatArray, place: FloatArray, first: int) -> None:
    """Refuse a path that rises again after a fall, both by more than noise; what it does out of contact is free."""
    depth = np.maximum(place, place[first])
    least = max(_TURNS * float(np.ptp(depth)), _BEYOND * noise_of(place))
    turn, rises, tops = 0, False, []
    for n, here in enumerate(depth):
        if (here > depth[turn]) == rises:
            turn = n
        elif abs(here - depth[turn]) > least:
            tops += [] if rises else [n]
            turn, rises = n, not rises
    if len(tops) > 1:
        cuts = [time[a + int(np.argmin(place[a:b]))] for a, b in itertools.pairwise(tops)]
        raise ValueError(
            f"a force curve must approach and retract once; received {len(tops)} cycles: cut it at "
            f"{', '.join(readable(float(cut), 's') for cut in cuts)} and fit one of them"
        )


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
    found = cosines.T @ lfilter(weights, 1.0, residuals)
    left = lfilter(weights, 1.0, cosines[::-1], axis=0)[::-1]
    left = lfilter([1.0], weights, (left - basis @ (basis.T @ left))[::-1], axis=0)
    expected = left.T @ left
    share = max(float(np.trace(expected)), 1e-9)
    return float(found @ found) / share / max(weights.sum(), 0.01) ** 2, share**2 / max(np.sum(expected**2), 1e-18)


def prescribed_path(curve: ForceCurve, setup: Setup) -> FloatArray:
    """What the instrument moved at each point of a curve, in m: the sphere, or the stage behind the setup's spring.

    A curve without a stage gives it as indentation plus compression over stiffness.
    """
    if setup.stiffness is None:
        return curve.indentation
    return curve.indentation - curve.tension / setup.stiffness if curve.stage is None else curve.stage


def _smooth(place: FloatArray) -> FloatArray:
    """A noisy path as a mean over a hundredth of its points, which leaves the speed of a ramp and little noise."""
    half = place.size // 200
    if half == 0 or noise_of(place) < _QUIET * float(np.median(np.abs(np.diff(place)))):
        return place
    padded = np.pad(place, half, mode="reflect", reflect_type="odd")
    return np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")


def _jumps(time: FloatArray, tension: FloatArray, top: int, leaves: int, baseline: float) -> tuple[Jump, ...]:
    """The largest rise of the approach and the largest fall of the retraction, where they stand out."""
    found, noise = [], noise_of(tension)
    for out, begin, end in ((False, 0, top), (True, leaves, time.size - 1)):
        steps = np.diff(tension[begin : end + 1]) * (-1.0 if out else 1.0)
        if steps.size < 5:
            continue
        at = int(np.argmax(steps))
        beside = np.abs(np.concatenate([steps[max(at - 4, 0) : max(at - 1, 0)], steps[at + 2 : at + 5]]))
        if steps[at] > _STEPS * noise and steps[at] > _BESIDE * beside.max(initial=0.0):
            sides = slice(begin + at, begin + at + 2)
            found.append(Jump(float(time[sides].mean()), float(tension[sides].mean()) - baseline, out))
    return tuple(found)


def guess_setup(curve: ForceCurve, *, radius: Quantity, **known: Any) -> Setup:
    """A setup whose modulus and work of adhesion are estimated from the curve.

    The work of adhesion is that of the JKR pull-off force, (3/2) pi R dgamma, and the modulus Hertz's at the deepest
    point. Both are elastic: a viscoelastic contact has a smaller work of adhesion and another modulus.

    Args:
        curve: the measurement.
        radius: of the sphere, in m.
        known: other quantities of a `Setup`; a modulus or work of adhesion among them is kept.

    Raises:
        ValueError: the curve shows no contact, or a quantity is out of range.
    """
    r = finite_number("radius", to_si("radius", radius, "length"), above=0.0)
    curve = curve.with_sign("tension")
    contact = curve.contact()
    pressed = max(contact.force_offset - float(np.min(curve.force)), 3.0 * contact.noise)
    depth = max(float(np.max(curve.indentation)) - contact.contact_point, 1e-12)
    pulled = max(curve.pull_off_force - contact.force_offset, 3.0 * contact.noise, 1e-6 * pressed)
    known.setdefault("work_of_adhesion", pulled / (jkr.PULL_OFF_FORCE * np.pi * r))
    known.setdefault("relaxed_modulus", 0.75 * 0.75 * pressed / (np.sqrt(r) * depth**1.5))
    return Setup(radius=r, **known)


def hertz_line(data: Measurement) -> dict[str, float]:
    """Modulus and contact point by which Hertz's force, a line in depth^(3/2), misses the approach least."""
    setup, depth = data.setup, data.depth
    counted = slice(0, data.top + 1) if np.any(data.weights[: data.top + 1]) else slice(0, None)
    depth, tension = depth[counted], data.tension[counted]
    deepest = float(depth.max())
    if not deepest > 0.0:
        raise ValueError(
            "a force curve must come into contact on its approach; received one that leaves the baseline after it"
        )
    places = np.linspace(-0.7, 0.95, _PLACES) * deepest
    power = np.maximum(depth - places[:, None], 0.0) ** 1.5
    centred, rest = power - power.mean(axis=1, keepdims=True), tension - tension.mean()
    square, product = np.sum(centred**2, axis=1), centred @ rest
    best = int(np.argmax(np.where(product < 0.0, product**2, 0.0) / np.maximum(square, 1e-300)))
    slope = min(float(product[best] / max(square[best], 1e-300)), -1e-15 / deepest**1.5)
    modulus = -0.75 * slope / np.sqrt(setup.radius) * (1.0 - setup.poisson_ratio**2)
    return {
        "relaxed_modulus": float(np.clip(modulus, 2.0, 5e11)),
        "contact_point": float(data.place[data.first] + places[best]),
    }
