import dataclasses
import functools

import numpy as np
import pytest

from bem import ConstantStress, HardContact, LennardJones, Scene, simulate, simulate_paper_method, simulation
from bem.methods.closed_forms import jkr
from bem.methods.outcomes import NO_EQUILIBRIUM
from bem.problem.materials import Elastic, StandardLinearSolid
from bem.problem.protocol import ForceProtocol, LoadingProtocol, PiecewiseLinearProtocol
from tests.validation.cases import completed

SOFT = StandardLinearSolid(modulus_ratio=0.1)
PROTOCOL = LoadingProtocol(peak_indentation=4.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
ARRAYS = ("time", "indentation", "force", "contact_radius")


def run(material=SOFT, adhesion=None, tabor=1.0, protocol=PROTOCOL, accuracy="draft", **options):
    scene = Scene(tabor=tabor, material=material, adhesion=adhesion or LennardJones())
    return completed(scene, protocol, accuracy, **options)


def test_arrays_are_float64_and_meet_ends():
    trajectory = run()
    for name in ARRAYS:
        values = getattr(trajectory, name)
        assert values.dtype == np.float64
        assert values.shape == trajectory.time.shape
        assert values.flags.c_contiguous
    start = PROTOCOL.start(1.0)
    assert trajectory.indentation[[0, -1]] == pytest.approx([start, start])
    assert np.max(trajectory.indentation) == 4.0
    assert trajectory.time[-1] == pytest.approx(PROTOCOL.phase_times(1.0)[-1])


def test_absent_phases_take_no_steps():
    with_dwell = run().stats
    without = run(protocol=dataclasses.replace(PROTOCOL, dwell_time=0.0)).stats
    assert set(with_dwell.steps_by_phase) == {"loading", "dwell", "unloading"}
    assert set(without.steps_by_phase) == {"loading", "unloading"}
    for stats in (with_dwell, without):
        assert sum(stats.steps_by_phase.values()) == stats.steps
        assert stats.iterations >= stats.steps


def test_an_elastic_dwell_is_one_step():
    assert run(material=Elastic(), tabor=0.2).stats.steps_by_phase["dwell"] == 1


def test_a_tighter_accuracy_spends_more():
    draft, standard, reference = (run(accuracy=name).stats for name in ("draft", "standard", "reference"))
    assert draft.steps < standard.steps < reference.steps
    assert draft.nodes < standard.nodes < reference.nodes


@pytest.mark.parametrize("profiles", [5, [0.0, 1.0]])
def test_profiles_of_a_bead_are_refused(profiles):
    protocol = dataclasses.replace(PROTOCOL, peak_indentation=100.0)
    trajectory = simulate(Scene(tabor=200.0, material=SOFT), protocol, profiles=profiles)
    assert trajectory.status.startswith("not started: the contact edge needs ")
    assert trajectory.status.endswith("; a sharp crack has neither profiles nor a mesh")
    assert int(trajectory.status.split("needs ")[1].split()[0]) > 150_000
    assert not trajectory.completed
    assert all(getattr(trajectory, name).size == 0 for name in ARRAYS)
    assert np.isnan([trajectory.pull_off_force, trajectory.hysteresis, trajectory.max_compression]).all()
    assert trajectory.stats.steps == 0


BEAD = Scene(1000.0, SOFT)
CYCLE = LoadingProtocol(
    peak_indentation=2e3, loading_rate=1e3, dwell_time=1.0, unloading_rate=1e4, start_indentation=-9e3
)


@pytest.mark.parametrize("accuracy", ["standard", 0.02])
def test_a_bead_is_a_sharp_crack(accuracy):
    trajectory = simulate(BEAD, CYCLE, accuracy)
    assert (trajectory.status, trajectory.stats.method) == ("completed", "sharp crack")
    assert trajectory.accuracy < 0.004
    assert trajectory.detached
    assert [jump.force_after > jump.force_before for jump in trajectory.jumps] == [True, False]
    assert sum(trajectory.stats.steps_by_phase.values()) == trajectory.stats.steps > 100
    assert trajectory.indentation[[0, -1]] == pytest.approx([-9e3, -9e3])
    assert 1.5 < trajectory.pull_off_force < 15.0


def test_a_draft_of_a_sharp_crack_takes_fewer_steps():
    draft, standard = (simulate(BEAD, CYCLE, name) for name in ("draft", "standard"))
    assert draft.stats.steps < 0.8 * standard.stats.steps
    assert draft.pull_off_force == pytest.approx(standard.pull_off_force, rel=draft.accuracy)


def test_accuracy_that_holds_is_said():
    trajectory = simulate(BEAD, CYCLE, 2e-4)
    assert trajectory.completed
    assert trajectory.accuracy > 2e-4
    assert trajectory.status.startswith(
        f"completed (accuracy {trajectory.accuracy:.2g} in place of 0.0002: boundary elements"
    )


DEEP_CYCLE = PiecewiseLinearProtocol([0, 1, 2], [-160, 40, -160])


def test_hopeless_elements_are_not_begun(monkeypatch):
    monkeypatch.setattr(simulation, "march", None)
    for tabor, accuracy, options in ((40.0, 2e-3, {"most_work": 1e9}), (60.0, "standard", {}), (50.0, 1.5e-4, {})):
        trajectory = simulate(Scene(tabor, SOFT), DEEP_CYCLE, accuracy, **options)
        said = f"completed (accuracy {trajectory.accuracy:.2g} in place of "
        assert trajectory.status.startswith(said)
        assert "boundary elements take about" in trajectory.status
        answer = simulate(Scene(tabor, SOFT), DEEP_CYCLE, trajectory.accuracy)
        assert (answer.status, answer.stats.method) == ("completed", "sharp crack")


def test_elements_that_fail_leave_the_crack(monkeypatch):
    def lost(*arguments):
        return march(*arguments[:-1], 1e3)

    march = simulation.march
    monkeypatch.setattr(simulation, "march", lost)
    trajectory = simulate(Scene(12.0, SOFT), DEEP_CYCLE)
    assert trajectory.stats.method == "sharp crack"
    assert trajectory.status.startswith(f"completed (accuracy {trajectory.accuracy:.2g} in place of 0.004: stopped at ")


def test_no_zone_is_no_traceback():
    """The law's fall is too narrow for the zone's nodes; boundary elements need more nodes than are allowed."""
    trajectory = simulate(Scene(1000.0, SOFT, ConstantStress(0.05)), CYCLE)
    assert trajectory.status.startswith("not started: the contact edge needs ")


def test_small_tabor_needs_no_tables(monkeypatch):
    monkeypatch.setattr(simulation, "march_crack", None)
    assert run(tabor=3.0).stats.method == "boundary elements"


@pytest.mark.parametrize(("tabor", "last"), [(0.5, -2.0), (2.5, -6.0), (2.5, 21.0)])
def test_slow_drift_keeps_the_earlier_grid(tabor, last):
    times, depths = [0.0, 0.4, 0.5, 0.9, 1.3, 5001.3], [-5.5, 20.0, 20.0, -5.5, 20.0 if last > 0.0 else -5.5, last]
    usual = run(protocol=PiecewiseLinearProtocol(times[:-1], depths[:-1]), tabor=tabor, accuracy="standard")
    followed = run(protocol=PiecewiseLinearProtocol(times, depths), tabor=tabor, accuracy="standard")
    fine = run(protocol=PiecewiseLinearProtocol(times, depths), tabor=tabor, accuracy=4e-4)
    assert followed.stats.nodes < 1.3 * usual.stats.nodes
    assert followed.stats.grid_nodes > 1.8 * usual.stats.grid_nodes
    scale = np.abs(fine.force).max()
    at = np.linspace(0.0, times[-1], 400)
    np.testing.assert_allclose(followed.at(at), fine.at(at), rtol=0.0, atol=1e-3 * scale)
    drift = at > times[-2]
    np.testing.assert_allclose(followed.at(at[drift]), fine.at(at[drift]), rtol=4e-3, atol=4e-3)


def test_accuracy_is_that_of_the_last_mesh(monkeypatch):
    module = simulation
    module.load_kernels("boundary elements")  # follows a contact of its own
    march, problem_of, accuracies = module.march, module.problem_of, []

    def lost(*arguments):
        return march(*arguments)._replace(outcome=NO_EQUILIBRIUM)

    def with_little_memory(scene, path, accuracy, *settings, **options):
        accuracies.append(accuracy)
        if len(accuracies) > 2:
            raise MemoryError("the contact edge needs more")
        return problem_of(scene, path, accuracy, *settings, **options)

    monkeypatch.setattr(module, "march", lost)
    monkeypatch.setattr(module, "problem_of", with_little_memory)
    trajectory = simulate(Scene(1.0, SOFT), PROTOCOL, 0.01)
    assert not trajectory.completed
    assert len(accuracies) == 3
    assert trajectory.accuracy == 0.005
    assert trajectory.status.endswith("(accuracy tightened from 0.01 to 0.005 after 2 failed attempts)")
    assert (trajectory.stats.attempts, trajectory.stats.failed_attempts) == (2, 2)
    assert trajectory.stats.multiply_adds > simulate(Scene(1.0, SOFT), PROTOCOL, 0.01).stats.multiply_adds


@pytest.mark.parametrize(
    ("scene", "protocol", "method"),
    [
        (Scene(1.0, SOFT), PROTOCOL, simulate),
        (Scene(1.0, SOFT, adhesion=HardContact()), PROTOCOL, simulate),
        (Scene(1.0, SOFT, spring=1.0), PROTOCOL, simulate),
        (Scene(1.0, SOFT), ForceProtocol([0.0, 1.0, 2.0], [0.0, -5.0, 0.0]), simulate),
        (Scene(1.0, SOFT), PROTOCOL, functools.partial(simulate_paper_method, nodes=40, steps=40)),
    ],
)
def test_budget_keeps_what_was_computed(scene, protocol, method):
    unlimited = method(scene, protocol)
    budget = 0.7 * unlimited.stats.multiply_adds
    bounded = method(scene, protocol, most_work=budget)
    assert bounded.status.startswith(f"stopped at the budget of {budget:g} multiply-adds; try ")
    assert not bounded.completed
    assert budget <= bounded.stats.multiply_adds < 1.2 * budget
    shared = np.isin(bounded.time, unlimited.time)
    assert shared.sum() > 0.8 * bounded.time.size > 10
    assert bounded.time[-1] < unlimited.time[-1]
    np.testing.assert_array_equal(bounded.force[shared][:-2], unlimited.force[: bounded.time.size][shared][:-2])
    assert method(scene, protocol, most_work=1.01 * unlimited.stats.multiply_adds).status == unlimited.status


@pytest.mark.slow
def test_the_loosest_target_takes_one_attempt():
    """At a coarser mesh than a draft's several of these were tried again."""
    random, attempts = np.random.default_rng(5), set()
    for _ in range(40):
        tabor, ratio = random.uniform(6.0, 10.0), np.exp(random.uniform(np.log(0.01), np.log(0.1)))
        times = [0.0, *np.cumsum(10.0 ** random.uniform(-3.0, 1.0, 3))]
        depths = tabor * np.array([-2.1, random.uniform(0.0, 4.0), random.uniform(0.0, 2.0), -3.5])
        scene = Scene(tabor, StandardLinearSolid(ratio), adhesion=ConstantStress())
        trajectory = by_elements(scene, PiecewiseLinearProtocol(times, depths), 0.05)
        assert (trajectory.status, trajectory.accuracy) == ("completed", 0.05)
        attempts.add(trajectory.stats.attempts)
    assert attempts == {1}


LARGE_MU = {
    "40": (Scene(40.0, SOFT), PiecewiseLinearProtocol([0, 1, 2], [-160, 40, -160])),
    "60": (Scene(60.0, SOFT), PiecewiseLinearProtocol([0, 1, 2], [-240, 60, -240])),
    "30 by force": (Scene(30.0, StandardLinearSolid(0.5)), ForceProtocol(range(5), [0, -50, -50, 1, 1.4])),
}


def by_elements(scene, path, accuracy, **options):
    """Boundary elements answer where profiles are asked for."""
    return simulate(scene, path, accuracy, profiles=path.times[-1:], **options)


def test_contact_beyond_its_fold_is_released():
    trajectory = by_elements(*LARGE_MU["40"], "draft")
    assert (trajectory.status, trajectory.stats.attempts) == ("completed", 1)
    assert trajectory.detached
    released = trajectory.jumps[-1]
    # JKR's fold of the glass, below which no contact of any radius exists
    assert released.indentation < jkr.fold_indentation(40.0)
    assert released.force_after < 0.05 < 5.0 < released.force_before
    assert released.eigenvalue_after == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", ["draft", 1e-3])
@pytest.mark.parametrize("name", LARGE_MU)
def test_large_tabor_ends_at_its_budget(name, accuracy):
    trajectory = by_elements(*LARGE_MU[name], accuracy, most_work=5e9)
    assert trajectory.status.removeprefix("not started: ").startswith("stopped at the budget of 5e+09 multiply-adds; ")
    assert trajectory.stats.multiply_adds < 5.5e9


def test_held_contact_relaxes_to_elastic():
    path = PiecewiseLinearProtocol([0.0, 1e-3, 60.0], [-1.0, 3.0, 3.0])
    held, elastic = (run(material=material, protocol=path, accuracy=1e-3) for material in (SOFT, Elastic()))
    assert held.force[-1] == pytest.approx(elastic.force[-1], rel=1e-3)
    assert held.max_compression < 3.0 * elastic.max_compression


def test_jump_is_recorded_twice():
    protocol = LoadingProtocol(peak_indentation=1.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
    trajectory = run(material=Elastic(), tabor=3.0, protocol=protocol, accuracy="standard")
    assert len(trajectory.jumps) == 2
    for jump in trajectory.jumps:
        before, after = np.flatnonzero(trajectory.time == jump.time)
        assert trajectory.force[[before, after]].tolist() == [jump.force_before, jump.force_after]
        assert abs(jump.eigenvalue_before) < 0.05
        assert jump.eigenvalue_after > 3.0 * abs(jump.eigenvalue_before)
    snap_in, snap_off = trajectory.jumps
    assert snap_in.force_after > snap_in.force_before
    assert snap_off.force_after < snap_off.force_before


@pytest.mark.parametrize("far", [1.0, 2.0, 5.0, 10.0])
@pytest.mark.parametrize("tabor", [0.02, 0.05])
def test_pull_before_contact_is_recorded(tabor, far):
    """Its gap is predicted over any distance, so nothing but the course of the force keeps steps from leaping it."""
    protocol = PiecewiseLinearProtocol([0.0, 1.0, 2.0], [-far, 2.0, -far])
    trajectory = simulate(Scene(tabor, StandardLinearSolid(0.1)), protocol)
    approach = trajectory.force[~trajectory.unloading].max()
    assert approach == pytest.approx(2.0, rel=0.01)
