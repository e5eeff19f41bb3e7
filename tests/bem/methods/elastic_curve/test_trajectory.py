"""Elastic contacts that are read off the curve of equilibria, beside time steps of the boundary-element solver."""

import numpy as np
import pytest

from bem import ConstantStress, Exponential, LennardJones, PowerLaw, Scene, simulate, simulation
from bem.methods.closed_forms import maugis_dugdale
from bem.methods.elastic_curve import branch as elastic_branch
from bem.methods.outcomes import COMPLETED, NO_EQUILIBRIUM
from bem.problem.protocol import ForceProtocol, PiecewiseLinearProtocol

CYCLES = PiecewiseLinearProtocol([0.0, 1.0, 1.5, 2.0, 3.0], [-6.0, 2.0, -1.0, 3.0, -9.0])
PULLED = ForceProtocol([0.0, 1.0, 2.0, 3.0], [0.0, -8.0, 1.0, 1.7])


@pytest.mark.parametrize(
    ("scene", "protocol"),
    [
        (Scene(0.3), CYCLES),
        (Scene(1.0), CYCLES),
        (Scene(3.0), CYCLES),
        (Scene(1.0, spring=0.4), CYCLES),
        (Scene(2.0, spring=5.0), CYCLES),
        (Scene(0.3), PULLED),
        (Scene(2.0), PULLED),
        (Scene(1.5, adhesion=Exponential()), CYCLES),
        (Scene(1.0, adhesion=ConstantStress()), CYCLES),
    ],
)
def test_the_curve_and_time_steps_agree(scene, protocol, monkeypatch):
    trajectory = simulate(scene, protocol)
    monkeypatch.setattr(simulation, "_on_branch", lambda *_: None)
    stepped = simulate(scene, protocol, 1e-3)
    assert (trajectory.stats.method, stepped.stats.method) == ("elastic branch", "boundary elements")
    assert trajectory.status.split()[0] == stepped.status.split()[0]
    assert trajectory.pull_off_force == pytest.approx(stepped.pull_off_force, rel=2e-3)
    assert trajectory.max_compression == pytest.approx(stepped.max_compression, rel=2e-3, abs=1e-3)
    assert trajectory.energy_balance == pytest.approx(stepped.energy_balance, abs=4e-3, rel=4e-3, nan_ok=True)
    assert len(trajectory.jumps) == len(stepped.jumps)
    rigid = scene.spring is None and protocol is CYCLES  # else the sphere moves fast where it is about to jump
    for curve, step_jump in zip(trajectory.jumps, stepped.jumps, strict=True):
        assert curve.indentation == pytest.approx(step_jump.indentation, abs=0.01 if rigid else 0.03)
        assert curve.indentation_after == pytest.approx(step_jump.indentation_after, abs=0.02, nan_ok=True)
        assert curve.force_after == pytest.approx(step_jump.force_after, abs=0.02)
        assert curve.energy_lost == pytest.approx(step_jump.energy_lost, abs=4e-3, rel=4e-3, nan_ok=True)
    instants = np.linspace(0.0, min(trajectory.time[-1], stepped.time[-1]), 300)
    if protocol is PULLED:
        depths = [np.interp(instants, curve.time, curve.indentation) for curve in (trajectory, stepped)]
        assert np.median(np.abs(depths[0] - depths[1])) < 4e-3 * scene.tabor
    else:
        assert np.median(np.abs(trajectory.at(instants) - stepped.at(instants))) < 2e-3


def test_equal_cycles_repeat_to_the_last_bit():
    once = simulate(Scene(3.0), PiecewiseLinearProtocol([0, 1, 2], [-7.0, 2.0, -7.0]))
    often = simulate(Scene(3.0), PiecewiseLinearProtocol(range(9), [-7.0, 2.0] * 4 + [-7.0]))
    assert len(often.jumps) == 4 * len(once.jumps) == 8
    assert often.hysteresis == pytest.approx(4.0 * once.hysteresis, rel=1e-9)
    first = often.time <= 2.0
    np.testing.assert_array_equal(often.force[first], once.force)


