"""Transfer of a solution from one selection of nodes to the next.

The smooth quantity is interpolated: the traction where surfaces press on each other, the gap elsewhere (see
`bem.solver.equilibrium`), both by the cubic through four nodes. The memory needs no transfer, it lives on the master
grid.
"""

import numpy as np

from bem._numerics.jit import kernel
from bem.solver.discretisation.mesh import Mesh
from bem.solver.equilibrium import pressed_below
from bem.solver.pressed import pressed_gap_of
from bem.tractions import Law, traction_at


@kernel
def _cubic(radii: np.ndarray, values: np.ndarray, first: int, x: float) -> float:
    """Polynomial through the four nodes from `first` on, at x."""
    total = 0.0
    for a in range(first, first + 4):
        weight = 1.0
        for b in range(first, first + 4):
            if a != b:
                weight *= (x - radii[b]) / (radii[a] - radii[b])
        total += weight * values[a]
    return total


@kernel
def transfer(
    old: Mesh,
    gap: np.ndarray,
    tractions: np.ndarray,
    new: Mesh,
    tabor: float,
    law: Law,
    nonadhesive: bool,
    new_gap: np.ndarray,
    new_traction: np.ndarray,
) -> None:
    """Gap and traction at the new nodes into `new_gap` and `new_traction` (n_new,).

    Beyond the old mesh the sphere is undeformed and carries nothing.
    """
    n, below = old.radii.size, pressed_below(law)
    k = 0
    for i in range(new.radii.size):
        x = new.radii[i]
        if x > old.radii[n - 1]:
            new_gap[i] = gap[n - 1] + 0.5 * tabor * (x * x - old.radii[n - 1] ** 2)
            new_traction[i] = 0.0 if nonadhesive else tabor * traction_at(law, new_gap[i])
            continue
        while k < n - 2 and old.radii[k + 1] < x:
            k += 1
        if x == old.radii[k + 1]:
            new_gap[i], new_traction[i] = gap[k + 1], tractions[k + 1]
            continue
        part = (x - old.radii[k]) / (old.radii[k + 1] - old.radii[k])
        first = max(0, min(k - 1, n - 4))
        if nonadhesive:
            new_gap[i] = gap[k] + part * (gap[k + 1] - gap[k])
            new_traction[i] = tractions[k] + part * (tractions[k + 1] - tractions[k])
        elif gap[k] < below and gap[k + 1] < below:
            if max(max(gap[first], gap[first + 1]), max(gap[first + 2], gap[first + 3])) < below:
                stress = _cubic(old.radii, tractions, first, x)
            else:
                stress = tractions[k] + part * (tractions[k + 1] - tractions[k])
            new_gap[i] = pressed_gap_of(law, stress / tabor, gap[k] + part * (gap[k + 1] - gap[k]))
        else:
            low, high = min(gap[k], gap[k + 1]), max(gap[k], gap[k + 1])
            margin = 0.1 * (high - low)
            new_gap[i] = min(max(_cubic(old.radii, gap, first, x), low - margin), high + margin)
        if not nonadhesive:
            new_traction[i] = tabor * traction_at(law, new_gap[i])
