import dataclasses

import numpy as np
import pytest

from bem import Elastic, HardContact, LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.methods.closed_forms import dmt
from bem.problem.protocol import default_start_indentation
from bem.results.trajectory import Jump, Statistics, Trajectory, far_field

STATS = Statistics(
    steps=3,
    steps_by_phase={"loading": 3},
    iterations=3,
    factorisations=1,
    nodes=10.0,
    unknowns_per_solve=8.0,
    grid_nodes=100,
    seconds=0.001,
)


def trajectory_of(time, indentation, force, *, status="completed", jump_times=(), unloading=None):
    time, indentation, force = (np.asarray(values, dtype=float) for values in (time, indentation, force))
    jumps = tuple(Jump(at, 0.0, 1.0, 0.0, 1e-3, 0.5) for at in jump_times)
    flags = np.zeros(time.size, bool) if unloading is None else np.asarray(unloading, dtype=bool)
    radius = np.zeros(time.size)
    return Trajectory(time, indentation, force, radius, status, jumps, STATS, 4e-3, flags)


def elliptic_loop(count, **options):
    """Up and down a ramp with a force that lags: P = delta - lag sin(pi delta / 2) going up, the mirror going down."""
    up = np.linspace(0.0, 2.0, count)
    depth = np.concatenate([up, up[-2::-1]])
    time = np.arange(depth.size, dtype=float)
    sign = np.where(time < count - 0.5, -1.0, 1.0)
    return trajectory_of(time, depth, -depth + sign * 0.3 * np.sin(0.5 * np.pi * depth), **options)


def test_the_work_of_a_known_loop():
    # each way encloses 0.3 * integral of sin(pi x / 2) over (0, 2) = 0.3 * 4 / pi
    loop = elliptic_loop(60)
    assert loop.work() == pytest.approx(2.0 * 0.3 * 4.0 / np.pi, rel=1e-4)
    assert loop.hysteresis == pytest.approx(loop.work())
    # Traversed backwards it would create energy.
    backwards = trajectory_of(loop.time, loop.indentation, -2.0 * loop.indentation - loop.force)
    assert backwards.work() == pytest.approx(-loop.work(), rel=1e-9)
    assert backwards.hysteresis == pytest.approx(loop.hysteresis, rel=1e-9)


THERE_AND_BACK = np.concatenate([np.linspace(0.0, 3.0, 20), np.linspace(3.0, 0.0, 30)[1:]])


@pytest.mark.parametrize(
    ("depth", "force", "jumps", "work", "turnover"),
    [
        (THERE_AND_BACK, -2.0 * THERE_AND_BACK, {}, 0.0, 18.0),  # a spring stores and returns
        ([0, 1, 2, 2, 2, 1, 0], [0, -1, -2, -1, 0, 0, 0], {}, 2.0, 2.0),  # a dwell does no work
        ([0, -1, -2, -2, -3, -4], [1, 1, 1, 0, 0, 0], {"jump_times": [2.0]}, 2.0, 2.0),  # nothing after the jump
    ],
)
def test_work_and_turnover_of_a_history(depth, force, jumps, work, turnover):
    time = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0]) if jumps else np.arange(len(depth))
    trajectory = trajectory_of(time, depth, force, **jumps)
    assert trajectory.work() == pytest.approx(work, abs=1e-12)
    assert trajectory.turnover() == pytest.approx(turnover)


def test_history_jumps_with_the_contact():
    # In a dwell, where nothing else tells the two sides apart.
    jumping = trajectory_of([0.0, 1.0, 1.0, 2.0], np.zeros(4), [1.0, 2.0, -3.0, -4.0], jump_times=[1.0])
    assert jumping.at([1.0 - 1e-12, 1.0]).tolist() == pytest.approx([2.0, -3.0])


def test_pull_off_is_the_unloading_maximum():
    history = trajectory_of(
        range(6), [0, 1, 2, 1, 0, -1], [3.0, 0.0, -5.0, 1.0, 2.0, 0.5], unloading=[0, 0, 1, 1, 1, 1]
    )
    assert (history.pull_off_force, history.pull_off_time) == (2.0, 4.0)
    assert (history.max_compression, history.end_force) == (-5.0, 0.5)


def test_what_never_unloads_has_no_pull_off():
    creep = trajectory_of([0.0, 1.0, 2.0], [0.0, 1.0, 1.0], [0.0, -1.0, -0.5])
    assert np.isnan(creep.pull_off_force)
    assert np.isnan(creep.pull_off_time)
    assert creep.max_compression == -1.0


def test_unfinished_history_has_no_numbers():
    broken = elliptic_loop(9, status="no stable equilibrium found", unloading=np.ones(17))
    assert not broken.completed
    names = ("pull_off_force", "pull_off_time", "max_compression", "hysteresis", "end_force")
    assert all(np.isnan(getattr(broken, name)) for name in names)
    assert broken.summary()["status"] == "no stable equilibrium found"
    assert np.isnan(broken.summary()["work"])
    assert not broken.detached


def test_the_summary_is_plain_data():
    summary = trajectory_of([0.0, 1.0, 1.0, 2.0], [0, 1, 1, 2], [0.0, 1.0, 0.0, 0.0], jump_times=[1.0]).summary()
    assert summary["jumps"][0]["force_before"] == 1.0
    assert summary["stats"]["steps_by_phase"] == {"loading": 3}
    assert summary["accuracy"] == 4e-3
    assert summary["detached"] is True
    assert summary["work"] == -0.5


