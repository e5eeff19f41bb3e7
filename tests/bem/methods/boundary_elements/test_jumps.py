import numpy as np
import pytest
from scipy.optimize import brentq

from bem.methods.boundary_elements.jumps import settle, smallest_eigenvalue
from bem.methods.boundary_elements.meshes.master_grid import master_grid
from bem.methods.boundary_elements.meshes.mesh import Mesh, condense
from bem.methods.records import new_work
from bem.problem.accuracy import resolve_accuracy
from bem.problem.tractions import slope
from tests.bem.methods.contacts import lennard_jones, right_side

TABOR = 3.0
LJ = lennard_jones(TABOR)
JUMP_IN, JUMP_OUT = -3.228, -4.988  # indentations at which the elastic branches at this Tabor parameter end


def settled(indentation, gap, mesh):
    gap, tractions = gap.copy(), np.zeros(gap.size)
    rhs = right_side(mesh, TABOR, indentation)
    stable = settle(LJ, mesh.influence, rhs, 1.0, 1e-6, gap, tractions, new_work())
    assert stable
    residual = gap + mesh.influence.T @ tractions - rhs
    assert np.max(np.abs(residual)) < 1e-6
    return gap


def jacobian(mesh: Mesh, gap: np.ndarray, response: float) -> np.ndarray:
    slopes = np.array([slope(h) for h in gap])
    return np.eye(gap.size) + response * TABOR * mesh.influence.T * slopes


@pytest.fixture(scope="module")
def mesh():
    """Every node of a coarse grid, since the edge goes everywhere."""
    grid = master_grid(TABOR, 1.0, resolve_accuracy("draft").controls(0.0))
    nodes = np.arange(grid.size)
    return condense(grid, TABOR, nodes, np.zeros(2), False)


@pytest.fixture(scope="module")
def both(mesh):
    """The open and the closed state at one indentation between the folds."""
    middle = 0.5 * (JUMP_IN + JUMP_OUT)
    far = right_side(mesh, TABOR, middle)
    touching = settled(0.0, np.maximum(right_side(mesh, TABOR, 0.0), 0.95), mesh)
    return settled(middle, far, mesh), settled(middle, touching, mesh)


def test_two_states_between_the_folds(mesh, both):
    opened, closed = both
    assert opened[0] > 2.0
    assert closed[0] < 1.2
    for gap in both:
        assert np.min(np.linalg.eigvals(jacobian(mesh, gap, 1.0)).real) > 0.0
        assert smallest_eigenvalue(LJ, mesh.influence, gap, 1.0) > 0.0


def test_one_state_attracts_beyond_the_folds(mesh, both):
    opened, closed = both
    assert settled(JUMP_IN + 0.1, opened, mesh)[0] < 1.2
    assert settled(JUMP_OUT - 0.1, closed, mesh)[0] > 2.0
    assert settled(JUMP_IN - 0.1, opened, mesh)[0] > 1.5
    assert settled(JUMP_OUT + 0.1, closed, mesh)[0] < 1.3


@pytest.mark.parametrize("response", [1.0, 0.1])
def test_eigenvalue_is_the_nearest_to_zero(mesh, both, response):
    for gap in both:
        values = np.linalg.eigvals(jacobian(mesh, gap, response)).real
        nearest = values[np.argmin(np.abs(values))]
        assert smallest_eigenvalue(LJ, mesh.influence, gap, response) == pytest.approx(nearest, rel=5e-3)


def test_unstable_state_has_negative_one(mesh, both):
    opened, closed = both

    def lowest(shift):
        mixed = closed + shift * (opened - closed)
        return np.min(np.linalg.eigvals(jacobian(mesh, mixed, 1.0)).real)

    # on the way from one stable state to the other a direction turns unstable
    shift = brentq(lambda shift: lowest(shift) + 0.01, 0.0, 0.2, xtol=1e-6)
    unstable = closed + shift * (opened - closed)
    assert smallest_eigenvalue(LJ, mesh.influence, unstable, 1.0) == pytest.approx(lowest(shift), rel=1e-2)
