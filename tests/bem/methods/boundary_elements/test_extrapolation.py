import numpy as np
import pytest

from bem.methods.boundary_elements.extrapolation import (
    DEPTH,
    Scales,
    bend_of_force,
    expected_force,
    history_error,
    predict,
    prediction_error,
    push_recent,
    start_recent,
)
from bem.methods.boundary_elements.state import State
from bem.problem.tractions import PEAK_TRACTION, force_of
from tests.bem.methods.contacts import lennard_jones, mesh_for, right_side, stress

TABOR = 2.0
LJ = lennard_jones(TABOR)
_, MESH = mesh_for(TABOR, edge=0.0, peak=1.0)


def history(gaps, tractions, times, forces=None):
    forces = 1.0 + np.asarray(times) if forces is None else forces
    states = [
        State(MESH, 0.0, np.array(g), np.array(s), f, 0.0) for g, s, f in zip(gaps, tractions, forces, strict=True)
    ]
    recent = start_recent(states[0], times[0])
    for state, time in zip(states[1:], times[1:], strict=True):
        push_recent(recent, state, time)
    return recent


def predicted(recent, time, nonadhesive=False):
    gap, stresses = np.empty(recent.gap.shape[1]), np.empty(recent.gap.shape[1])
    predict(lennard_jones(TABOR, nonadhesive), recent, time, gap, stresses)
    return gap, stresses


def law(gap):
    return stress(TABOR, gap)


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_open_gaps_follow_the_polynomial(degree):
    coefficients = np.array([[2.0, 0.3, -0.05], [5.0, -0.2, 0.1]])[:, : degree + 1]

    def exact(time):
        return coefficients @ float(time) ** np.arange(degree + 1)

    times = [0.0, 0.7, 1.1][: degree + 1]
    gaps = [exact(t) for t in times]
    gap, stress = predicted(history(gaps, [law(g) for g in gaps], times), 1.5)
    np.testing.assert_allclose(gap, exact(1.5), rtol=1e-12)
    np.testing.assert_allclose(stress, law(gap), rtol=1e-12)


def test_pressed_nodes_follow_traction():
    pressures = [np.array([-1.0 - 3.0 * t + 0.5 * t * t]) for t in (0.0, 1.0, 1.5)]
    gaps = [np.array([0.9])] * 3
    gap, stress = predicted(history(gaps, pressures, [0.0, 1.0, 1.5]), 2.0)
    assert stress[0] == pytest.approx(-5.0, rel=1e-6)
    assert law(gap)[0] == pytest.approx(-5.0, rel=1e-6)


def test_overpulled_node_is_released():
    tensions = [np.array([0.0]), np.array([TABOR * PEAK_TRACTION])]
    gap, _ = predicted(history([np.array([1.0])] * 2, tensions, [0.0, 1.0]), 2.0)
    assert 1.1 < gap[0] < 1.2


def test_a_wild_extrapolation_is_held_back():
    gap, _ = predicted(history([np.array([4.0]), np.array([2.0])], [law([4.0]), law([2.0])], [0.0, 1.0]), 3.0)
    assert gap[0] == pytest.approx(0.7 * 2.0)


def test_hard_contact_predicts_no_tension():
    gaps, stresses = [np.array([1.5, 1.0]), np.array([1.1, 1.0])], [np.array([0.0, -2.0]), np.array([0.0, -1.0])]
    gap, stress = predicted(history(gaps, stresses, [0.0, 1.0]), 4.0, nonadhesive=True)
    np.testing.assert_array_equal(gap, [1.0, 1.0])
    np.testing.assert_array_equal(stress, [0.0, 0.0])


