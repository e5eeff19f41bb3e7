import numpy as np
import pytest

from bem.problem.tractions import LENNARD_JONES, ConstantStress, Exponential, law_of, traction, traction_at
from bem.problem.tractions.pressed import LARGEST_TENSION, pressed_gap, pressed_gap_of, pressed_gaps


@pytest.mark.parametrize("gap", [0.02, 0.3, 0.8, 0.999, 1.0, 1.001, 1.1, 1.18])
@pytest.mark.parametrize("off", [0.8, 0.97, 1.0])
def test_the_pressed_gap_inverts_the_law(gap, off):
    assert pressed_gap(traction(gap), off * gap) == pytest.approx(gap, rel=1e-7)


@pytest.mark.parametrize("off", [1.0, 1.002, 0.97, 1.3, 0.6])
def test_pressed_gaps_match_single_ones(off):
    gaps = np.linspace(0.55, 1.07, 9)
    scaled, solved = np.array([traction(gap) for gap in gaps]), np.full(9, np.nan)
    pressed_gaps(scaled, 8, off * gaps, LENNARD_JONES, solved)
    np.testing.assert_allclose(solved[:8], gaps[:8], rtol=1e-7)
    assert np.isnan(solved[8])


def test_excess_tension_is_the_largest():
    solved = np.empty(1)
    pressed_gaps(np.array([5.0]), 1, np.array([1.05]), LENNARD_JONES, solved)
    assert traction(solved[0]) == pytest.approx(LARGEST_TENSION)


@pytest.mark.parametrize("adhesion", [ConstantStress(), Exponential()])
@pytest.mark.parametrize("off", [0.98, 1.0, 1.02])
def test_any_law_is_inverted_where_it_rises(adhesion, off):
    law = law_of(adhesion)
    for scaled in (-1e4, -30.0, -1.0, 0.0, 0.3, 0.9):
        gap = pressed_gap_of(law, scaled, off)
        assert law.floor < gap < law.peak_gap
        assert traction_at(law, gap) == pytest.approx(scaled, rel=1e-6, abs=1e-9)
    assert traction_at(law, pressed_gap_of(law, 5.0, off)) == pytest.approx(LARGEST_TENSION)
    solved = np.empty(2)
    pressed_gaps(np.array([-2.0, 0.5]), 2, np.full(2, off), law, solved)
    assert solved.tolist() == [pressed_gap_of(law, -2.0, off), pressed_gap_of(law, 0.5, off)]
