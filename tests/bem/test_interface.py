"""The energy of an interface changes by the work of its force."""

import numpy as np
import pytest

from bem.discretisation.mesh import fixed_mesh, uniform_mesh
from bem.solver.equilibrium import solve_nonadhesive
from bem.solver.jumps import settle
from bem.solver.work import new_work
from bem.tractions import force_of, stored_energy, tail_force
from tests.bem.solver.contacts import lennard_jones, mesh_for, right_side

TABOR, DEPTH, CHANGE = 1.0, 1.0, 1e-3


@pytest.mark.parametrize("nonadhesive", [False, True])
def test_the_energy_changes_by_the_work_of_the_force(nonadhesive):
    interface = lennard_jones(TABOR, nonadhesive)
    _, mesh = mesh_for(TABOR, edge=1.0, peak=2.0)
    if nonadhesive:
        mesh = fixed_mesh(TABOR, uniform_mesh(2.0, 120), False)
    energies, forces = [], []
    for depth in (DEPTH - CHANGE, DEPTH, DEPTH + CHANGE):
        rhs, work = right_side(mesh, TABOR, depth), new_work()
        gap, traction = np.maximum(rhs, 0.95), np.zeros(rhs.size)
        if nonadhesive:
            assert solve_nonadhesive(mesh.influence, rhs, 1.0, gap, traction, work)
        else:
            assert settle(interface, mesh.influence, rhs, 1.0, 1e-9, gap, traction, work)
        energies.append(stored_energy(interface, mesh.radii, mesh.force_weights, depth, gap, traction))
        forces.append(force_of(interface, mesh.force_weights, gap, traction))
    assert (energies[2] - energies[0]) / (2.0 * CHANGE) == pytest.approx(-forces[1], rel=5e-3)
    tail = 0.0 if nonadhesive else tail_force(gap[-1])
    assert forces[2] == pytest.approx(mesh.force_weights @ traction + tail, rel=1e-12)
