"""Equilibrium of the adhesive contact at one instant, by Newton-Raphson in mixed unknowns with a kept factorisation.

The gap h (in h0) at every node satisfies

    F(h) = h + a G sigma(h) - rhs = 0,        rhs = 1 - delta + mu r^2 / 2 - G sigma_remembered,

where G carries the factor mu, sigma is the traction of the law (positive in tension, in dgamma/(mu h0)) and a the
response of the material over the step (`bem.solver.hereditary`). Where surfaces press on each other the gap hardly
moves and the traction does: there the unknown is the traction, elsewhere the gap. In these unknowns the Jacobian
changes little from step to step, so its factorisation is kept until convergence slows. The errors that remain shrink by
nearly the same factor each time, so that each iteration extrapolates the last two (Anderson's method of depth one). Far
away, where the traction has no slope, nodes leave the linear system.

A state is accepted on its residual, which must be small enough that neither the gap nor the force errs by more than
allowed: the stiffer the contact, the more force a residual is worth. It must be stable besides. A change of variables
of positive slope, such as the one from gap to traction where surfaces press, keeps the sign of the determinant, and
iterations with a kept factorisation only converge to states of the same sign (all eigenvalues of the quotient of both
Jacobians lie within 1 of 1, and the extrapolation is bounded). So the sign is known from the last factorisation. At a
fold, where few iterations leave this open, `bem.solver.stepping.trial_step` factorises at the solution itself.
Source: paper, Appendix "BEM discretisation details", Eqs. (LJdisc) to (uzdisc2); Walker and Ni, SIAM J. Numer. Anal. 49
(2011) 1715.
"""

from typing import NamedTuple

import numpy as np

from bem._numerics.jit import kernel, kernel_part
from bem._numerics.linear_algebra import add_rows, copy_into, determinant_is_negative, dot, lu_factor, lu_solve
from bem.solver.pressed import LARGEST_TENSION, changed_gap, pressed_gaps
from bem.solver.work import FACTORISATIONS, ITERATIONS, UNKNOWNS
from bem.tractions import GAP_AT_PEAK, Law, slope_at, tail_force, tail_force_at, traction, traction_at

PRESSED = 1.08  # below this gap (in h0) the traction is the unknown; other laws scale its distance from 1
_MOST_ITERATIONS = 14
_MOST_FACTORISATIONS = 8
_SLOW = 0.8  # refactorise when the residual falls by less; that costs as much as several iterations
_NEGLIGIBLE_SLOPE = 0.01
# Shares of the last change, for errors that shrink by -2/3 to 2/3 each time; further, a state of another sign could be
# reached.
_SMALLEST_SHARE, _LARGEST_SHARE = -2.0, 0.4
_SMALLEST_RESIDUAL = 1e-10  # in h0; rounding leaves less


class Factor(NamedTuple):
    """A kept factorisation of the Jacobian over the first nodes."""

    columns: np.ndarray  # (n, n), see `bem._numerics.linear_algebra`
    pivots: np.ndarray  # (n,) int32
    by_traction: np.ndarray  # (n,) bool: the unknown is the traction
    order: np.ndarray  # (1,) int64: nodes in the linear system; 0 when there is no factorisation
    unstable: np.ndarray  # (1,) bool: the determinant is negative
    stiffness: np.ndarray  # (1,): change of force per uniform change of the residual, in pi R dgamma / h0


@kernel
def new_factor(nodes: int) -> Factor:
    """No factorisation yet, for a mesh of that many nodes."""
    return Factor(
        np.empty((nodes, nodes)),
        np.empty(nodes, dtype=np.int32),
        np.zeros(nodes, dtype=np.bool_),
        np.zeros(1, dtype=np.int64),
        np.zeros(1, dtype=np.bool_),
        np.zeros(1),
    )


@kernel_part
def pressed_below(law: Law) -> float:
    """Gap below which the traction is the unknown."""
    return 1.0 + (PRESSED - 1.0) * law.reach


