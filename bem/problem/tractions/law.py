"""A traction law in numbers, as the kernels take it: Lennard-Jones by its formulas, any other by its cubics.

Value, slope, potential and far field of another law are derivatives and integrals of the same cubics; below the first
of them it is the Lennard-Jones law in other units. All laws run through the same compiled code. Units: see
`bem.problem.tractions`.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.problem.tractions.lennard_jones import GAP_AT_PEAK, potential, slope, tail_energy, tail_force, traction

# No integers: Numba compiles a function anew for each constant one.
_TRACTION, _SLOPE, _POTENTIAL, _ENERGY = 0.0, 1.0, 2.0, 3.0


class Law(NamedTuple):
    """A law in numbers, as the kernels take it."""

    tabulated: bool  # else Lennard-Jones
    peak_gap: float
    rise: float  # peak_gap - 1, over that of Lennard-Jones: the scale of the rising part
    floor: float  # gap at which the repulsion is infinite
    # (k + 1, 7) where tabulated. First: gap below which the law is Lennard-Jones, its scales of traction and of gap
    # minus 1, and what continues potential and energy. Then, for each piece, its first gap, four coefficients of the
    # traction in the distance from it, potential and energy there; the last piece has no end and no traction.
    numbers: np.ndarray


LENNARD_JONES = Law(False, GAP_AT_PEAK, 1.0, 0.0, np.empty((0, 7)))


@kernel
def _tabulated(law: Law, gap: float, which: float) -> float:
    """One of the formulas of a tabulated law; one function for all, so that less code is compiled."""
    numbers = law.numbers
    joint, scale, unit, offset, tail = numbers[0, 0], numbers[0, 1], numbers[0, 2], numbers[0, 3], numbers[0, 4]
    if gap < joint:
        scaled_gap = 1.0 + (gap - 1.0) / unit
        if which == _TRACTION:
            return scale * traction(scaled_gap)
        if which == _SLOPE:
            return scale / unit * slope(scaled_gap)
        if which == _POTENTIAL:
            return scale * unit * potential(scaled_gap) + offset
        return scale * unit * unit * tail_energy(scaled_gap) + tail + 2.0 * offset * (joint - gap)
    low, high = 1, numbers.shape[0]
    while high - low > 1:
        middle = (low + high) // 2
        if numbers[middle, 0] <= gap:
            low = middle
        else:
            high = middle
    row = numbers[low]
    x = gap - row[0]
    if which == _TRACTION:
        return row[1] + x * (row[2] + x * (row[3] + x * row[4]))
    if which == _SLOPE:
        return row[2] + x * (2.0 * row[3] + x * 3.0 * row[4])
    if which == _POTENTIAL:
        return row[5] + x * (row[1] + x * (row[2] / 2.0 + x * (row[3] / 3.0 + x * row[4] / 4.0)))
    work = row[1] / 2.0 + x * (row[2] / 6.0 + x * (row[3] / 12.0 + x * row[4] / 20.0))
    return row[6] - 2.0 * x * (row[5] + x * work)


@kernel
def traction_at(law: Law, gap: float) -> float:
    """Traction of a law at a `gap` above its floor."""
    return _tabulated(law, gap, _TRACTION) if law.tabulated else traction(gap)


@kernel
def slope_at(law: Law, gap: float) -> float:
    """Derivative of the traction of a law with respect to the `gap`."""
    return _tabulated(law, gap, _SLOPE) if law.tabulated else slope(gap)


@kernel
def potential_at(law: Law, gap: float) -> float:
    """`potential` of a law."""
    return _tabulated(law, gap, _POTENTIAL) if law.tabulated else potential(gap)


@kernel
def tail_force_at(law: Law, gap: float) -> float:
    """`tail_force` of a law, minus twice its potential."""
    return -2.0 * _tabulated(law, gap, _POTENTIAL) if law.tabulated else tail_force(gap)


@kernel
def tail_energy_at(law: Law, gap: float) -> float:
    """`tail_energy` of a law."""
    return _tabulated(law, gap, _ENERGY) if law.tabulated else tail_energy(gap)
