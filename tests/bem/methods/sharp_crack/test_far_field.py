"""The strains in the contact against the solid's own creep compliance and a fine integration."""

import numpy as np
import pytest

from bem import PronySeries, StandardLinearSolid
from bem.methods.sharp_crack import far_field

SOLIDS = [StandardLinearSolid(0.1), PronySeries([0.5, 0.3, 0.1], [0.1, 1.0, 10.0])]


def held(solid, strains, dt, before, after):
    relaxation = far_field.relaxation_of(np.array(solid.strengths), np.array(solid.times))
    step, out = far_field.new_step(strains.size), np.empty(strains.size)
    far_field.held_step(relaxation, dt, step)
    far_field.hold(step, strains, before, after, out)
    return out


@pytest.mark.parametrize("solid", SOLIDS)
def test_one_long_step_is_many_short_ones(solid):
    strains = 0.3 * np.array(solid.strengths)
    many = strains
    for i in range(1000):
        many = held(solid, many, 2e-3, 1.0 + i / 1000.0, 1.0 + (i + 1) / 1000.0)
    assert held(solid, strains, 2.0, 1.0, 2.0) == pytest.approx(many, rel=1e-9)


@pytest.mark.parametrize("solid", SOLIDS)
def test_a_held_surface_relaxes_to_rest(solid):
    strains = held(solid, np.zeros(len(solid.times)), 1e4, 1.0, 1.0)
    assert strains == pytest.approx(solid.strengths, rel=1e-9)


@pytest.mark.parametrize("solid", SOLIDS)
def test_constant_pull_makes_it_creep(solid):
    """y follows the creep compliance where y in each short step is such that g stays 1."""
    strains, ratio, dt = np.zeros(len(solid.times)), solid.modulus_ratio, 1e-3
    surface = ratio
    for _ in range(1000):
        after = surface
        for _ in range(4):
            after = ratio + held(solid, strains, dt, surface, after).sum()
        strains, surface = held(solid, strains, dt, surface, after), after
    assert surface == pytest.approx(float(solid.creep_compliance(1.0)), rel=1e-4)
