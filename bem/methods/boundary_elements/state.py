"""The contact at one instant: gap and traction on a mesh, and their transfer from one selection of nodes to the next.

The smooth quantity is interpolated: the traction where surfaces press on each other, the gap elsewhere (see
`bem.methods.boundary_elements.equilibrium`), both by the cubic through four nodes. The memory needs no transfer, it
lives on the master grid.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.boundary_elements.meshes.cohesive_zone import contact_edge, nonadhesive_edge
from bem.methods.boundary_elements.meshes.mesh import Mesh
from bem.methods.boundary_elements.meshes.regrid import cubic
from bem.methods.records import Records, with_room
from bem.problem.tractions import Interface, deviation, force_of, stored_energy, traction_at
from bem.problem.tractions.pressed import pressed_below, pressed_gap_of


class State(NamedTuple):
    """An equilibrium."""

    mesh: Mesh
    depth: float  # indentation of the sphere
    gap: np.ndarray  # (n,)
    traction: np.ndarray  # (n,)
    force: float  # in pi R dgamma, tension positive
    edge: float  # contact radius in beta; 0 where nothing touches


@kernel
def state_of(interface: Interface, mesh: Mesh, depth: float, gap: np.ndarray, traction: np.ndarray) -> State:
    """The state with this gap and traction; without adhesion there is no far field beyond the mesh."""
    force = force_of(interface, mesh.force_weights, gap, traction)
    if interface.nonadhesive:
        edge = nonadhesive_edge(mesh.radii, traction)
    else:
        edge = contact_edge(mesh.radii, gap, interface.law.peak_gap)
    return State(mesh, depth, gap, traction, force, edge)


@kernel
def energy_of(interface: Interface, state: State) -> float:
    """Energy stored in an elastic contact, in h0 pi R dgamma."""
    mesh = state.mesh
    return stored_energy(interface, mesh.radii, mesh.force_weights, state.depth, state.gap, state.traction)


@kernel
def with_profile(records: Records, state: State) -> Records:
    """The records with the profile of one more state."""
    filled, profiles = records.filled, records.profiles
    for i in range(state.gap.size):
        profiles = with_room(profiles, filled[2])
        row = profiles[filled[2]]
        row["number"], row["indentation"], row["force"] = filled[3], state.depth, state.force
        row["radius"], row["gap"], row["traction"] = state.mesh.radii[i], state.gap[i], state.traction[i]
        filled[2] += 1
    filled[3] += 1
    return Records(records.states, records.jumps, profiles, filled)


@kernel
def edge_left_window(state: State) -> bool:
    """Whether the mesh must follow."""
    window = state.mesh.window
    return state.edge < window[0] or state.edge > window[1]


@kernel
def transfer(
    interface: Interface,
    old: Mesh,
    gap: np.ndarray,
    tractions: np.ndarray,
    new: Mesh,
    new_gap: np.ndarray,
    new_traction: np.ndarray,
) -> None:
    """Gap and traction at the new nodes into `new_gap` and `new_traction` (n_new,).

    Beyond the old mesh the sphere is undeformed and carries nothing.
    """
    tabor, law = interface.tabor, interface.law
    n, below = old.radii.size, pressed_below(law)
    k = 0
    for i in range(new.radii.size):
        x = new.radii[i]
        if x > old.radii[n - 1]:
            new_gap[i] = gap[n - 1] + 0.5 * tabor * (x * x - old.radii[n - 1] ** 2)
            new_gap[i] += deviation(interface, x) - deviation(interface, old.radii[n - 1])
            new_traction[i] = tabor * traction_at(law, new_gap[i])
            continue
        while k < n - 2 and old.radii[k + 1] < x:
            k += 1
        if x == old.radii[k + 1]:
            new_gap[i], new_traction[i] = gap[k + 1], tractions[k + 1]
            continue
        share = (x - old.radii[k]) / (old.radii[k + 1] - old.radii[k])
        first = max(0, min(k - 1, n - 4))
        if gap[k] < below and gap[k + 1] < below:
            if max(max(gap[first], gap[first + 1]), max(gap[first + 2], gap[first + 3])) < below:
                stress = cubic(old.radii, tractions, first, x)
            else:
                stress = tractions[k] + share * (tractions[k + 1] - tractions[k])
            new_gap[i] = pressed_gap_of(law, stress / tabor, gap[k] + share * (gap[k + 1] - gap[k]))
        else:
            low, high = min(gap[k], gap[k + 1]), max(gap[k], gap[k + 1])
            margin = 0.1 * (high - low)
            new_gap[i] = min(max(cubic(old.radii, gap, first, x), low - margin), high + margin)
        new_traction[i] = tabor * traction_at(law, new_gap[i])