def test_four_solutions_kept_three_judged():
    gaps = [np.array([100.0]), *(np.array([2.0 + 0.1 * t**3]) for t in (1.0, 2.0, 3.0, 4.0))]
    recent = history(gaps, [law(g) for g in gaps], [0.0, 1.0, 2.0, 3.0, 4.0])
    assert recent.count[0] == DEPTH == 4
    gap, stress = np.empty(1), np.empty(1)
    predict(LJ, recent, 4.1, gap, stress, DEPTH)
    assert gap[0] == pytest.approx(2.0 + 0.1 * 4.1**3)
    assert predicted(recent, 4.1)[0][0] == pytest.approx(2.0 + 0.1 * (4.1**3 - 1.1 * 2.1 * 0.1))


def error_of(changed_node, change):
    gap = np.maximum(right_side(MESH, TABOR, -1.0), 1.2)
    guess = gap.copy()
    guess[changed_node] *= 1.0 + change
    return prediction_error(LJ, MESH.force_weights, guess, law(guess), gap, law(gap), Scales(1.0), np.nan)


def test_error_is_relative_to_the_near_field():
    assert error_of(0, 0.0) == 0.0
    assert error_of(0, 1e-3) == pytest.approx(1e-3, rel=0.1)
    assert error_of(0, 2e-3) == pytest.approx(2.0 * error_of(0, 1e-3), rel=0.01)
    assert 0.0 < error_of(-1, 1e-3) < 0.1 * error_of(0, 1e-3)


def test_expected_force_is_the_polynomial():
    gaps, times = [[2.0]] * 3, [0.0, 1.0, 2.0]
    assert expected_force(history(gaps[:1], gaps[:1], times[:1]), 5.0) == 1.0
    assert expected_force(history(gaps, gaps, times, [1.0, 2.0, 5.0]), 4.0) == pytest.approx(17.0)


def test_force_error_is_relative_to_scale():
    gap, weights = np.array([1.3, 2.0]), np.array([3.0, 1.0])
    force = force_of(LJ, weights, gap, law(gap))
    for scale in (0.1, 100.0):
        off = prediction_error(LJ, weights, gap, law(gap), gap, law(gap), Scales(scale, 5.0), force + 0.2)
        assert off == pytest.approx(5.0 * 0.2 / max(force, scale))


@pytest.mark.parametrize(("force", "expected"), [(-10.0, 2.0 * 0.1 / 10.0), (-0.5, 2.0 * 0.1 / 1.0)])
def test_force_decides_without_adhesion(force, expected):
    gap, pressure = np.array([1.0, 3.0]), np.array([0.5 * force, 0.0])
    guess, hard = pressure - np.array([0.05, 0.0]), lennard_jones(TABOR, nonadhesive=True)
    error = prediction_error(hard, np.full(2, 2.0), 2.0 * gap, guess, gap, pressure, Scales(1.0), np.nan)
    assert error == pytest.approx(expected)


def test_bend_is_distance_from_the_line():
    gaps = [[2.0]] * 2
    assert bend_of_force(history(gaps[:1], gaps[:1], [0.0]), 3.0, 9.0) == 0.0
    recent = history(gaps, gaps, [0.0, 2.0], [1.0, 5.0])
    assert bend_of_force(recent, 3.0, 9.0) == pytest.approx(2.0)
    assert bend_of_force(recent, 3.0, 5.0) == pytest.approx(2.0)


def test_history_errs_between_the_steps():
    weights, times = np.array([0.7, 0.4]), np.array([0.0, 1.0, 2.5])

    def gap_at(time):
        return np.array([2.0 - 0.3 * time, 3.0 - 0.2 * time])

    forces = [force_of(LJ, weights, gap_at(time), law(gap_at(time))) for time in (*times, 1.75)]
    gaps = [gap_at(time) for time in times[:2]]
    recent = history(gaps, [law(gap) for gap in gaps], times[:2], forces[:2])
    parabola = np.polyval(np.polyfit(times, forces[:3], 2), 1.75)
    error = history_error(LJ, recent, weights, 2.5, forces[2], Scales(1e-3, 4.0))
    assert error == pytest.approx(4.0 * abs(forces[3] - parabola) / forces[3], rel=1e-6)
    assert error > 1e-3
