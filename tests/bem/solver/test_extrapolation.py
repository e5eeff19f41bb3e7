import numpy as np
import pytest

from bem.solver.extrapolation import Scales, expected_force, predict, prediction_error, push_recent, start_recent
from bem.tractions import PEAK_TRACTION, traction
from tests.bem.solver.contacts import mesh_for, right_side

TABOR = 2.0


def history(gaps, tractions, times):
    recent = start_recent(gaps[0], tractions[0], times[0], 1.0 + times[0])
    for gap, stress, time in zip(gaps[1:], tractions[1:], times[1:], strict=True):
        push_recent(recent, gap, stress, time, 1.0 + time)
    return recent


def predicted(recent, time, nonadhesive=False):
    gap, stress = np.empty(recent.gap.shape[1]), np.empty(recent.gap.shape[1])
    predict(recent, time, TABOR, nonadhesive, gap, stress)
    return gap, stress


def law(gap):
    return TABOR * np.array([traction(h) for h in gap])


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_open_gaps_are_extrapolated_by_the_polynomial_through_all_solutions(degree):
    coefficients = np.array([[2.0, 0.3, -0.05], [5.0, -0.2, 0.1]])[:, : degree + 1]

    def exact(time):
        return coefficients @ float(time) ** np.arange(degree + 1)

    times = [0.0, 0.7, 1.1][: degree + 1]
    gaps = [exact(t) for t in times]
    gap, stress = predicted(history(gaps, [law(g) for g in gaps], times), 1.5)
    np.testing.assert_allclose(gap, exact(1.5), rtol=1e-12)
    np.testing.assert_allclose(stress, law(gap), rtol=1e-12)


def test_pressed_nodes_are_extrapolated_in_traction():
    pressures = [np.array([-1.0 - 3.0 * t + 0.5 * t * t]) for t in (0.0, 1.0, 1.5)]
    gaps = [np.array([0.9])] * 3
    gap, stress = predicted(history(gaps, pressures, [0.0, 1.0, 1.5]), 2.0)
    assert stress[0] == pytest.approx(-5.0, rel=1e-6)
    assert law(gap)[0] == pytest.approx(-5.0, rel=1e-6)


def test_a_pressed_node_pulled_beyond_the_law_is_let_go():
    tensions = [np.array([0.0]), np.array([TABOR * PEAK_TRACTION])]
    gap, _ = predicted(history([np.array([1.0])] * 2, tensions, [0.0, 1.0]), 2.0)
    assert 1.1 < gap[0] < 1.2


def test_a_wild_extrapolation_is_held_back():
    gap, _ = predicted(history([np.array([4.0]), np.array([2.0])], [law([4.0]), law([2.0])], [0.0, 1.0]), 3.0)
    assert gap[0] == pytest.approx(0.7 * 2.0)


def test_hard_contact_never_predicts_penetration_or_tension():
    gaps, stresses = [np.array([1.5, 1.0]), np.array([1.1, 1.0])], [np.array([0.0, -2.0]), np.array([0.0, -1.0])]
    gap, stress = predicted(history(gaps, stresses, [0.0, 1.0]), 4.0, nonadhesive=True)
    np.testing.assert_array_equal(gap, [1.0, 1.0])
    np.testing.assert_array_equal(stress, [0.0, 0.0])


def test_only_the_last_three_solutions_are_kept():
    gaps = [np.array([100.0]), *(np.array([2.0 + 0.1 * t]) for t in (1.0, 2.0, 3.0))]
    recent = history(gaps, [law(g) for g in gaps], [0.0, 1.0, 2.0, 3.0])
    assert recent.count[0] == 3
    assert predicted(recent, 4.0)[0][0] == pytest.approx(2.4)


def error_of(changed_node, change):
    _, mesh = mesh_for(TABOR, edge=0.0, peak=1.0)
    gap = np.maximum(right_side(mesh, TABOR, -1.0), 1.2)
    guess = gap.copy()
    guess[changed_node] *= 1.0 + change
    return prediction_error(mesh.force_weights, TABOR, False, guess, law(guess), gap, law(gap), Scales(1.0), np.nan)


def test_the_error_is_relative_and_forgives_the_far_field():
    assert error_of(0, 0.0) == 0.0
    assert error_of(0, 1e-3) == pytest.approx(1e-3, rel=0.1)
    assert error_of(0, 2e-3) == pytest.approx(2.0 * error_of(0, 1e-3), rel=0.01)
    assert 0.0 < error_of(-1, 1e-3) < 0.1 * error_of(0, 1e-3)


def test_the_expected_force_is_the_polynomial_through_the_last_ones():
    gap = np.array([2.0])
    recent = start_recent(gap, law(gap), 0.0, 1.0)
    assert expected_force(recent, 5.0) == 1.0
    for time in (1.0, 2.0):
        push_recent(recent, gap, law(gap), time, 1.0 + time**2)
    assert expected_force(recent, 4.0) == pytest.approx(17.0)
