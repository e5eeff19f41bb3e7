import numpy as np
import pytest

from bem.reference_solutions import jkr
from bem.solver.discretisation.cohesive_zone import (
    CRACK_LENGTH,
    edge_resistance,
    edge_width,
    largest_contact_radius,
)


def test_the_zone_of_a_short_ranged_contact_is_that_of_a_crack():
    assert edge_width(0.0, 100.0, False) == pytest.approx(CRACK_LENGTH / 1e4, rel=0.02)


def test_the_zone_of_a_long_ranged_deep_contact_is_where_the_hertzian_gap_reaches_the_range():
    tabor, radius = 0.05, 1e4
    width = edge_width(radius, tabor, False)
    assert 0.6 * tabor * np.sqrt(radius) * width**1.5 == pytest.approx(1.0, rel=0.01)


def test_without_adhesion_the_zone_is_a_part_of_the_contact():
    assert edge_width(2.0, 1.0, True) == pytest.approx(2.0 * edge_width(1.0, 1.0, True))


@pytest.mark.parametrize("tabor", [0.2, 1.0, 5.0])
@pytest.mark.parametrize("depth", [0.5, 5.0, 100.0])
def test_no_contact_is_larger_than_the_largest(tabor, depth):
    exact = float(jkr.contact_radius_from_indentation(depth, tabor))
    assert exact < largest_contact_radius(depth, tabor, False) < exact + 1.0
    assert largest_contact_radius(depth, tabor, True) == pytest.approx(np.sqrt(depth / tabor))


def test_viscosity_holds_back_an_edge_that_is_fast_in_a_solid_that_creeps():
    def resistance(speed, *strengths):
        return edge_resistance(3.0, 2.0, speed, np.array(strengths), np.ones(len(strengths)))

    assert resistance(1.0) == resistance(0.0, 0.9) == resistance(1e-6, 0.9) == 0.0
    assert resistance(1e3, 0.9) == 1.0
    assert 0.0 < resistance(0.01, 0.9) < resistance(0.1, 0.9) < 1.0
    assert resistance(1e3, 0.1) == pytest.approx(1.0 / 9.0, abs=1e-3)
    assert resistance(0.1, 0.45, 0.45) == pytest.approx(resistance(0.1, 0.9))
