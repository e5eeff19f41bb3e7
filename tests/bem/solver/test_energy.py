"""The stored energy changes by the work of the force."""

import numpy as np
import pytest

from bem.solver.energy import stored_energy
from bem.solver.equilibrium import force_of
from bem.solver.instabilities import settle
from bem.solver.nonadhesive import solve_nonadhesive
from bem.solver.work import new_work
from bem.tractions import LENNARD_JONES as LAW
from tests.bem.solver.contacts import mesh_for, right_side

TABOR, DEPTH, CHANGE = 1.0, 1.0, 1e-3


def adhesive(mesh, depth):
    rhs = right_side(mesh, TABOR, depth)
    gap, traction = np.maximum(rhs, 0.95), np.zeros(rhs.size)
    assert settle(mesh.influence, TABOR, LAW, rhs, 1.0, 1e-9, gap, traction, new_work())
    return gap, traction, force_of(mesh.force_weights, traction, gap, LAW)


def nonadhesive(mesh, depth):
    gap, traction = np.zeros(mesh.radii.size), np.zeros(mesh.radii.size)
    assert solve_nonadhesive(mesh.influence, right_side(mesh, TABOR, depth), 1.0, gap, traction, new_work())
    return gap, traction, mesh.force_weights @ traction


@pytest.mark.parametrize("solve", [adhesive, nonadhesive])
def test_the_energy_changes_by_the_work_of_the_force(solve):
    without_adhesion = solve is nonadhesive
    _, mesh = mesh_for(TABOR, edge=1.0, peak=2.0, nonadhesive=without_adhesion)
    energies, forces = [], []
    for depth in (DEPTH - CHANGE, DEPTH, DEPTH + CHANGE):
        gap, traction, force = solve(mesh, depth)
        energies.append(
            stored_energy(mesh.radii, mesh.force_weights, TABOR, LAW, without_adhesion, depth, gap, traction)
        )
        forces.append(force)
    assert (energies[2] - energies[0]) / (2.0 * CHANGE) == pytest.approx(-forces[1], rel=5e-3)
