"""The Lennard-Jones law as formulas.

The paper's Eq. (LJ),

    sigma(h) = (8/3) (h^-3 - h^-9),

of unit work of adhesion, largest at h = 3^(1/6), where it is 16 / (9 sqrt 3). Units: see `bem.problem.tractions`.
"""

from bem._support.jit import kernel

GAP_AT_PEAK = 3.0 ** (1.0 / 6.0)
PEAK_TRACTION = 16.0 / (9.0 * 3.0**0.5)


@kernel
def traction(gap: float) -> float:
    """Lennard-Jones traction at a `gap` > 0."""
    inverse_cube = 1.0 / (gap * gap * gap)
    return (8.0 / 3.0) * inverse_cube * (1.0 - inverse_cube * inverse_cube)


@kernel
def slope(gap: float) -> float:
    """Derivative of the Lennard-Jones traction with respect to the `gap`."""
    inverse_cube = 1.0 / (gap * gap * gap)
    return (8.0 * inverse_cube / gap) * (3.0 * inverse_cube * inverse_cube - 1.0)


@kernel
def tail_force(gap: float) -> float:
    """Force carried by everything beyond a radius at which the gap is `gap`, for an undeformed sphere outside it.

    Follows from P = 2 int sigma dh, which does not depend on the Tabor parameter.
    """
    inverse_square = 1.0 / (gap * gap)
    return (8.0 / 3.0) * inverse_square * (1.0 - 0.25 * inverse_square * inverse_square * inverse_square)


@kernel
def potential(gap: float) -> float:
    """Energy per area of two surfaces at a `gap`, in dgamma: minus the integral of the traction from there outwards."""
    inverse_square = 1.0 / (gap * gap)
    return -(4.0 / 3.0) * inverse_square * (1.0 - 0.25 * inverse_square * inverse_square * inverse_square)


@kernel
def tail_energy(gap: float) -> float:
    """Energy of everything beyond a radius at which the gap is `gap`, for an undeformed sphere, in h0 pi R dgamma."""
    inverse_cube = 1.0 / (gap * gap * gap)
    return -(8.0 / 3.0) / gap * (1.0 - inverse_cube * inverse_cube / 28.0)
