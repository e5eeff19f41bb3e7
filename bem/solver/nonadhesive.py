"""Contact without adhesion: surfaces that neither pass through each other nor attract (a complementarity problem).

At every node either the gap is closed and the traction compressive, or the gap is open and there is no traction:

    h = rhs - a G sigma,    h >= 1,    sigma <= 0,    (h - 1) sigma = 0,

with the gap counted from h0 as in `bem.solver.equilibrium`. An active-set Newton iteration solves the linear system of
the closed nodes only, releases those that would pull and adds those that would pass through, until neither is left.
There is no far field, so the mesh ends just outside the contact.
Source: Johnson, Contact Mechanics, 1985, section 5.9; Hertz's solution is in `bem.reference_solutions.hertz`.
"""

import numpy as np

from bem._numerics.jit import kernel
from bem._numerics.linear_algebra import add_rows, lu_factor, lu_solve
from bem.solver.work import FACTORISATIONS, ITERATIONS, UNKNOWNS

_MOST_ITERATIONS = 100
# In h0, of what the gap is made of. Not an accuracy: a node left open although it is pressed costs force, far more of
# it in a stiff solid.
_PASSED_THROUGH = 1e-11


@kernel
def _list_nodes(closed: np.ndarray, inside: np.ndarray) -> int:
    """Write the numbers of the closed nodes (n,) into `inside` (n,); return how many there are."""
    count = 0
    for i in range(closed.size):
        if closed[i]:
            inside[count] = i
            count += 1
    return count


@kernel
def solve_nonadhesive(
    influence: np.ndarray,
    rhs: np.ndarray,
    response: float,
    gap: np.ndarray,
    tractions: np.ndarray,
    work: np.ndarray,
) -> bool:
    """Solve from the nodes closed in the predicted `tractions` (n,); overwrites `gap` and `tractions` by the solution.

    `work` as in `bem.solver.equilibrium.solve_adhesive`; returns whether no node passes through or pulls, up to
    rounding.
    """
    n = gap.size
    # The prediction differs from the contact by a node or two at its edge. The overlap of the undeformed surfaces, used
    # where nothing touched before, is far larger.
    closed = np.empty(n, dtype=np.bool_)
    touching = False
    for i in range(n):
        closed[i] = tractions[i] < 0.0
        touching = touching or closed[i]
    inside, pivots = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int32)
    pressure, columns = np.empty(n), np.empty((n, n))
    for _ in range(_MOST_ITERATIONS):
        for i in range(n):
            if not touching:
                closed[i] = rhs[i] < 1.0
            tractions[i], gap[i] = 0.0, 0.0
        touching = True
        m = _list_nodes(closed, inside)
        for j in range(m):
            pressure[j] = rhs[inside[j]] - 1.0
            for i in range(m):
                columns[j, i] = response * influence[inside[j], inside[i]]
        if m > 0:
            lu_factor(columns, m, pivots)
            lu_solve(columns, m, pivots, pressure)
        work[ITERATIONS] += 1
        work[FACTORISATIONS] += 1
        work[UNKNOWNS] += m
        for i in range(m):
            tractions[inside[i]] = pressure[i]
        add_rows(influence, tractions, gap)
        changed = False
        for i in range(n):
            gap[i] = rhs[i] - response * gap[i]
            if closed[i] and tractions[i] > 0.0:
                closed[i] = False
                changed = True
            elif not closed[i] and gap[i] < 1.0 - _PASSED_THROUGH * (1.0 + abs(rhs[i])):
                closed[i] = True
                changed = True
        if not changed:
            return True
    return False


@kernel
def nonadhesive_edge(radii: np.ndarray, tractions: np.ndarray) -> float:
    """Contact radius: half-way from the last node that presses to the next one; 0 where nothing touches."""
    for j in range(tractions.size - 1, -1, -1):
        if tractions[j] < 0.0:
            return 0.5 * (radii[j] + radii[min(j + 1, radii.size - 1)])
    return 0.0