@pytest.mark.parametrize("spring", [None, 0.4, 5.0])
def test_loop_area_is_lost_in_jumps(spring):
    trajectory = simulate(Scene(2.0, spring=spring), PiecewiseLinearProtocol([0, 1, 2], [-15.0, 3.0, -15.0]))
    loop = np.trapezoid(trajectory.force, trajectory.stage)
    assert abs(loop) == pytest.approx(sum(jump.energy_lost for jump in trajectory.jumps), abs=4e-3, rel=2e-3)
    assert trajectory.energy_balance == pytest.approx(abs(loop), abs=4e-3, rel=2e-3)


@pytest.mark.parametrize("depths", [[-2.5, 1.0], [-3.0, 1.0], [0.5, -1.0]])
def test_path_starts_after_snap_in(depths):
    """Mu 2 snaps in at -2.55 and off at -3.38."""
    trajectory = simulate(Scene(2.0), PiecewiseLinearProtocol([0.0, 1.0], depths))
    assert (trajectory.contact_radius[0] > 0.0) == (depths[0] > -2.55)
    assert trajectory.indentation[[0, -1]] == pytest.approx(depths)
    assert len(trajectory.jumps) == (depths[0] < -2.55)


def test_whole_budget_gives_a_trajectory():
    unlimited = simulate(Scene(5.0), CYCLES)
    for share, status in ((0.7, "not started: stopped at the budget"), (1.01, "completed")):
        trajectory = simulate(Scene(5.0), CYCLES, most_work=share * unlimited.stats.multiply_adds)
        assert trajectory.status.startswith(status)


def test_elements_answer_past_the_break(monkeypatch):
    follow = elastic_branch.follow

    def broken(*arguments):
        growth = follow(*arguments)
        return (
            growth._replace(count=growth.count - 20, outcome=NO_EQUILIBRIUM) if growth.outcome == COMPLETED else growth
        )

    monkeypatch.setattr(elastic_branch, "follow", broken)
    trajectory = simulate(Scene(1.37), CYCLES, "draft")
    assert trajectory.completed
    assert trajectory.stats.method == "boundary elements"
    assert len(trajectory.jumps) == 2


@pytest.mark.parametrize(
    ("tabor", "deep"), [(12.0, -26.0), pytest.param(27.0, -50.0, marks=pytest.mark.slow), (45.0, -90.0)]
)
def test_steep_fall_at_large_tabor(tabor, deep):
    """Before the surfaces meet such a traction acts on a disk much wider than the smallest contact."""
    path = PiecewiseLinearProtocol([0.0, 1.0, 2.0], [deep, 24.0, deep])
    trajectory = simulate(Scene(tabor, adhesion=ConstantStress()), path, most_work=1e10)
    assert trajectory.completed
    assert trajectory.stats.method == "elastic branch"
    assert trajectory.pull_off_force == pytest.approx(maugis_dugdale.pull_off_force(tabor), rel=4e-3)


@pytest.mark.parametrize(
    ("tabor", "power", "peak", "law"),
    [(0.02, 8.0, 0.162, Exponential()), (0.02, 6.0, 0.5, LennardJones()), (1.0, 8.0, 0.5, ConstantStress())],
)
def test_flat_tips_take_short_steps(tabor, power, peak, law, monkeypatch):
    """Their force grows with a high power of the contact radius."""
    scene, path = Scene(tabor, adhesion=law, indenter=PowerLaw(power)), [-4.0, peak, -4.0]
    protocol = PiecewiseLinearProtocol([0.0, 1.0, 2.0], path)
    both = [simulate(scene, protocol, accuracy) for accuracy in ("draft", "standard")]
    monkeypatch.setattr(simulation, "_on_branch", lambda *_: None)
    stepped = simulate(scene, protocol, 1e-3)
    for trajectory in both:
        assert trajectory.pull_off_force == pytest.approx(stepped.pull_off_force, rel=trajectory.accuracy)
        assert trajectory.max_compression == pytest.approx(stepped.max_compression, rel=trajectory.accuracy)


def test_hard_curve_gives_no_wrong_answer():
    path = PiecewiseLinearProtocol([0.0, 1.0, 2.0], [-26.0, 24.0, -26.0])
    trajectory = simulate(Scene(12.0, adhesion=ConstantStress(width=0.15)), path, most_work=1e9)
    # Boundary elements take more than this budget where the curve breaks off.
    assert trajectory.stats.method == "elastic branch" or "stopped at the budget" in trajectory.status
    if trajectory.completed:
        assert trajectory.pull_off_force == pytest.approx(1.5, rel=4e-3)