@kernel
def tractions_of(gap: np.ndarray, tabor: float, law: Law, out: np.ndarray) -> None:
    """Traction of every node into `out`."""
    if law.tabulated:
        for i in range(gap.size):
            out[i] = tabor * traction_at(law, gap[i])
    else:  # a loop without a choice, which the compiler vectorises
        for i in range(gap.size):
            out[i] = tabor * traction(gap[i])


@kernel
def residual_of(
    influence: np.ndarray, gap: np.ndarray, tractions: np.ndarray, response: float, rhs: np.ndarray, out: np.ndarray
) -> None:
    """F(h) = h + a G sigma - rhs of every node into `out` (n,)."""
    for i in range(out.size):
        out[i] = 0.0
    add_rows(influence, tractions, out)
    for i in range(out.size):
        out[i] = gap[i] + response * out[i] - rhs[i]


@kernel
def force_of(weights: np.ndarray, tractions: np.ndarray, gap: np.ndarray, law: Law) -> float:
    """Force P in pi R dgamma, with the closed-form tail beyond the last node."""
    if law.tabulated:
        return dot(weights, tractions) + tail_force_at(law, gap[gap.size - 1])
    return dot(weights, tractions) + tail_force(gap[gap.size - 1])


@kernel
def _nodes_with_slope(influence: np.ndarray, gap: np.ndarray, tabor: float, law: Law, response: float) -> int:
    """Number of inner nodes whose traction answers to the gap enough to enter the linear system."""
    count = gap.size
    while count > 3 and gap[count - 1] > 2.5:
        largest = 0.0
        for i in range(gap.size):
            largest = max(largest, influence[count - 1, i])
        if response * tabor * abs(slope_at(law, gap[count - 1])) * largest > _NEGLIGIBLE_SLOPE:
            break
        count -= 1
    return count


@kernel
def factorise(
    influence: np.ndarray, weights: np.ndarray, gap: np.ndarray, tabor: float, law: Law, response: float, factor: Factor
) -> None:
    """Linearise about `gap` (n,), and judge the stability there."""
    n = gap.size
    order = _nodes_with_slope(influence, gap, tabor, law, response)
    uniform, pressed = np.ones(n), pressed_below(law)
    for j in range(order):
        factor.by_traction[j] = gap[j] < pressed
        stiffness = tabor * slope_at(law, gap[j])
        scale = response if factor.by_traction[j] else response * stiffness
        column, hat = factor.columns[j], influence[j]
        for i in range(order):
            column[i] = scale * hat[i]
        column[j] += 1.0 / stiffness if factor.by_traction[j] else 1.0
    for j in range(order, n):
        factor.by_traction[j] = False
    lu_factor(factor.columns, order, factor.pivots)
    factor.order[0] = order
    factor.unstable[0] = determinant_is_negative(factor.columns, order, factor.pivots)
    lu_solve(factor.columns, order, factor.pivots, uniform)
    change = 0.0
    for j in range(order):
        change += weights[j] * uniform[j] * (1.0 if factor.by_traction[j] else tabor * slope_at(law, gap[j]))
    factor.stiffness[0] = abs(change)


@kernel
def _update(
    gap: np.ndarray,
    tractions: np.ndarray,
    correction: np.ndarray,
    tabor: float,
    law: Law,
    by_traction: np.ndarray,
    wanted: np.ndarray,
    pressed: np.ndarray,
) -> None:
    """Subtract the correction from the unknowns, each kept on the branch of the law on which it was linearised.

    `wanted` and `pressed` (n,) are overwritten.
    """
    inside = 0
    for j in range(gap.size):
        if by_traction[j]:
            inside = j + 1
    for j in range(inside):
        # Where the traction is no unknown, what is found is not used.
        wanted[j] = (tractions[j] - correction[j]) / tabor if by_traction[j] else -1.0
    pressed_gaps(wanted, inside, gap, law, pressed)
    for j in range(gap.size):
        if by_traction[j]:
            if law.tabulated:
                gap[j] = changed_gap(law, gap[j], wanted[j], pressed[j])
            elif wanted[j] > LARGEST_TENSION:
                gap[j] = min(max(gap[j], 1.0) * 1.08, 1.15) if gap[j] < 1.1 else gap[j] * 1.05
            elif gap[j] < 0.98 * GAP_AT_PEAK:
                gap[j] = pressed[j]
            else:
                gap[j] *= 0.95
        else:
            gap[j] += min(max(-correction[j], -0.3 * (gap[j] - law.floor)), 0.5 * gap[j])


