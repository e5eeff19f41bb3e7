"""Equilibrium of the adhesive contact at one instant, by Newton-Raphson in mixed unknowns with a kept factorisation.

The gap h (in h0) at every node satisfies

    F(h) = h + a G sigma(h) - rhs = 0,        rhs = 1 - delta + mu r^2 / 2 - G sigma_remembered,

where G carries the factor mu, sigma is the traction of the law (positive in tension, in dgamma/(mu h0)) and a the
response of the material over the step (`bem.methods.boundary_elements.memory`). Where surfaces press on each other the
gap hardly moves and the traction does: there the unknown is the traction, elsewhere the gap. In these unknowns the
Jacobian changes little from step to step, so its factorisation is kept until convergence slows. The errors that remain
shrink by nearly the same factor each time, so that each iteration extrapolates the last two (Anderson's method of depth
one). Far away, where the traction has no slope, nodes leave the linear system.

A state is accepted on its residual, which must be small enough that neither the gap nor the force errs by more than
allowed: the stiffer the contact, the more force a residual is worth. It must be stable besides. A change of variables
of positive slope, such as the one from gap to traction where surfaces press, keeps the sign of the determinant, and
iterations with a kept factorisation only converge to states of the same sign (all eigenvalues of the quotient of both
Jacobians lie within 1 of 1, and the extrapolation is bounded). So the sign is known from the last factorisation. At a
fold, where few iterations leave this open, `bem.methods.boundary_elements.trial_step` factorises at the solution
itself.

Without adhesion, on a mesh of one's own, surfaces neither pass through each other nor attract: at every node
h >= 1, sigma <= 0 and (h - 1) sigma = 0. An active-set Newton iteration solves the linear system of the closed nodes
only, releases those that would pull and adds those that would pass through, until neither is left (Johnson, Contact
Mechanics, 1985, section 5.9).
Source: paper, Appendix "BEM discretisation details", Eqs. (LJdisc) to (uzdisc2); Walker and Ni, SIAM J. Numer. Anal. 49
(2011) 1715.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import add_rows, copy_into, determinant_is_negative, lu_factor, lu_solve
from bem.methods.records import count_factorisation, count_iteration
from bem.problem.tractions import Interface, slope_at, tractions_of
from bem.problem.tractions.pressed import changed_gap, pressed_below, pressed_gaps

_MOST_ITERATIONS = 14
_MOST_FACTORISATIONS = 8
_SLOW = 0.8  # refactorise when the residual falls by less; that costs as much as several iterations
_NEGLIGIBLE_SLOPE = 0.01
# Shares of the last change, for errors that shrink by -2/3 to 2/3 each time; further, a state of another sign could be
# reached.
_SMALLEST_SHARE, _LARGEST_SHARE = -2.0, 0.4
_SMALLEST_RESIDUAL = 1e-10  # in h0; rounding leaves less
_MOST_ACTIVE_SETS = 100
# In h0, of what the gap is made of. Not an accuracy: a node left open although it is pressed costs force, far more of
# it in a stiff solid.
_PASSED_THROUGH = 1e-11


class Factor(NamedTuple):
    """A kept factorisation of the Jacobian over the first nodes."""

    columns: np.ndarray  # (n, n), see `bem._support.linear_algebra`
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


@kernel
def residual_of(
    influence: np.ndarray, gap: np.ndarray, tractions: np.ndarray, response: float, rhs: np.ndarray, out: np.ndarray
) -> None:
    """F(h) = h + a G sigma - rhs of every node into `out` (n,)."""
    out[:] = 0.0
    add_rows(influence, tractions, out)
    for i in range(out.size):
        out[i] = gap[i] + response * out[i] - rhs[i]


@kernel
def _nodes_with_slope(interface: Interface, influence: np.ndarray, gap: np.ndarray, response: float) -> int:
    """Number of inner nodes whose traction answers to the gap enough to enter the linear system."""
    count = gap.size
    while count > 3 and gap[count - 1] > 2.5:
        largest = np.max(influence[count - 1])
        if response * interface.tabor * abs(slope_at(interface.law, gap[count - 1])) * largest > _NEGLIGIBLE_SLOPE:
            break
        count -= 1
    return count


@kernel
def factorise(
    interface: Interface,
    influence: np.ndarray,
    weights: np.ndarray,
    gap: np.ndarray,
    response: float,
    factor: Factor,
    work: np.ndarray,
) -> None:
    """Linearise about `gap` (n,), and judge the stability there."""
    n, tabor, law = gap.size, interface.tabor, interface.law
    order = _nodes_with_slope(interface, influence, gap, response)
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
    count_factorisation(work, order)


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
    interface: Interface,
    influence: np.ndarray,
    weights: np.ndarray,
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
        work: counts as in `bem.methods.records`; iterations, factorisations and unknowns are added to.

    Returns:
        whether a stable state was found within both.
    """
    n, law = gap.size, interface.law
    residual, correction, move = np.empty(n), np.empty(n), np.empty(n)
    last_residual, last_correction = np.empty(n), np.empty(n)
    scaled_traction, pressed = np.empty(n), np.empty(n)
    can_extrapolate = False
    previous = np.inf
    refreshed, fresh = 0, False
    for iteration in range(_MOST_ITERATIONS + 1):
        tractions_of(interface, gap, tractions)
        residual_of(influence, gap, tractions, response, rhs, residual)
        worst = np.max(np.abs(residual))
        if not worst < 1e12:
            return False
        factorised = factor.order[0] > 0
        allowed = min(tolerance, max(force_error / max(factor.stiffness[0], 1e-12), _SMALLEST_RESIDUAL))
        if factorised and worst < allowed:
            if factor.unstable[0]:  # of an earlier iterate, perhaps not of this state
                factorise(interface, influence, weights, gap, response, factor, work)
            return not factor.unstable[0]
        if iteration == _MOST_ITERATIONS:
            return False
        if not factorised or (worst > _SLOW * previous and not fresh):
            if refreshed == _MOST_FACTORISATIONS:
                return False
            factorise(interface, influence, weights, gap, response, factor, work)
            refreshed += 1
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
        # Each unknown is kept on the branch of the law on which it was linearised.
        inside = 0
        for j in range(n):
            if factor.by_traction[j]:
                inside = j + 1
        for j in range(inside):
            # Where the traction is no unknown, what is found is not used.
            scaled_traction[j] = (tractions[j] - move[j]) / interface.tabor if factor.by_traction[j] else -1.0
        pressed_gaps(scaled_traction, inside, gap, law, pressed)
        for j in range(n):
            if factor.by_traction[j]:
                gap[j] = changed_gap(law, gap[j], scaled_traction[j], pressed[j])
            else:
                gap[j] += min(max(-move[j], -0.3 * (gap[j] - law.floor)), 0.5 * gap[j])
        count_iteration(work, n, order)
    return False


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

    `work` as in `bem.methods.boundary_elements.equilibrium.solve_adhesive`; returns whether no node passes through or
    pulls, up to rounding.
    """
    n = gap.size
    # The prediction differs from the contact by a node or two at its edge. The overlap of the undeformed surfaces, used
    # where nothing touched before, is far larger.
    closed = np.empty(n, dtype=np.bool_)
    touching = False
    for i in range(n):
        closed[i] = tractions[i] < 0.0
        touching = touching or closed[i]
    pivots, pressure, columns = np.empty(n, dtype=np.int32), np.empty(n), np.empty((n, n))
    for _ in range(_MOST_ACTIVE_SETS):
        for i in range(n):
            if not touching:
                closed[i] = rhs[i] < 1.0
            tractions[i], gap[i] = 0.0, 0.0
        touching = True
        inside = np.flatnonzero(closed)
        m = inside.size
        for j in range(m):
            pressure[j] = rhs[inside[j]] - 1.0
            for i in range(m):
                columns[j, i] = response * influence[inside[j], inside[i]]
        if m > 0:
            lu_factor(columns, m, pivots)
            lu_solve(columns, m, pivots, pressure)
        count_iteration(work, n, m)
        count_factorisation(work, m)
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
