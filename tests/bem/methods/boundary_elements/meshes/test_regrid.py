import numpy as np
import pytest

from bem.methods.boundary_elements.influence.triangles import force_weights
from bem.methods.boundary_elements.meshes.master_grid import master_grid, widened
from bem.methods.boundary_elements.meshes.regrid import carry, regrid, same_grid
from bem.problem.accuracy import resolve_accuracy

RNG = np.random.default_rng(5)
LAST = 4096


def places(count):
    inner = RNG.choice(np.arange(1, LAST), count, replace=False)
    return np.unique(np.concatenate([[0, LAST], inner]))


def carried(old, values, new):
    out = np.empty(new.size)
    regrid(old, values, new, out)
    return out


PAIRS = [(places(60), places(80)), (np.arange(0, LAST + 1, 64), np.arange(0, LAST + 1, 4)), (places(300), places(20))]


@pytest.mark.parametrize(("old", "new"), PAIRS)
def test_linear_fields_are_exact(old, new):
    np.testing.assert_allclose(carried(old, 3.0 - 0.02 * old, new), 3.0 - 0.02 * new, rtol=1e-11, atol=1e-11)


def test_nodes_left_out_hand_on_their_force():
    fine = places(400)
    coarse = np.unique(np.concatenate([[0, LAST], RNG.choice(fine, 40)]))
    values = np.where(np.isin(fine, coarse), 0.0, RNG.standard_normal(fine.size))
    moved = carried(fine, values, coarse)
    expected = force_weights(fine.astype(float)) @ values
    assert force_weights(coarse.astype(float)) @ moved == pytest.approx(expected, rel=1e-11)
    assert np.abs(moved).max() > 0.01


def test_a_cubic_keeps_its_values_where_nodes_go():
    fine, coarse = np.arange(0, LAST + 1, 16), np.arange(0, LAST + 1, 64)
    np.testing.assert_allclose(carried(fine, (fine / LAST) ** 3, coarse), (coarse / LAST) ** 3, atol=1e-12)


def test_new_nodes_stay_below_neighbours():
    coarse = places(40)
    fine = np.unique(np.concatenate([coarse, places(500)]))
    values = RNG.standard_normal(coarse.size)
    moved = carried(coarse, values, fine)
    panel = np.clip(np.searchsorted(coarse, fine, side="right") - 1, 0, coarse.size - 2)
    low, high = np.minimum(values[panel], values[panel + 1]), np.maximum(values[panel], values[panel + 1])
    assert np.all((moved >= low - 1e-12) & (moved <= high + 1e-12))


def test_smooth_fields_lose_little():
    coarse, fine = np.arange(0, LAST + 1, 64), np.arange(0, LAST + 1, 8)
    moved = carried(coarse, np.exp(-coarse / 400.0), fine)
    line = np.interp(fine, coarse, np.exp(-coarse / 400.0))
    error, by_line = (np.abs(field - np.exp(-fine / 400.0))[64:-64].max() for field in (moved, line))
    assert error < 0.1 * by_line


def test_the_same_nodes_keep_everything():
    nodes = places(50)
    values = RNG.standard_normal(nodes.size)
    np.testing.assert_array_equal(carried(nodes, values, nodes), values)


@pytest.mark.parametrize("peak", [10.0, 10.6])
def test_halving_keeps_nodes_and_fields(peak):
    grid = master_grid(1.0, peak, resolve_accuracy("standard").controls())
    fine, wide = widened(grid)
    assert (fine.spacing, wide.spacing) == (grid.spacing, 2.0 * grid.spacing)
    assert grid.size <= fine.size <= grid.size + 1
    assert fine.spacing * fine.places[-1] == wide.spacing * wide.places[-1]
    assert len(fine.unit_influence) >= fine.size
    assert not same_grid(fine, wide)
    values, exact = (np.cos(20.0 * mesh_grid.places * mesh_grid.spacing / fine.size) for mesh_grid in (wide, fine))
    moved = np.empty(fine.size)
    carry(wide, values, fine, moved)
    np.testing.assert_array_equal(moved[::2], values)
    np.testing.assert_allclose(moved[:-2], exact[:-2], atol=1e-4)
