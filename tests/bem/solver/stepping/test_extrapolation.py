import numpy as np
import pytest

from bem.solver.equilibrium import force_of
from bem.solver.stepping.extrapolation import (
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
from bem.tractions import LENNARD_JONES, PEAK_TRACTION, traction
from tests.bem.solver.contacts import mesh_for, right_side

TABOR = 2.0


def history(gaps, tractions, times):
    recent = start_recent(gaps[0], tractions[0], times[0], 1.0 + times[0])
    for gap, stress, time in zip(gaps[1:], tractions[1:], times[1:], strict=True):
        push_recent(recent, gap, stress, time, 1.0 + time)
    return recent


def predicted(recent, time, nonadhesive=False):
    gap, stress = np.empty(recent.gap.shape[1]), np.empty(recent.gap.shape[1])
    predict(recent, time, TABOR, LENNARD_JONES, nonadhesive, gap, stress)
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


def test_only_the_last_four_solutions_are_kept_and_three_are_judged_by():
    gaps = [np.array([100.0]), *(np.array([2.0 + 0.1 * t**3]) for t in (1.0, 2.0, 3.0, 4.0))]
    recent = history(gaps, [law(g) for g in gaps], [0.0, 1.0, 2.0, 3.0, 4.0])
    assert recent.count[0] == DEPTH == 4
    gap, stress = np.empty(1), np.empty(1)
    predict(recent, 4.1, TABOR, LENNARD_JONES, False, gap, stress, DEPTH)
    assert gap[0] == pytest.approx(2.0 + 0.1 * 4.1**3)
    assert predicted(recent, 4.1)[0][0] == pytest.approx(2.0 + 0.1 * (4.1**3 - 1.1 * 2.1 * 0.1))


def error_of(changed_node, change):
    _, mesh = mesh_for(TABOR, edge=0.0, peak=1.0)
    gap = np.maximum(right_side(mesh, TABOR, -1.0), 1.2)
    guess = gap.copy()
    guess[changed_node] *= 1.0 + change
    return prediction_error(
        mesh.force_weights, TABOR, LENNARD_JONES, False, guess, law(guess), gap, law(gap), Scales(1.0), np.nan
    )


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


def test_a_force_off_the_expected_one_counts_relative_to_the_larger_of_itself_and_its_scale():
    gap, weights = np.array([1.3, 2.0]), np.array([3.0, 1.0])
    force = force_of(weights, law(gap), gap, LENNARD_JONES)
    for scale in (0.1, 100.0):
        off = prediction_error(
            weights, TABOR, LENNARD_JONES, False, gap, law(gap), gap, law(gap), Scales(scale, 5.0), force + 0.2
        )
        assert off == pytest.approx(5.0 * 0.2 / max(force, scale))


@pytest.mark.parametrize(("force", "expected"), [(-10.0, 2.0 * 0.1 / 10.0), (-0.5, 2.0 * 0.1 / 1.0)])
def test_without_adhesion_the_force_alone_decides(force, expected):
    gap, stress = np.array([1.0, 3.0]), np.array([0.5 * force, 0.0])
    guess = stress - np.array([0.05, 0.0])
    found = prediction_error(
        np.full(2, 2.0), TABOR, LENNARD_JONES, True, 2.0 * gap, guess, gap, stress, Scales(1.0), np.nan
    )
    assert found == pytest.approx(expected)


def test_the_bend_is_the_distance_from_the_line_through_the_last_two_forces():
    gap = np.array([2.0])
    recent = start_recent(gap, law(gap), 0.0, 1.0)
    assert bend_of_force(recent, 3.0, 9.0) == 0.0
    push_recent(recent, gap, law(gap), 2.0, 5.0)
    assert bend_of_force(recent, 3.0, 9.0) == pytest.approx(2.0)
    assert bend_of_force(recent, 3.0, 5.0) == pytest.approx(2.0)


def test_the_history_errs_by_what_lies_between_the_steps():
    weights, times = np.array([0.7, 0.4]), np.array([0.0, 1.0, 2.5])

    def gap_at(time):
        return np.array([2.0 - 0.3 * time, 3.0 - 0.2 * time])

    forces = [force_of(weights, law(gap_at(time)), gap_at(time), LENNARD_JONES) for time in (*times, 1.75)]
    recent = start_recent(gap_at(0.0), law(gap_at(0.0)), 0.0, forces[0])
    push_recent(recent, gap_at(1.0), law(gap_at(1.0)), 1.0, forces[1])
    parabola = np.polyval(np.polyfit(times, forces[:3], 2), 1.75)
    found = history_error(recent, weights, TABOR, LENNARD_JONES, False, 2.5, forces[2], Scales(1e-3, 4.0))
    assert found == pytest.approx(4.0 * abs(forces[3] - parabola) / forces[3], rel=1e-6)
    assert found > 1e-3
