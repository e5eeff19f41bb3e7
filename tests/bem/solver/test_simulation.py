import dataclasses

import numpy as np
import pytest

from bem import (
    Elastic,
    HardContact,
    LennardJones,
    LoadingProtocol,
    PiecewiseLinearProtocol,
    PronySeries,
    Scene,
    StandardLinearSolid,
    simulate,
)
from bem.solver import simulation
from bem.solver.discretisation.mesh import uniform_mesh

SOFT = StandardLinearSolid(modulus_ratio=0.1)
PROTOCOL = LoadingProtocol(peak_indentation=4.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
ARRAYS = ("time", "indentation", "force", "contact_radius")


def run(material=SOFT, adhesion=None, tabor=1.0, protocol=PROTOCOL, accuracy="draft", **options):
    scene = Scene(tabor=tabor, material=material, adhesion=adhesion or LennardJones())
    trajectory = simulate(scene, protocol, accuracy, **options)
    assert trajectory.completed, trajectory.status
    return trajectory


def test_arrays_are_parallel_float64_and_meet_the_ends_of_the_protocol():
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


def test_each_effect_has_its_own_cost_in_memory_vectors():
    terms = {1: [0.8], 2: [0.4, 0.4], 3: [0.3, 0.3, 0.2]}
    assert run(material=Elastic()).stats.memory_vectors == 0
    assert run(material=StandardLinearSolid(modulus_ratio=1.0)).stats.memory_vectors == 0
    assert run().stats.memory_vectors == 1
    for count, strengths in terms.items():
        material = PronySeries(strengths, 10.0 ** np.arange(count))
        assert run(material=material).stats.memory_vectors == count


@pytest.mark.parametrize("accuracy", ["draft", "standard"])
@pytest.mark.parametrize("material", [Elastic(), SOFT])
def test_hard_contact_needs_fewer_steps_and_solves_for_the_closed_nodes_only(material, accuracy):
    nonadhesive = run(material=material, adhesion=HardContact(), tabor=3.2, accuracy=accuracy).stats
    adhesive = run(material=material, tabor=3.2, accuracy=accuracy).stats
    assert nonadhesive.steps < adhesive.steps
    assert nonadhesive.unknowns_per_solve < 0.8 * nonadhesive.nodes
    assert nonadhesive.fold_solves == 0


def test_the_far_field_leaves_the_linear_solve():
    stats = run().stats
    assert 3.0 < stats.unknowns_per_solve < 0.7 * stats.nodes


def test_phases_that_do_not_occur_take_no_steps():
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


def test_an_impossible_scene_says_so_with_the_figure_before_it_starts():
    protocol = dataclasses.replace(PROTOCOL, peak_indentation=100.0)
    trajectory = simulate(Scene(tabor=200.0, material=SOFT), protocol)
    assert trajectory.status.startswith("not started: the contact edge needs ")
    assert int(trajectory.status.split("needs ")[1].split()[0]) > 150_000
    assert not trajectory.completed
    assert all(getattr(trajectory, name).size == 0 for name in ARRAYS)
    assert np.isnan([trajectory.pull_off_force, trajectory.hysteresis, trajectory.max_compression]).all()
    assert trajectory.stats.steps == 0


@pytest.mark.parametrize("material", [Elastic(), SOFT])
def test_a_users_mesh_agrees_with_the_one_that_follows_the_edge(material):
    own = run(material=material, accuracy="standard", mesh=uniform_mesh(7.0, 200))
    ours = run(material=material, accuracy="standard")
    assert own.stats.nodes == own.stats.grid_nodes == 200
    assert own.stats.remeshings == 0
    assert own.pull_off_force == pytest.approx(ours.pull_off_force, rel=0.01)
    if material is SOFT:
        assert own.hysteresis == pytest.approx(ours.hysteresis, rel=0.01)


@pytest.mark.parametrize("adhesion", [LennardJones(), HardContact()])
def test_a_mesh_that_ends_inside_the_contact_is_refused(adhesion):
    deep = dataclasses.replace(PROTOCOL, peak_indentation=20.0)
    with pytest.raises(ValueError, match=r"mesh must reach beyond the contact, .*; received one that ends at 2"):
        run(adhesion=adhesion, protocol=deep, mesh=uniform_mesh(2.0, 200))


def test_the_accuracy_is_that_of_the_last_mesh_that_was_tried(monkeypatch):
    module = simulation
    march, discretise, asked = module.march, module.discretise, []

    def lost(*arguments):
        return march(*arguments)._replace(outcome=module.NO_EQUILIBRIUM)

    def with_little_memory(scene, deepest, controls, *others):
        asked.append(controls)
        if len(asked) > 2:
            raise MemoryError("the contact edge needs more")
        return discretise(scene, deepest, controls, *others)

    monkeypatch.setattr(module, "march", lost)
    monkeypatch.setattr(module, "discretise", with_little_memory)
    trajectory = simulate(Scene(1.0, SOFT), PROTOCOL, 0.02)
    assert not trajectory.completed
    assert len(asked) == 3
    assert trajectory.accuracy == 0.01


def test_a_glassy_start_is_the_elastic_solution_of_the_instantaneous_modulus():
    path = PiecewiseLinearProtocol([0.0, 1e-7], [-1.0, 3.0])
    glassy = run(protocol=path, accuracy=1e-3, initial_state="glassy")
    relaxed = run(protocol=path, accuracy=1e-3)
    stiff = run(material=Elastic(), tabor=0.1 ** (2.0 / 3.0), protocol=path, accuracy=1e-3)
    soft = run(material=Elastic(), protocol=path, accuracy=1e-3)
    assert glassy.force[0] == pytest.approx(stiff.force[0], rel=1e-3)
    assert glassy.force[-1] == pytest.approx(stiff.force[-1], rel=1e-3)
    assert relaxed.force[0] == pytest.approx(soft.force[0], rel=1e-3)
    assert abs(glassy.force[0] / relaxed.force[0] - 1.0) > 0.05


def test_a_held_contact_relaxes_to_the_elastic_force():
    path = PiecewiseLinearProtocol([0.0, 1e-3, 60.0], [-1.0, 3.0, 3.0])
    held, elastic = (run(material=material, protocol=path, accuracy=1e-3) for material in (SOFT, Elastic()))
    assert held.force[-1] == pytest.approx(elastic.force[-1], rel=1e-3)
    assert held.max_compression < 3.0 * elastic.max_compression


def test_a_jump_is_recorded_twice_at_its_instant():
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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"scene": "a sphere"}, r"^scene must be one of Scene\(\.\.\.\); received 'a sphere'$"),
        ({"protocol": 3.0}, r"^protocol must be one of LoadingProtocol\(\.\.\.\), Piece.*; received 3\.0$"),
        ({"accuracy": "perfect"}, r"^accuracy must be 'draft', .*; received 'perfect'$"),
        ({"initial_state": "wet"}, r"^initial_state must be 'relaxed' or 'glassy'; received 'wet'$"),
        ({"mesh": [0.0, 2.0, 1.0]}, r"^mesh must start at 0 and increase strictly; received"),
        ({"mesh": [0.0, 2.0]}, r"^mesh must be a 1D array of at least 3 finite radii"),
    ],
)
def test_bad_input_is_named_with_what_is_allowed(change, message):
    arguments = {"scene": Scene(tabor=1.0), "protocol": PROTOCOL, "accuracy": "draft"} | change
    with pytest.raises(ValueError, match=message):
        simulate(**arguments)


@pytest.mark.parametrize("far", [1.0, 2.0, 5.0, 10.0])
@pytest.mark.parametrize("tabor", [0.02, 0.05])
def test_the_pull_before_contact_is_in_the_history_of_a_nearly_rigid_solid(tabor, far):
    """Its gap is predicted over any distance, so nothing but the course of the force keeps steps from leaping it."""
    protocol = PiecewiseLinearProtocol([0.0, 1.0, 2.0], [-far, 2.0, -far])
    trajectory = simulate(Scene(tabor, StandardLinearSolid(0.1)), protocol)
    approach = trajectory.force[~trajectory.unloading].max()
    assert approach == pytest.approx(2.0, rel=0.01)