@kernel
def anderson_share(residual: np.ndarray, last: np.ndarray) -> float:
    """Share of the last change that Anderson's method takes back, so that the residual, were it linear, is smallest."""
    along, square = 0.0, 0.0
    for i in range(residual.size):
        change = residual[i] - last[i]
        along += residual[i] * change
        square += change * change
    return min(max(along / square, _SMALLEST_SHARE), _LARGEST_SHARE) if square > 0.0 else 0.0


@kernel
def solve_adhesive(
    influence: np.ndarray,
    weights: np.ndarray,
    tabor: float,
    law: Law,
    rhs: np.ndarray,
    response: float,
    tolerance: float,
    force_error: float,
    factor: Factor,
    gap: np.ndarray,
    tractions: np.ndarray,
    work: np.ndarray,
) -> bool:
    """Newton-Raphson from the predicted `gap` (n,), overwritten with `tractions` (n,) by the solution.

    Args:
        tolerance: largest residual allowed, in h0.
        force_error: largest error of the force allowed, in pi R dgamma.
        factor: kept factorisation, used first and refreshed when convergence is slow.
        work: counts as in `bem.solver.work`; iterations, factorisations and unknowns are added to.

    Returns:
        whether a stable state was found within both.
    """
    n = gap.size
    residual, correction, move = np.empty(n), np.empty(n), np.empty(n)
    last_residual, last_correction = np.empty(n), np.empty(n)
    wanted, pressed = np.empty(n), np.empty(n)
    can_extrapolate = False
    previous = np.inf
    refreshed, fresh = 0, False
    for iteration in range(_MOST_ITERATIONS + 1):
        tractions_of(gap, tabor, law, tractions)
        residual_of(influence, gap, tractions, response, rhs, residual)
        worst = 0.0
        for i in range(n):
            worst = max(worst, abs(residual[i]))
            if not abs(residual[i]) < 1e12:
                return False
        known = factor.order[0] > 0
        allowed = min(tolerance, max(force_error / max(factor.stiffness[0], 1e-12), _SMALLEST_RESIDUAL))
        if known and worst < allowed:
            if factor.unstable[0]:  # of an earlier iterate, perhaps not of this state
                factorise(influence, weights, gap, tabor, law, response, factor)
                work[FACTORISATIONS] += 1
            return not factor.unstable[0]
        if iteration == _MOST_ITERATIONS:
            return False
        if not known or (worst > _SLOW * previous and not fresh):
            if refreshed == _MOST_FACTORISATIONS:
                return False
            factorise(influence, weights, gap, tabor, law, response, factor)
            refreshed += 1
            work[FACTORISATIONS] += 1
            fresh, can_extrapolate = True, False
        else:
            fresh = False
        previous = worst
        order = factor.order[0]
        copy_into(correction, residual)
        lu_solve(factor.columns, order, factor.pivots, correction)
        share = anderson_share(residual, last_residual) if can_extrapolate else 0.0
        for i in range(n):
            change = move[i] + correction[i] - last_correction[i] if can_extrapolate else 0.0
            move[i] = correction[i] - share * change
            last_residual[i], last_correction[i] = residual[i], correction[i]
        can_extrapolate = True
        _update(gap, tractions, move, tabor, law, factor.by_traction, wanted, pressed)
        work[ITERATIONS] += 1
        work[UNKNOWNS] += order
    return False
