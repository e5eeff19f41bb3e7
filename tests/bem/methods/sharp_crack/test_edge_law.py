"""The tables of an edge."""

import numpy as np
import pytest

from bem import StandardLinearSolid
from bem.methods.closed_forms import persson_brener
from bem.methods.sharp_crack import edge_tables as tables
from bem.methods.sharp_crack.edge_law import edge_law
from bem.problem.tractions import ConstantStress, LennardJones

SOLID = StandardLinearSolid(0.1)
LAW = edge_law(LennardJones(), SOLID)


def test_an_edge_at_rest_takes_the_work():
    assert tables.aged_toughness(LAW, 0.0, np.inf) == pytest.approx(1.0, abs=1e-3)
    assert tables.closing_toughness(LAW, 0.0) == pytest.approx(1.0, abs=1e-3)


def test_opening_follows_persson_and_brener():
    """Its velocity is in its own length, of which only the scale is free."""
    law = edge_law(ConstantStress(), SOLID)
    gamma = np.array([2.0, 3.0, 5.0, 7.0])
    speed = np.exp(np.interp(gamma, law.opening, law.log_speed))
    ratio = speed / persson_brener.crack_velocity(gamma, 0.1)
    assert ratio.max() / ratio.min() < 1.25


def test_an_edge_that_starts_takes_less():
    runs = [0.0, 0.3, 3.0, 30.0, 300.0, 1e4]
    left = 0.9 * np.sqrt(np.pi)
    work = [tables.started_toughness(LAW, run, left, 0.0) for run in runs]
    assert work[0] < 1.6
    assert work[-1] == pytest.approx(10.0)
    assert np.all(np.diff(work) >= 0.0)


def test_without_strain_it_starts_as_glass():
    assert tables.started_toughness(LAW, 0.0, 0.0, 0.0) == pytest.approx(10.0, rel=1e-2)


@pytest.mark.parametrize("tabor", [100.0, 1000.0])
def test_slow_surfaces_snap_as_elastic_ones(tabor):
    depth = tabor * tables.snap_in_depth(LAW, tabor, 1e-9)
    assert depth == pytest.approx(1.0 - 2.641 * tabor ** (3.0 / 7.0), rel=0.01)


def test_tables_are_kept():
    assert edge_law(LennardJones(), StandardLinearSolid(0.1)) is LAW
