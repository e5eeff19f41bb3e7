"""Energy stored in an elastic contact; it gives the work of a loop without subtracting large numbers.

At fixed indentation an equilibrium minimises

    U = 2 int (mu phi(h) + sigma u / 2) r dr,        phi(h) = -int_h^inf sigma dh',        dU = -P d(delta).

The work put into an elastic contact is therefore the change of U plus what the jumps lose. The integral of P d(delta)
says the same, but along a deep loop it is the small difference of two large areas.

Units: h0 pi R dgamma. Source: Greenwood, Proc. R. Soc. A 453 (1997) 1277, on the energy of the branches.
"""

import numpy as np

from bem._numerics.jit import kernel
from bem.tractions import Law, potential_at, tail_energy, tail_energy_at


@kernel
def stored_energy(
    radii: np.ndarray,
    weights: np.ndarray,
    tabor: float,
    law: Law,
    nonadhesive: bool,
    depth: float,
    gap: np.ndarray,
    tractions: np.ndarray,
) -> float:
    """U of an elastic equilibrium `gap`, `tractions` (n,) at the indentation `depth`."""
    total = 0.0
    for i in range(gap.size):
        lifted = 1.0 - depth + 0.5 * tabor * radii[i] ** 2 - gap[i]
        surface = 0.0 if nonadhesive else tabor * potential_at(law, gap[i])
        total += weights[i] * (surface + 0.5 * tractions[i] * lifted)
    if nonadhesive:
        return total
    if law.tabulated:
        return total + tail_energy_at(law, gap[gap.size - 1])
    return total + tail_energy(gap[gap.size - 1])
