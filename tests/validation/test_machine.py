"""A spring between stage and sphere, and a prescribed force, against closed forms and against the rigid machine.

Sources: Maugis, Contact, Adhesion and Rupture of Elastic Solids (2000), section 4.2, on stability behind a spring; Lee
and Radok, J. Appl. Mech. 27 (1960) 438, on creep.
"""

import numpy as np
import pytest

from bem import ConstantStress, HardContact, LennardJones, Scene, simulate
from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid
from bem.problem.protocol import ForceProtocol, PiecewiseLinearProtocol
from bem.simulation import count_unstable
from tests.validation.cases import completed, ramps, stage_area

SLS = StandardLinearSolid(0.1)
CYCLE = ramps(5.0, 1.0, 0.5, 1.0, -10.0)
DEAD_LOAD = ForceProtocol([0.0, 1.0, 2.0], [0.0, -5.0, 3.0])
PUSHED = ForceProtocol([0.0, 1.0, 3.0], [0.0, -5.0, -5.0])


@pytest.mark.parametrize("scene", [Scene(1.0), Scene(1.0, SLS), Scene(0.2, SLS), Scene(2.0)])
def test_a_very_stiff_spring_is_none(scene):
    rigid = completed(scene, CYCLE)
    endless, stiff = (
        completed(Scene(scene.tabor, scene.material, scene.adhesion, spring=k), CYCLE) for k in (np.inf, 1e12)
    )
    assert np.array_equal(endless.force, rigid.force)
    assert endless.spring is None
    assert stiff.time.size == rigid.time.size
    np.testing.assert_allclose(stiff.indentation, rigid.indentation, atol=1e-8)
    # The steps differ by what a fold makes of the spring's 1e-12, so that forces are compared at equal times; each side
    # of a jump is where a record is.
    smooth = ~np.isin(rigid.time, [jump.time for jump in rigid.jumps])
    np.testing.assert_allclose(stiff.force[smooth], rigid.at(stiff.time[smooth]), rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(stiff.force[~smooth], rigid.force[~smooth], rtol=1e-7, atol=1e-9)


def test_stiff_spring_is_none_no_adhesion():
    # There rounding decides which node at the edge of the contact is the last to press.
    rigid, stiff = (completed(Scene(1.0, SLS, HardContact(), spring), CYCLE) for spring in (np.inf, 1e12))
    times = np.linspace(0.0, rigid.time[-1], 500)
    assert np.max(np.abs(stiff.at(times) - rigid.at(times))) < 1e-4 * np.ptp(rigid.force)


@pytest.mark.parametrize("tabor", [0.2, 1.0, 3.0])
def test_elastic_pull_off_ignores_stiffness(tabor):
    rigid = completed(Scene(tabor), CYCLE)
    deep = ramps(5.0, 1.0, 0.0, 1.0, -20.0)
    for spring in (0.2, 1.0, 30.0):
        trajectory = completed(Scene(tabor, spring=spring), deep)
        assert trajectory.detached
        assert trajectory.pull_off_force == pytest.approx(rigid.pull_off_force, rel=2.0 * rigid.accuracy)


@pytest.mark.parametrize("tabor", [0.05, 0.2, 1.0, 3.0])
def test_dead_load_flies_off_at_pull_off(tabor):
    rigid, trajectory = completed(Scene(tabor), CYCLE), completed(Scene(tabor), DEAD_LOAD)
    assert trajectory.detached
    assert trajectory.status.startswith("detached: no contact bears the prescribed force (at time ")
    assert trajectory.time[-1] < 2.0
    (jump,) = trajectory.jumps
    assert jump.time == trajectory.time[-1]
    assert jump.force_before == pytest.approx(rigid.pull_off_force, rel=rigid.accuracy)
    assert trajectory.pull_off_force == pytest.approx(rigid.pull_off_force, rel=rigid.accuracy)
    assert np.isnan(jump.indentation_after)
    assert abs(jump.eigenvalue_before) < 0.02


@pytest.mark.parametrize("spring", [0.4, 1.0])
def test_jump_where_slope_meets_spring(spring):
    trajectory, rigid = completed(Scene(1.0, spring=spring), CYCLE, 1e-3), completed(Scene(1.0), CYCLE, 1e-3)
    jump_in, jump_out = trajectory.jumps
    # Greenwood (1997): the branches of the rigid machine; the whole is unstable where the force rises by k.
    held = rigid.unloading & (rigid.force > 0.0) & (rigid.indentation < 1.0) & (rigid.time < rigid.jumps[-1].time)
    depth, force = rigid.indentation[held][::-1], rigid.force[held][::-1]
    middle, slopes = 0.5 * (depth[1:] + depth[:-1]), np.diff(force) / np.diff(depth)
    past = middle < depth[np.argmax(force)]
    at = np.interp(-spring, -slopes[past], middle[past])
    assert jump_out.indentation == pytest.approx(at, abs=0.01)
    assert jump_out.force_before == pytest.approx(np.interp(at, depth, force), rel=0.01)
    for jump in (jump_in, jump_out):
        # The stage stands still: force and indentation move along the spring.
        moved = jump.indentation_after - jump.indentation
        assert jump.force_after - jump.force_before == pytest.approx(spring * moved, rel=1e-9)
        assert abs(jump.eigenvalue_before) < 0.05
        assert jump.eigenvalue_after > 0.0
    assert jump_in.indentation_after > jump_in.indentation + 0.5
    assert jump_out.indentation_after < jump_out.indentation - 0.5


@pytest.mark.parametrize("material", [Elastic(), SLS, PronySeries([0.4, 0.4], [0.1, 10.0])])
@pytest.mark.parametrize("adhesion", [None, HardContact()])
@pytest.mark.parametrize("spring", [0.3, 20.0])
def test_stage_follows_the_protocol(material, adhesion, spring):
    scene = Scene(1.0, material, *(() if adhesion is None else (adhesion,)), spring=spring)
    trajectory = completed(scene, CYCLE)
    prescribed = CYCLE.history(1.0).indentation_at(trajectory.time)
    np.testing.assert_allclose(trajectory.indentation - trajectory.force / spring, prescribed, atol=1e-9)
    np.testing.assert_array_equal(trajectory.stage, trajectory.indentation - trajectory.force / spring)
    # Tension holds the sphere deeper than the stage, compression less deep.
    assert np.all((trajectory.indentation - prescribed) * trajectory.force >= -1e-9)


@pytest.mark.parametrize("material", [Elastic(), SLS])
@pytest.mark.parametrize("adhesion", [None, HardContact()])
def test_the_force_is_what_the_protocol_says(material, adhesion):
    trajectory = completed(Scene(1.0, material, *(() if adhesion is None else (adhesion,))), PUSHED)
    np.testing.assert_allclose(trajectory.force, np.interp(trajectory.time, PUSHED.times, PUSHED.forces), atol=2e-4)
    assert trajectory.at(0.5) == pytest.approx(-2.5, abs=2e-4)


@pytest.mark.parametrize("ratio", [0.5, 0.1])
def test_creep_under_a_weight(ratio):
    trajectory = completed(
        Scene(1.0, StandardLinearSolid(ratio), HardContact()), ForceProtocol([0.0, 1e-5, 8.0], [0.0, -5, -5]), 1e-3
    )
    held = trajectory.time > 1e-3
    creep = 1.0 - (1.0 - ratio) * np.exp(-trajectory.time[held])
    np.testing.assert_allclose(trajectory.indentation[held], (0.75 * np.pi * 5.0 * creep) ** (2.0 / 3.0), rtol=2e-3)


def test_creep_under_a_growing_force():
    material = PronySeries([0.5, 0.3], [0.2, 3.0])
    trajectory = completed(Scene(1.0, material, HardContact()), ForceProtocol([0.0, 4.0], [0.0, -20.0]), 1e-3)
    t = trajectory.time[trajectory.time > 0.4]
    lag = sum(c * tau * (1.0 - np.exp(-t / tau)) for c, tau in zip(material.strengths, material.times, strict=True))
    exact = (0.75 * np.pi * 5.0 * (t - lag)) ** (2.0 / 3.0)
    np.testing.assert_allclose(trajectory.indentation[trajectory.time > 0.4], exact, rtol=2e-3)


@pytest.mark.parametrize(
    ("scene", "protocol"),
    [
        (Scene(1.0, SLS, spring=10.0), CYCLE),
        (Scene(1.0, SLS, HardContact(), spring=0.5), CYCLE),
        (Scene(1.0, SLS), ForceProtocol([0.0, 1.0, 2.0, 4.0], [0.0, -5.0, -5.0, 0.5])),
        (Scene(0.3, SLS), ForceProtocol([0.0, 0.1, 2.0, 4.0], [0.0, -5.0, -5.0, 0.5])),
        (Scene(1.0, SLS, ConstantStress()), ForceProtocol([0.0, 1.0, 2.0, 4.0], [0.0, -5.0, -5.0, 0.5])),
    ],
)
def test_path_gives_the_force_back(scene, protocol):
    trajectory = completed(scene, protocol, 1e-3)
    assert trajectory.jumps == ()
    time, first = np.unique(trajectory.time, return_index=True)
    path = PiecewiseLinearProtocol(time, trajectory.indentation[first])
    again = completed(Scene(scene.tabor, scene.material, scene.adhesion), path, 1e-3)
    force = trajectory.force[first]
    assert np.max(np.abs(again.at(time) - force)) < 0.01 * np.ptp(force)


def test_cornered_law_takes_no_more_steps():
    """Each step that failed at a corner of the law was taken for a fold, and the budget was spent on tiny ones."""
    protocol = ForceProtocol([0.0, 0.23, 0.38], [0.0, -94.0, 0.0])
    steep, smooth = (
        completed(Scene(2.8, StandardLinearSolid(0.4), law), protocol, "draft")
        for law in (ConstantStress(), LennardJones())
    )
    assert steep.stats.steps < 4 * smooth.stats.steps


@pytest.mark.parametrize("scene", [Scene(1.0), Scene(1.0, SLS), Scene(1.0, adhesion=HardContact())])
def test_unbearable_first_force_is_said(scene):
    trajectory = simulate(scene, ForceProtocol([0.0, 1.0], [1.7, 0.0]))
    assert trajectory.status == "not started: no contact bears the prescribed force"
    assert trajectory.time.size == 0
    assert np.isnan(trajectory.pull_off_force)
    assert not trajectory.detached


@pytest.mark.parametrize("force", [-5.0, 0.0, 1.0])
def test_prescribed_force_begins_in_contact(force):
    trajectory = completed(Scene(1.0), ForceProtocol([0.0, 1.0], [force, force]))
    assert trajectory.force[0] == pytest.approx(force, abs=1e-3)
    assert trajectory.contact_radius[0] > 1.0
    assert trajectory.jumps == ()
    np.testing.assert_allclose(trajectory.indentation, trajectory.indentation[0], atol=1e-3)


@pytest.mark.parametrize("adhesion", [None, HardContact()])
def test_sphere_and_stage_lose_the_same(adhesion):
    scene = Scene(1.0, SLS, *(() if adhesion is None else (adhesion,)), spring=3.0)
    trajectory = completed(scene, CYCLE, 1e-3)
    assert trajectory.detached
    assert stage_area(trajectory) == pytest.approx(trajectory.hysteresis, rel=0.01)


def test_spring_slows_viscoelastic_retreat():
    # The stretched spring keeps pulling while the edge creeps, so that the edge needs less speed and less force.
    forces = [completed(Scene(1.0, SLS, spring=spring), CYCLE).pull_off_force for spring in (1e3, 3.0, 1.0)]
    assert np.all(np.diff(forces) < -0.02)


@pytest.mark.parametrize(
    ("scene", "protocol"),
    [(Scene(1.0, spring=0.5), CYCLE), (Scene(1.0, SLS, spring=0.5), CYCLE), (Scene(1.0), DEAD_LOAD)],
)
def test_no_state_is_unstable(scene, protocol):
    assert count_unstable(scene, protocol) == 0


def test_creep_to_rupture_under_a_weight():
    # Held just below what the relaxed contact bears, it stays; above, it creeps apart, the sooner the more it bears.
    limit = completed(Scene(1.0), CYCLE).pull_off_force
    hung = [
        completed(Scene(1.0, SLS), ForceProtocol([0.0, 0.1, 1.0, 300.0], [0.0, -5.0, load, load]))
        for load in (0.97 * limit, 1.2 * limit, 1.6 * limit)
    ]
    assert not hung[0].detached
    assert hung[0].time[-1] == 300.0
    assert hung[1].detached
    assert hung[2].detached
    assert 1.0 < hung[2].time[-1] < hung[1].time[-1] < 300.0
