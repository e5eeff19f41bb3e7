"""The paper's discretisation against the solver: the same answer, by another way, at first order."""

import numpy as np
import pytest

from bem import Elastic, LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.methods.paper_method import simulate_paper_method

PROTOCOL = LoadingProtocol(peak_indentation=3.0, loading_rate=10.0, dwell_time=0.2, unloading_rate=10.0)
SCENE = Scene(1.0, StandardLinearSolid(0.1))


@pytest.fixture(scope="module")
def refined():
    return simulate(SCENE, PROTOCOL, "reference")


def test_first_order_converges_to_solver(refined):
    errors = []
    for steps in (60, 120, 240):
        trajectory = simulate_paper_method(SCENE, PROTOCOL, nodes=100, steps=steps)
        assert trajectory.completed
        errors.append(trajectory.hysteresis / refined.hysteresis - 1.0)
    assert abs(errors[-1]) < 0.01
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.5)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.7)


def test_trajectory_has_the_solver_interface(refined):
    trajectory = simulate_paper_method(SCENE, PROTOCOL, nodes=80, steps=80)
    times = np.linspace(0.0, trajectory.time[-1], 200)
    scale = np.ptp(refined.force)
    assert np.sqrt(np.mean((trajectory.at(times) - refined.at(times)) ** 2)) < 0.02 * scale
    assert trajectory.pull_off_time == pytest.approx(refined.pull_off_time, rel=0.02)
    assert trajectory.stats.steps_by_phase == {"loading": 80, "dwell": 80, "unloading": 80}
    assert trajectory.stats.factorisations == trajectory.stats.iterations
    assert trajectory.stats.memory_vectors == trajectory.stats.steps
    assert trajectory.time[trajectory.unloading][0] == pytest.approx(PROTOCOL.phase_times(1.0)[2])


def test_steps_never_outlast_the_retardation():
    slow = LoadingProtocol(peak_indentation=2.0, loading_rate=0.5, dwell_time=0.1, unloading_rate=10.0)
    trajectory = simulate_paper_method(SCENE, slow, nodes=40, steps=40)
    assert np.diff(trajectory.time).max() <= 20.0 / 40 * (1.0 + 1e-6)


def test_elastic_folds_jump_like_the_solver():
    scene, protocol = (
        Scene(3.0, Elastic()),
        LoadingProtocol(peak_indentation=1.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0),
    )
    trajectory = simulate_paper_method(scene, protocol, nodes=150, steps=150)
    exact = simulate(scene, protocol, "standard")
    assert [jump.indentation for jump in trajectory.jumps] == pytest.approx(
        [jump.indentation for jump in exact.jumps], rel=2e-3
    )
    assert trajectory.pull_off_force == pytest.approx(exact.pull_off_force, rel=5e-3)
    assert trajectory.stats.memory_vectors == 0
    for jump in trajectory.jumps:
        before, after = np.flatnonzero(trajectory.time == jump.time)
        assert (trajectory.force[before], trajectory.force[after]) == (jump.force_before, jump.force_after)
        assert trajectory.contact_radius[before] == trajectory.contact_radius[before - 1]
        assert trajectory.contact_radius[after] != trajectory.contact_radius[before]
