"""A traction law in numbers, as the kernels take it: Lennard-Jones by its formulas, any other by its cubics.

Value, slope, potential and far field of another law are derivatives and integrals of the same cubics; below the first
of them it is the Lennard-Jones law in other units. All laws run through the same compiled code. Units: see
`bem.tractions`.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.tractions.lennard_jones import GAP_AT_PEAK, potential, slope, tail_energy, tail_force, traction


class Law(NamedTuple):
    """A law in numbers, as the kernels take it."""

    tabulated: bool  # else Lennard-Jones
    peak_gap: float
    reach: float  # peak_gap - 1, over that of Lennard-Jones: the scale of the rising part
    floor: float  # gap at which the repulsion is infinite
    # (5,) where tabulated: gap below which the law is Lennard-Jones, its scales of traction and of gap minus 1, and
    # what continues potential and energy.
    pressed: np.ndarray
    # (k, 7) where tabulated: a gap, four coefficients of the traction in the distance from it, potential and energy.
    pieces: np.ndarray


LENNARD_JONES = Law(False, GAP_AT_PEAK, 1.0, 0.0, np.empty(0), np.empty((0, 7)))


@kernel
def _piece(law: Law, gap: float) -> np.ndarray:
    """The piece (7,) of a tabulated law that holds a `gap`; the last one has no end and no traction."""
    low, high = 0, law.pieces.shape[0]
    while high - low > 1:
        middle = (low + high) // 2
        if law.pieces[middle, 0] <= gap:
            low = middle
        else:
            high = middle
    return law.pieces[low]


@kernel
def traction_at(law: Law, gap: float) -> float:
    """Traction of a law at a `gap` above its floor."""
    if not law.tabulated:
        return traction(gap)
    if gap < law.pressed[0]:
        return law.pressed[1] * traction(1.0 + (gap - 1.0) / law.pressed[2])
    row = _piece(law, gap)
    x = gap - row[0]
    return row[1] + x * (row[2] + x * (row[3] + x * row[4]))


@kernel
def slope_at(law: Law, gap: float) -> float:
    """Derivative of the traction of a law with respect to the `gap`."""
    if not law.tabulated:
        return slope(gap)
    if gap < law.pressed[0]:
        return law.pressed[1] / law.pressed[2] * slope(1.0 + (gap - 1.0) / law.pressed[2])
    row = _piece(law, gap)
    x = gap - row[0]
    return row[2] + x * (2.0 * row[3] + x * 3.0 * row[4])


@kernel
def potential_at(law: Law, gap: float) -> float:
    """`potential` of a law; the `tail_force` is minus twice this."""
    if not law.tabulated:
        return potential(gap)
    if gap < law.pressed[0]:
        unit = law.pressed[2]
        return law.pressed[3] + law.pressed[1] * unit * potential(1.0 + (gap - 1.0) / unit)
    row = _piece(law, gap)
    x = gap - row[0]
    return row[5] + x * (row[1] + x * (row[2] / 2.0 + x * (row[3] / 3.0 + x * row[4] / 4.0)))


@kernel
def tail_force_at(law: Law, gap: float) -> float:
    """`tail_force` of a law."""
    return -2.0 * potential_at(law, gap) if law.tabulated else tail_force(gap)


@kernel
def tail_energy_at(law: Law, gap: float) -> float:
    """`tail_energy` of a law."""
    if not law.tabulated:
        return tail_energy(gap)
    if gap < law.pressed[0]:
        joint, unit = law.pressed[0], law.pressed[2]
        continued = law.pressed[4] + 2.0 * law.pressed[3] * (joint - gap)
        return continued + law.pressed[1] * unit * unit * tail_energy(1.0 + (gap - 1.0) / unit)
    row = _piece(law, gap)
    x = gap - row[0]
    work = row[1] / 2.0 + x * (row[2] / 6.0 + x * (row[3] / 12.0 + x * row[4] / 20.0))
    return row[6] - 2.0 * x * (row[5] + x * work)
