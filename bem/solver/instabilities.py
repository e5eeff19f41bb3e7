"""Jumps: the transition to the next stable equilibrium where a branch ends, at fixed indentation and memory.

Along a history of indentation a branch of equilibria can fold back; beyond the fold no time step, however small, leads
on, and the contact snaps in or off. Pseudo-transient continuation follows dh/ds = -F(h) with implicit steps in the
pseudo-time s, from which every stable equilibrium attracts. The eigenvalues of the Jacobian I + a G diag(sigma') are
real (it is similar to a symmetric matrix), a state is stable when all are positive, and a pseudo-time step is taken
only when it leaves none negative, so the path cannot settle on an unstable branch.
Source: Kelley and Keyes, SIAM J. Numer. Anal. 35 (1998) 508; Greenwood, Proc. R. Soc. A 453 (1997) 1277 on the folds of
this problem.
"""

import numpy as np

from bem._numerics.jit import kernel
from bem._numerics.linear_algebra import copy_into, determinant_is_negative, dot, lu_factor, lu_solve
from bem.solver.equilibrium import residual_of, tractions_of
from bem.solver.work import FACTORISATIONS, ITERATIONS
from bem.tractions import Law, slope_at

_MOST_STEPS = 800
_LARGEST_CHANGE = 0.2  # of the gap, relative, in one pseudo-time step
_SETTLED = 1e4  # pseudo-time step from which a small residual counts as an equilibrium


@kernel
def jacobian(
    influence: np.ndarray, gap: np.ndarray, tabor: float, law: Law, response: float, shift: float, out: np.ndarray
) -> None:
    """The Jacobian I (1 + shift) + a G diag(sigma') into `out`, by columns."""
    n = gap.size
    for j in range(n):
        factor = response * tabor * slope_at(law, gap[j])
        for i in range(n):
            out[j, i] = influence[j, i] * factor
        out[j, j] += 1.0 + shift


@kernel
def settle(
    influence: np.ndarray,
    tabor: float,
    law: Law,
    rhs: np.ndarray,
    response: float,
    tolerance: float,
    gap: np.ndarray,
    tractions: np.ndarray,
    work: np.ndarray,
) -> bool:
    """Follow the pseudo-transient from `gap` (n,) to a stable equilibrium; overwrites `gap` and `tractions`.

    Iterations and factorisations are added to `work` (`bem.solver.work`); returns whether an equilibrium was reached.
    """
    n = gap.size
    residual, correction = np.empty(n), np.empty(n)
    matrix, pivots = np.empty((n, n)), np.empty(n, dtype=np.int32)
    pseudo_step = 1.0
    for _ in range(_MOST_STEPS):
        tractions_of(gap, tabor, law, tractions)
        residual_of(influence, gap, tractions, response, rhs, residual)
        worst = 0.0
        for i in range(n):
            worst = max(worst, abs(residual[i]))
        largest = 0.0
        for _ in range(60):
            jacobian(influence, gap, tabor, law, response, 1.0 / pseudo_step, matrix)
            lu_factor(matrix, n, pivots)
            work[FACTORISATIONS] += 1
            if determinant_is_negative(matrix, n, pivots):
                pseudo_step *= 0.3
                continue
            copy_into(correction, residual)
            lu_solve(matrix, n, pivots, correction)
            largest = 0.0
            for i in range(n):
                largest = max(largest, abs(correction[i]) * min(1.0, 3.0 / gap[i]) / (gap[i] - law.floor))
            if largest < _LARGEST_CHANGE or pseudo_step < 1e-6:
                break
            pseudo_step *= max(0.1, 0.5 * _LARGEST_CHANGE / largest)
        if worst < tolerance and pseudo_step >= _SETTLED:
            return True
        work[ITERATIONS] += 1
        for i in range(n):
            gap[i] = max(gap[i] - correction[i], law.floor + 0.05 * (gap[i] - law.floor))
        pseudo_step = min(pseudo_step * min(3.0, 0.5 * _LARGEST_CHANGE / max(largest, 1e-12)), 1e6)
    return False


@kernel
def is_unstable(influence: np.ndarray, tabor: float, law: Law, response: float, gap: np.ndarray) -> bool:
    """Whether an odd number of eigenvalues of the Jacobian is negative, by a factorisation of its own."""
    n = gap.size
    columns, pivots = np.empty((n, n)), np.empty(n, dtype=np.int32)
    jacobian(influence, gap, tabor, law, response, 0.0, columns)
    lu_factor(columns, n, pivots)
    return determinant_is_negative(columns, n, pivots)


@kernel
def smallest_eigenvalue(influence: np.ndarray, tabor: float, law: Law, response: float, gap: np.ndarray) -> float:
    """Eigenvalue of the Jacobian nearest to zero, by inverse iteration: zero at a fold, positive when stable."""
    n = gap.size
    matrix, pivots = np.empty((n, n)), np.empty(n, dtype=np.int32)
    jacobian(influence, gap, tabor, law, response, 0.0, matrix)
    lu_factor(matrix, n, pivots)
    vector = np.ones(n) / np.sqrt(n)
    value = 0.0
    for _ in range(60):
        image = vector.copy()
        lu_solve(matrix, n, pivots, image)
        inverse = dot(vector, image)
        norm = np.sqrt(dot(image, image))
        for i in range(n):
            vector[i] = image[i] / norm
        converged = abs(1.0 / inverse - value) < 1e-6 * abs(value)
        value = 1.0 / inverse
        if converged:
            break
    return value
