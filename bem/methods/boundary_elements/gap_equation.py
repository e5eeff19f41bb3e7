"""The gap equation of contact and loading device: its right side, its matrix, and the indentation in a solution.

A spring between stage and sphere carries the force P of the contact, so that the indentation is delta = stage + P / k:
tension pulls the sphere deeper than the stage says. With P = sum_j w_j sigma_j the gap equation of
`bem.methods.boundary_elements.equilibrium` keeps its form,

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

Units: as in `bem.methods.boundary_elements.equilibrium`. `control` is what the protocol prescribes: the indentation,
the displacement of the stage, or the force. Jumps of such systems: Maugis, Contact, Adhesion and Rupture of Elastic
Solids (2000), section 4.2.
"""

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import add_rows
from bem.methods.boundary_elements.discrete_problem import LoadingDevice, Problem
from bem.methods.boundary_elements.meshes.mesh import Mesh
from bem.methods.boundary_elements.meshes.regrid import Remembered
from bem.methods.boundary_elements.state import State, state_of
from bem.problem.tractions import Interface, deviation, slope_at, tail_force_at, tail_share, traction_at

_FAR = 1.5  # gap from which the force beyond a node follows the traction at the node


@kernel
def rigid_side(interface: Interface, mesh: Mesh, depth: float, remembered: Remembered) -> np.ndarray:
    """1 - delta + mu r^2 / 2 - G sigma_remembered, the known part of the gap equation at an indentation; (n,)."""
    tabor, rigid = interface.tabor, np.zeros(mesh.radii.size)
    if remembered.traction.size > 0:
        add_rows(mesh.master_rows, remembered.traction, rigid)
    for i in range(rigid.size):
        rigid[i] = 1.0 - depth + 0.5 * tabor * mesh.radii[i] ** 2 - rigid[i] + deviation(interface, mesh.radii[i])
    return rigid


@kernel
def tail_line(interface: Interface, gap: float) -> tuple[float, float]:
    """The force beyond the last node as a line in the traction there: its value without traction, and its weight."""
    if interface.nonadhesive:
        return 0.0, 0.0
    law, share = interface.law, tail_share(interface, interface.reach, gap)
    stress, stiffness = traction_at(law, gap), interface.tabor * slope_at(law, gap)
    weight = -2.0 * share * stress / stiffness if gap >= _FAR and stiffness != 0.0 else 0.0
    return share * tail_force_at(law, gap) - weight * interface.tabor * stress, weight


@kernel
def influence_of(problem: Problem, mesh: Mesh, response: float, gap: np.ndarray) -> np.ndarray:
    """The matrix (n, n), to be multiplied by `response`, of contact and spring; `gap` (n,) is near the solution."""
    if problem.device.compliance == 0.0:
        return mesh.influence
    n = gap.size
    out = np.empty((n, n))
    _, weight = tail_line(problem.interface, gap[n - 1])
    for j in range(n):
        total = mesh.force_weights[j] + (weight if j == n - 1 else 0.0)
        lift, column, rigid = problem.device.compliance * total / response, out[j], mesh.influence[j]
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
def right_side(
    problem: Problem,
    mesh: Mesh,
    control: float,
    response: float,
    rigid: np.ndarray,
    gap: np.ndarray,
    tractions: np.ndarray,
) -> np.ndarray:
    """The known part of the gap equation (n,) of contact and loading device.

    Args:
        problem: the scene, discretised.
        mesh: n nodes.
        control: what the protocol prescribes.
        response: of the material over the step.
        rigid: (n,) of `rigid_side` at the indentation `control`.
        gap, tractions: (n,) a prediction.
    """
    device = problem.device
    if device.compliance == 0.0:
        return rigid
    constant, _ = tail_line(problem.interface, gap[gap.size - 1])
    shift = -device.compliance * constant
    if device.by_force:
        shift += control - expected_depth(mesh, rigid + control, response, gap, tractions) + device.compliance * control
    return rigid + shift


@kernel
def state_under(
    problem: Problem, mesh: Mesh, control: float, remembered: Remembered, gap: np.ndarray, traction: np.ndarray
) -> State:
    """The state with this gap and traction (n,), a solution under `control`."""
    state, device = state_of(problem.interface, mesh, control, gap, traction), problem.device
    if device.compliance == 0.0:
        return state
    depth = control + device.compliance * state.force
    if device.by_force:
        rigid = rigid_side(problem.interface, mesh, control, remembered)
        depth = expected_depth(mesh, rigid + control, remembered.response, gap, traction)
    return State(mesh, depth, gap, traction, state.force, state.edge)


@kernel
def is_balanced(problem: Problem, state: State, control: float, remembered: Remembered) -> bool:
    """Whether an equilibrium behind a spring or under a force agrees with what it was linearised about."""
    if problem.device.by_force:
        return abs(state.force - control) <= 0.1 * problem.force_error * max(abs(control), problem.scales.force)
    rigid = rigid_side(problem.interface, state.mesh, 0.0, remembered)
    expected = expected_depth(state.mesh, rigid, remembered.response, state.gap, state.traction)
    return abs(state.depth - expected) <= 4.0 * problem.controls.residual


@kernel
def has_flown_off(problem: Problem, control: float, force: float) -> bool:
    """Whether no contact bears the prescribed tension, so that nothing but the numerical spring holds the sphere.

    A force below a thousandth of its scale is not told from none, except where surfaces without attraction part.
    """
    small = 1e-3 * problem.scales.force
    return problem.device.by_force and control > 0.0 and (force == 0.0 or force < 0.5 * control - small)


@kernel
def depth_error(device: LoadingDevice, predicted: float, depth: float) -> float:
    """Difference of two indentations, relative, as it counts for the step: the force grows with the power 3/2."""
    return 1.5 * abs(predicted - depth) / max(abs(depth), device.depth_scale)