def test_far_field_is_undeformed_attraction():
    alone = dmt.rigid_force_from_indentation(-3.0)
    assert far_field([0.0, alone, 3.9 * alone, 4.1 * alone], -3.0).tolist() == [True, True, True, False]
    assert far_field(4.1 * alone, -3.0, doubt=0.2 * alone)
    assert far_field(8.0, [0.0, 5.0]).tolist() == [True, True]
    # A gap half as wide attracts about four times as much.
    assert dmt.rigid_force_from_indentation(-41.0) / dmt.rigid_force_from_indentation(-83.0) == pytest.approx(
        4.0, rel=1e-6
    )


def cycle(tabor, modulus_ratio, rate, adhesion=None, **more):
    scene = Scene(tabor, StandardLinearSolid(modulus_ratio) if modulus_ratio < 1.0 else Elastic())
    if adhesion is not None:
        scene = Scene(tabor, scene.material, adhesion)
    protocol = {"peak_indentation": min(10.0, 60.0 / tabor), "dwell_time": 1.0} | more
    return simulate(scene, LoadingProtocol(loading_rate=rate, unloading_rate=rate, **protocol), "draft")


@pytest.mark.parametrize(
    ("tabor", "modulus_ratio", "rate", "detached"),
    [
        (0.05, 0.1, 1000.0, True),
        (0.05, 0.1, 0.1, False),  # the start lies within the gap of the largest tension
        (0.2, 1.0, 10.0, True),  # at the far-field attraction, though that is 80 % of the pull-off force
        (0.2, 0.001, 1000.0, True),
        (0.5, 0.001, 0.1, True),
        (1.2, 0.001, 0.1, True),
        (2.0, 1.0, 10.0, True),
        (2.0, 0.1, 0.1, False),
        (2.0, 0.1, 10.0, True),
        (2.8, 0.3, 0.1, True),  # the surface still stands out
        (3.2, 0.1, 10.0, False),
        (3.2, 0.1, 1000.0, True),
        (6.0, 0.01, 10.0, False),
        pytest.param(12.0, 0.3, 1000.0, True, marks=pytest.mark.slow),
        pytest.param(20.0, 0.3, 10.0, False, marks=pytest.mark.slow),
        pytest.param(20.0, 0.001, 1000.0, True, marks=pytest.mark.slow),
    ],
)
def test_detached_lost_edge_and_force(tabor, modulus_ratio, rate, detached):
    trajectory = cycle(tabor, modulus_ratio, rate)
    assert trajectory.completed
    assert trajectory.detached is detached
    if not detached and tabor > 0.1:
        assert trajectory.end_force > 0.3 * trajectory.pull_off_force


def test_detached_without_adhesion():
    assert cycle(1.0, 0.1, 10.0, HardContact()).detached
    assert cycle(1.0, 0.1, 1000.0, HardContact(), start_indentation=1.0).detached  # the dent is deeper
    assert not cycle(1.0, 0.1, 0.1, HardContact(), start_indentation=1.0).detached


def test_breaking_neck_is_not_detached():
    end = default_start_indentation(1.0)
    broken, neck = (trajectory_of([0.0, 1.0], [end, end], [0.1, force]) for force in (0.3, 1.2))
    assert broken.detached
    assert not neck.detached


def behind_a_spring(spring, **options):
    """A sphere whose stage goes up and down, and whose force is twice its indentation, compressive."""
    stage = np.concatenate([np.linspace(0.0, 3.0, 40), np.linspace(3.0, 0.0, 40)[1:]])
    depth = stage * spring / (spring + 2.0)
    plain = trajectory_of(np.arange(stage.size), depth, -2.0 * depth, **options)
    return dataclasses.replace(plain, spring=spring), stage


def test_stage_is_indentation_less_extension():
    trajectory, stage = behind_a_spring(4.0)
    np.testing.assert_allclose(trajectory.stage, stage, atol=1e-12)
    assert trajectory_of([0.0, 1.0], [0.0, 1.0], [0.0, -2.0]).stage.tolist() == [0.0, 1.0]


def test_work_behind_a_spring_is_the_spheres():
    trajectory, _ = behind_a_spring(4.0)
    assert trajectory.work() == pytest.approx(0.0, abs=1e-9)
    half = trajectory.time <= 39.0
    cut = {
        name: getattr(trajectory, name)[half]
        for name in ("time", "indentation", "force", "contact_radius", "unloading")
    }
    loading = dataclasses.replace(trajectory, **cut)
    # Work into the contact, P^2 / 4, and not what the spring holds, P^2 / 8.
    assert loading.work() == pytest.approx(loading.force[-1] ** 2 / 4.0, rel=1e-9)


def test_prescribed_force_is_linear():
    plain = trajectory_of([0.0, 1.0, 3.0], [0.0, 1.0, 4.0], [0.0, -2.0, -2.0])
    trajectory = dataclasses.replace(plain, by_force=True)
    np.testing.assert_allclose(trajectory.at([0.5, 1.0, 2.0]), [-1.0, -2.0, -2.0])
    assert trajectory.work() == pytest.approx(1.0 + 6.0)


def test_flown_off_sphere_is_detached():
    status = "detached: no contact bears the prescribed force (at time 3, indentation 1)"
    plain = trajectory_of([0.0, 1.0, 3.0], [2.0, 2.0, 1.0], [0.0, 0.0, 1.5], status=status, unloading=[0, 1, 1])
    trajectory = dataclasses.replace(plain, by_force=True)
    assert trajectory.completed
    assert trajectory.detached
    assert trajectory.pull_off_force == 1.5
