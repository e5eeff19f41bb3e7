import numpy as np
import pytest

from bem.methods.boundary_elements.meshes.cohesive_zone import (
    CRACK_LENGTH,
    edge_resistance,
    edge_width,
    largest_contact_radius,
)
from bem.methods.closed_forms import jkr


def test_short_range_zone_is_a_cracks():
    assert edge_width(0.0, 100.0) == pytest.approx(CRACK_LENGTH / 1e4, rel=0.02)


def test_long_range_zone_is_hertzian():
    tabor, radius = 0.05, 1e4
    width = edge_width(radius, tabor)
    assert 0.6 * tabor * np.sqrt(radius) * width**1.5 == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize("tabor", [0.2, 1.0, 5.0])
@pytest.mark.parametrize("depth", [0.5, 5.0, 100.0])
def test_no_contact_exceeds_the_largest(tabor, depth):
    exact = float(jkr.contact_radius_from_indentation(depth, tabor))
    assert exact < largest_contact_radius(depth, tabor) < exact + 1.0


def test_viscosity_holds_a_fast_edge_back():
    def resistance(speed, *strengths):
        return edge_resistance(3.0, 2.0, speed, np.array(strengths), np.ones(len(strengths)))

    assert resistance(1.0) == resistance(0.0, 0.9) == resistance(1e-6, 0.9) == 0.0
    assert resistance(1e3, 0.9) == 1.0
    assert 0.0 < resistance(0.01, 0.9) < resistance(0.1, 0.9) < 1.0
    assert resistance(1e3, 0.1) == pytest.approx(1.0 / 9.0, abs=1e-3)
    assert resistance(0.1, 0.45, 0.45) == pytest.approx(resistance(0.1, 0.9))
