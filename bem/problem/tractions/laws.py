"""The laws by name, and what a law of your own gives: its traction and the slope of it, and where they are smooth.

Units: see `bem.problem.tractions`.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bem._support.validation import FloatArray, finite_number, finite_vector, real_array
from bem._support.wording import shown
from bem.problem.tractions.law import LENNARD_JONES, Law
from bem.problem.tractions.lennard_jones import GAP_AT_PEAK, PEAK_TRACTION, potential, slope, tail_energy, traction

_PIECES = 400  # between two breaks of a law
_MISMATCH = 1e-6
_ROUGHNESS = 1e-3  # of a slope, as a share of the steepest


@dataclass(frozen=True)
class LennardJones:
    """Attraction at a distance and steep repulsion below the equilibrium gap."""


@dataclass(frozen=True)
class HardContact:
    """Impenetrable surfaces without attraction: gap >= 1, traction <= 0, and one of them zero."""


class TractionLaw(ABC):
    """A law other than Lennard-Jones; a subclass is a frozen dataclass with what follows, which a `Scene` checks.

    From the gap `breaks[0]` to `breaks[-1]` the subclass gives the traction; beyond there is none. Below, where
    surfaces press on each other, it is that of Lennard-Jones in the scales of `repulsion`, which give the traction and
    the slope of the subclass at `breaks[0]`, on the rising part of the law.
    """

    breaks: ClassVar[tuple[float, ...]]
    """Gaps, rising, between which the traction is smooth; each two have the same number of cubics between them."""
    peak_gap: ClassVar[float]
    """Gap of the largest traction, the smallest if there are several: it marks the contact edge."""
    repulsion: ClassVar[tuple[float, float]]
    """Scale of the traction and of gap minus 1, by which the Lennard-Jones law is multiplied below `breaks[0]`."""
    fineness: ClassVar[float] = 1.0
    """Spacing of nodes at the contact edge, of that for Lennard-Jones; the steepest fall of the traction sets it."""

    @abstractmethod
    def traction(self, gap: FloatArray) -> FloatArray:
        """Traction (n,) at gaps (n,) from `breaks[0]` to `breaks[-1]`."""

    @abstractmethod
    def slope(self, gap: FloatArray) -> FloatArray:
        """Its derivative (n,)."""


@dataclass(frozen=True)
class ConstantStress(TractionLaw):
    """The law of Maugis and Dugdale: the same traction from contact up to a gap of 1.97, and none beyond.

    Newton-Raphson needs a slope. The traction therefore rises within a tenth of the gap in which the Lennard-Jones law
    does, 0.02, and falls within `width` as a cubic without kinks; where it falls is such that the work of adhesion is
    exactly 1.

    Args:
        width: gap within which the traction falls to zero, in h0, from 0.05 to 1; a smaller one needs more nodes. With
            the default the elastic pull-off force is that of Maugis to half a per cent.

    Source: Maugis, J. Colloid Interface Sci. 150 (1992) 243.
    """

    width: float = 0.4

    repulsion = (1.0, 0.1)
    peak_gap = 1.0 + 0.1 * (GAP_AT_PEAK - 1.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "width", finite_number("width", self.width, low=0.05, high=1.0))

    @property
    def range(self) -> float:
        """Gap at which the traction has fallen by half."""
        rise = 0.1 * (1.0 + potential(GAP_AT_PEAK))
        return self.peak_gap + (1.0 - rise) / PEAK_TRACTION

    @property
    def breaks(self) -> tuple[float, ...]:  # type: ignore[override]
        """Where the plateau begins and ends, and where the traction ends."""
        return self.peak_gap, self.range - 0.5 * self.width, self.range + 0.5 * self.width

    @property
    def fineness(self) -> float:  # type: ignore[override]
        """In inverse proportion to the steepest fall."""
        return 0.8 * self.width

    def traction(self, gap: FloatArray) -> FloatArray:
        """Traction (n,) at gaps (n,), in dgamma/h0."""
        share = np.clip((gap - self.range) / self.width + 0.5, 0.0, 1.0)
        return PEAK_TRACTION * (1.0 - share**2 * (3.0 - 2.0 * share))

    def slope(self, gap: FloatArray) -> FloatArray:
        """Its derivative (n,)."""
        share = np.clip((gap - self.range) / self.width + 0.5, 0.0, 1.0)
        return -6.0 * PEAK_TRACTION / self.width * share * (1.0 - share)


@dataclass(frozen=True)
class Exponential(TractionLaw):
    """The exponential law of cohesive zones, sigma = (s / l^2) exp(-s / l) with s = gap - 1, largest at s = l.

    Its range l is 1 / (e PEAK_TRACTION) = 0.358 h0. It ends where the traction is below rounding.

    Source: Needleman, J. Mech. Phys. Solids 38 (1990) 289; Rose, Ferrante and Smith, Phys. Rev. Lett. 47 (1981) 675.
    """

    length: ClassVar[float] = 1.0 / (math.e * PEAK_TRACTION)
    breaks = (1.0, 1.0 + 6.0 * length, 1.0 + 48.0 * length)
    peak_gap = 1.0 + length
    repulsion = (1.0 / (16.0 * length**2), 1.0)  # the slope of the attraction at gap 1

    def traction(self, gap: FloatArray) -> FloatArray:
        """Traction (n,) at gaps (n,), in dgamma/h0."""
        distance = (gap - 1.0) / self.length
        return distance * np.exp(-distance) / self.length

    def slope(self, gap: FloatArray) -> FloatArray:
        """Its derivative (n,)."""
        distance = (gap - 1.0) / self.length
        return (1.0 - distance) * np.exp(-distance) / self.length**2


LAWS = {
    "lennard-jones": LennardJones,
    "constant-stress": ConstantStress,
    "exponential": Exponential,
    "none": HardContact,
}
"""Every adhesion by its name on the command line."""


def law_of(adhesion: LennardJones | HardContact | TractionLaw) -> Law:
    """The law in numbers; without adhesion none is used.

    Raises:
        ValueError: for a law that lacks a number or has a wrong one, whose traction or slope is not finite, whose slope
            is not that of the traction or jumps, whose traction does not continue the repulsion or end at zero, whose
            largest traction is elsewhere than at `peak_gap`, or whose work of adhesion is not 1.
    """
    return _tabulated(adhesion) if isinstance(adhesion, TractionLaw) else LENNARD_JONES


def _tabulated(law: TractionLaw) -> Law:
    breaks, (scale, unit), peak_gap = _numbers_of(law)
    ends = itertools.pairwise(breaks)
    shares = np.arange(_PIECES) / _PIECES
    gap = np.concatenate([low + (high - low) * shares for low, high in ends] + [[breaks[-1]]])
    value, slope_there = _computed(law, "traction", gap), _computed(law, "slope", gap)
    _check_slope(law, gap, value, slope_there, scale / unit * slope(1.0 + (gap[0] - 1.0) / unit))
    _check_peak(law, gap, value)
    step, rise = np.diff(gap), np.diff(value)
    first, last = slope_there[:-1] * step, slope_there[1:] * step
    cubic = np.stack([value[:-1], first, 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise])
    # Potential and energy, from the outside in.
    work = step * (cubic[0] + cubic[1] / 2.0 + cubic[2] / 3.0 + cubic[3] / 4.0)
    depth = np.append(-np.cumsum(work[::-1])[::-1], 0.0)
    moment = step**2 * (cubic[0] / 2.0 + cubic[1] / 6.0 + cubic[2] / 12.0 + cubic[3] / 20.0)
    beyond = 2.0 * (depth[:-1] * step + moment)
    energy = np.append(np.cumsum(beyond[::-1])[::-1], 0.0)
    pieces = np.zeros((gap.size, 7))
    pieces[:, 0], pieces[:, 5], pieces[:, 6] = gap, depth, energy
    pieces[:-1, 1:5] = (cubic / step ** np.arange(4)[:, None]).T
    joint = 1.0 + (gap[0] - 1.0) / unit
    joined = scale * traction(joint)
    if abs(joined - value[0]) > _MISMATCH:
        raise ValueError(
            f"a traction law must continue its repulsion, which is {joined:.8g} at the gap {gap[0]:g}; received "
            f"{shown(law)} with {value[0]:.8g}"
        )
    offset = depth[0] - scale * unit * potential(joint)
    tail = energy[0] - scale * unit**2 * tail_energy(joint)
    if abs(scale * unit * potential(1.0) + offset + 1.0) > _MISMATCH:
        raise ValueError(
            f"the work of adhesion of a traction law must be 1; received {shown(law)} with "
            f"{-scale * unit * potential(1.0) - offset:.8g}"
        )
    numbers = np.vstack([[gap[0], scale, unit, offset, tail, 0.0, 0.0], pieces])
    return Law(True, peak_gap, (peak_gap - 1.0) / (GAP_AT_PEAK - 1.0), 1.0 - unit, numbers)


def _numbers_of(law: TractionLaw) -> tuple[tuple[float, ...], FloatArray, float]:
    """Breaks, repulsion and gap of the largest traction."""
    for name in ("breaks", "repulsion", "peak_gap"):
        if not hasattr(law, name):
            raise ValueError(f"a traction law must state its {name}; received {shown(law)} without")
    breaks = tuple(finite_vector("breaks of a traction law", law.breaks).tolist())
    if len(breaks) < 2 or breaks[0] < 1.0 or not np.all(np.diff(breaks) > 0.0):
        raise ValueError(f"breaks of a traction law must be at least two rising gaps from 1 on; received {breaks}")
    repulsion = finite_vector("repulsion of a traction law", law.repulsion)
    if repulsion.size != 2 or repulsion.min() <= 0.0:
        raise ValueError(f"repulsion of a traction law must be two numbers above zero; received {shown(law.repulsion)}")
    finite_number("fineness of a traction law", law.fineness, above=0.0)
    return breaks, repulsion, finite_number("peak_gap of a traction law", law.peak_gap, low=breaks[0], high=breaks[-1])


def _computed(law: TractionLaw, name: str, gap: FloatArray) -> FloatArray:
    """Traction or slope of a law, finite, of the shape of `gap`."""
    numbers = real_array(f"{name} of a traction law", getattr(law, name)(gap))
    if numbers.shape != gap.shape:
        raise ValueError(f"{name} of a traction law must be as many numbers as gaps; received shape {numbers.shape}")
    if (bad := np.flatnonzero(~np.isfinite(numbers))).size:
        raise ValueError(
            f"{name} of a traction law must be finite from breaks[0] to breaks[-1]; received {shown(law)} with "
            f"{numbers[bad[0]]} at the gap {gap[bad[0]]:.8g}"
        )
    return numbers


def _check_slope(law: TractionLaw, gap: FloatArray, value: FloatArray, slopes: FloatArray, before: float) -> None:
    """Compare the slope with differences of the traction by Simpson's rule, and at both ends with what is beyond."""
    between = _computed(law, "slope", 0.5 * (gap[1:] + gap[:-1]))
    mean_slopes = np.concatenate([slopes[:1], (slopes[:-1] + 4.0 * between + slopes[1:]) / 6.0, slopes[-1:]])
    differences = np.concatenate([[before], np.diff(value) / np.diff(gap), [0.0]])
    errors = np.abs(mean_slopes - differences)
    worst = int(np.argmax(errors))
    if errors[worst] > _ROUGHNESS * max(slopes.max(), -slopes.min(), _MISMATCH):
        raise ValueError(
            "slope of a traction law must be continuous and the derivative of its traction, "
            f"{differences[worst]:.6g} at the gap {gap[max(worst - 1, 0)]:.6g}; received {shown(law)} with "
            f"{mean_slopes[worst]:.6g}"
        )
    if abs(value[-1]) > _MISMATCH:
        raise ValueError(
            f"traction of a law must end at zero; received {shown(law)} with {value[-1]:.6g} at the gap {gap[-1]:.6g}"
        )


def _check_peak(law: TractionLaw, gap: FloatArray, value: FloatArray) -> None:
    at_peak, largest = _computed(law, "traction", np.array([law.peak_gap]))[0], float(np.max(value))
    first = int(np.argmax(value >= largest * (1.0 - _MISMATCH)))
    early = law.peak_gap - gap[first] > 2.0 * np.diff(gap)[min(first, gap.size - 2)]
    if at_peak < (1.0 - 10.0 * _MISMATCH) * largest or early:
        raise ValueError(
            f"peak_gap of a traction law must be the smallest gap of its largest traction, {gap[first]:.6g}; received "
            f"{shown(law)} with {law.peak_gap:.6g}"
        )
