"""Contact without adhesion: surfaces that neither pass through each other nor attract (a complementarity problem).

At every node either the gap is closed and the traction compressive, or the gap is open and there is no traction:

    h = rhs - a G sigma,    h >= 1,    sigma <= 0,    (h - 1) sigma = 0,

with the gap counted from h0 as in `bem.equilibrium`. An active-set Newton iteration solves the linear system of the
closed nodes only, releases those that would pull and adds those that would pass through, until neither is left. There
is no far field, so the mesh ends just outside the contact.
Source: Johnson, Contact Mechanics, 1985, section 5.9; Hertz's solution is in `bem.reference_solutions.hertz`.
"""

import numpy as np

from bem._jit import kernel
from bem._lapack import lu_factor, lu_solve
from bem.mesh import Mesh

_MOST_ITERATIONS = 100


@kernel
def solve_hard(
    mesh: Mesh,
    rhs: np.ndarray,
    response: float,
    tolerance: float,
    gap: np.ndarray,
    tractions: np.ndarray,
    counts: np.ndarray,
) -> bool:
    """Solve from the nodes closed in the predicted `tractions` (n,); overwrites `gap` and `tractions` by the solution.

    `counts` as in `bem.equilibrium.solve_adhesive`; returns whether no node passes through by more than `tolerance` (in
    h0) or pulls.
    """
    n = gap.size
    # The prediction knows the contact but for a node or two at its edge. The overlap of the undeformed surfaces, all
    # there is to go by when nothing touched before, is far larger.
    closed = tractions < 0.0
    if not np.any(closed):
        closed = rhs < 1.0
    for _ in range(_MOST_ITERATIONS):
        inside = np.flatnonzero(closed)
        m = inside.size
        pressure = np.empty(m)
        matrix, pivots = np.empty((m, m)), np.empty(m, dtype=np.int32)
        for i in range(m):
            pressure[i] = rhs[inside[i]] - 1.0
            for j in range(m):
                matrix[i, j] = response * mesh.influence[inside[i], inside[j]]
        if m > 0:
            lu_factor(matrix, m, pivots)
            lu_solve(matrix, m, pivots, pressure)
        counts[0] += 1
        counts[1] += 1
        counts[2] += m
        tractions[:] = 0.0
        for i in range(m):
            tractions[inside[i]] = pressure[i]
        np.dot(mesh.influence, tractions, gap)
        changed = False
        for i in range(n):
            gap[i] = rhs[i] - response * gap[i]
            if closed[i] and tractions[i] > 0.0:
                closed[i] = False
                changed = True
            elif not closed[i] and gap[i] < 1.0 - tolerance:
                closed[i] = True
                changed = True
        if not changed:
            return True
    return False


@kernel
def hard_edge(radii: np.ndarray, tractions: np.ndarray) -> float:
    """Contact radius: half-way from the last node that presses to the next one; 0 where nothing touches."""
    for j in range(tractions.size - 1, -1, -1):
        if tractions[j] < 0.0:
            return 0.5 * (radii[j] + radii[min(j + 1, radii.size - 1)])
    return 0.0
