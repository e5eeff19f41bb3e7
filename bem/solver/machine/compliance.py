"""A spring between stage and sphere, and a prescribed force, as one more displacement in the gap equation.

The spring carries the force P of the contact, so that the indentation is delta = stage + P / k: tension pulls the
sphere deeper than the stage says. With P = sum_j w_j sigma_j the gap equation of `bem.solver.equilibrium` keeps its
form,

    h = 1 - stage + mu r^2 / 2 - G sigma_remembered - (a G + 1 w^T / k) sigma:

a spring adds the same elastic displacement at all radii. Newton-Raphson, the pseudo-transient of a jump and the sign of
the determinant then treat contact and spring as a whole; the determinant vanishes where the tangent stiffness of the
contact is -k. The matrix is symmetric in the scalar product of the weights, as before, so its eigenvalues remain real.
The force beyond the last node depends on the gap there; it is linearised about the predicted gap, and its slope counts
with the traction of the last node.

A prescribed force is the same with a numerical spring, fixed anew in each solution to where the sphere is expected:

    P = prescribed + k (delta - delta_expected).

It is so soft that the difference is far below the error of the force, and that a fold of the whole lies where the force
has its maximum (the method of multipliers: Bertsekas, Constrained Optimization and Lagrange Multiplier Methods, 1982).

Units: compliance in h0 per pi R dgamma. Jumps of such systems: Maugis, Contact, Adhesion and Rupture of Elastic Solids
(2000), section 4.2.
"""

from typing import NamedTuple

import numpy as np

from bem._numerics.jit import kernel
from bem.solver.discretisation.mesh import Mesh
from bem.tractions import Law, slope, slope_at, tail_force, tail_force_at, traction, traction_at

_FAR = 1.5  # gap from which the force beyond a node follows the traction at the node


class Machine(NamedTuple):
    """What moves the sphere."""

    compliance: float  # of the spring, 0 for a rigid machine; of the numerical one where the force is prescribed
    by_force: bool  # the protocol prescribes the force instead of the stage
    travel: float  # indentation per unit of what is prescribed, for the length of time steps
    depth_scale: float  # below this the indentation counts as small, in h0


@kernel
def _tail(tabor: float, law: Law, nonadhesive: bool, gap: float) -> tuple[float, float]:
    """The force beyond the last node as a line in the traction there: its value without traction, and its weight."""
    if nonadhesive:
        return 0.0, 0.0
    if law.tabulated:
        stress, stiffness = traction_at(law, gap), tabor * slope_at(law, gap)
        weight = -2.0 * stress / stiffness if gap >= _FAR and stiffness != 0.0 else 0.0
        return tail_force_at(law, gap) - weight * tabor * stress, weight
    if gap < _FAR:
        return tail_force(gap), 0.0
    weight = -2.0 * traction(gap) / (tabor * slope(gap))  # the tail's slope over the gap is -2 sigma / mu
    return tail_force(gap) - weight * tabor * traction(gap), weight


@kernel
def influence_with_spring(
    machine: Machine, mesh: Mesh, tabor: float, law: Law, nonadhesive: bool, response: float, gap: np.ndarray
) -> np.ndarray:
    """The influence matrix (n, n), to be multiplied by `response`, with the spring; `gap` (n,) is near the solution."""
    n = gap.size
    out = np.empty((n, n))
    _, weight = _tail(tabor, law, nonadhesive, gap[n - 1])
    for j in range(n):
        total = mesh.force_weights[j] + (weight if j == n - 1 else 0.0)
        lift, column, rigid = machine.compliance * total / response, out[j], mesh.influence[j]
        for i in range(n):
            column[i] = rigid[i] + lift
    return out


@kernel
def expected_depth(mesh: Mesh, rhs: np.ndarray, response: float, gap: np.ndarray, tractions: np.ndarray) -> float:
    """Indentation (in h0) at which the outermost node has its gap; `rhs` (n,) is that of indentation zero."""
    last = gap.size - 1
    displacement = 0.0
    for j in range(gap.size):
        displacement += mesh.influence[j, last] * tractions[j]
    return rhs[last] - response * displacement - gap[last]


@kernel
def right_side_with_spring(
    machine: Machine,
    mesh: Mesh,
    tabor: float,
    law: Law,
    nonadhesive: bool,
    control: float,
    response: float,
    rhs: np.ndarray,
    gap: np.ndarray,
    tractions: np.ndarray,
) -> np.ndarray:
    """The known part of the gap equation (n,) with the spring, from that of a rigid machine.

    Args:
        machine: not rigid.
        mesh: n nodes.
        tabor, law, nonadhesive: Tabor parameter, traction law, and whether there is no adhesion.
        control: what the protocol prescribes, a displacement of the stage or a force.
        response: of the material over the step.
        rhs: (n,) of a rigid machine at the indentation `control`.
        gap, tractions: (n,) a prediction.
    """
    constant, _ = _tail(tabor, law, nonadhesive, gap[gap.size - 1])
    shift = -machine.compliance * constant
    if machine.by_force:
        shift += control - expected_depth(mesh, rhs + control, response, gap, tractions) + machine.compliance * control
    return rhs + shift


@kernel
def depth_of(
    machine: Machine,
    mesh: Mesh,
    control: float,
    force: float,
    rhs: np.ndarray,
    response: float,
    gap: np.ndarray,
    tractions: np.ndarray,
) -> float:
    """Indentation of the sphere in a solution; arguments as of `right_side_with_spring`, and the force."""
    if machine.by_force:
        return expected_depth(mesh, rhs + control, response, gap, tractions)
    return control + machine.compliance * force


@kernel
def has_flown_off(machine: Machine, control: float, force: float, force_scale: float) -> bool:
    """Whether no contact bears the prescribed tension, so that nothing but the numerical spring holds the sphere.

    A force below a thousandth of `force_scale` is not told from none, except where surfaces without attraction part.
    """
    return machine.by_force and control > 0.0 and (force == 0.0 or force < 0.5 * control - 1e-3 * force_scale)


@kernel
def depth_error(machine: Machine, predicted: float, depth: float) -> float:
    """Difference of two indentations, relative, as it counts for the step: the force grows with the power 3/2."""
    return 1.5 * abs(predicted - depth) / max(abs(depth), machine.depth_scale)
