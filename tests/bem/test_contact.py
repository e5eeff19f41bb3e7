from itertools import pairwise

import numpy as np
import pytest

import bem
from bem import Contact, Elastic, HardContact, LoadingProtocol, PronySeries, Scene, StandardLinearSolid

SLS = StandardLinearSolid(0.1)
CYCLE = LoadingProtocol(peak_indentation=5.0, loading_rate=10.0, dwell_time=0.5, unloading_rate=10.0)


@pytest.mark.parametrize(
    "scene",
    [
        Scene(1.0, SLS),
        Scene(3.2, SLS),
        Scene(1.0, Elastic()),
        Scene(1.0, PronySeries([0.3, 0.4], [0.1, 3.0])),
        Scene(1.0, SLS, HardContact()),
        Scene(1.0, SLS, spring=2.0),
    ],
    ids=str,
)
def test_the_steps_add_up_to_the_trajectory(scene):
    history = CYCLE.history(scene.tabor)
    parts = [np.linspace(a, b, max(int((b - a) / 0.02), 1) + 1) for a, b in pairwise(history.times)]
    instants = np.unique(np.concatenate(parts))
    contact, depths = Contact(scene), history.indentation_at(instants)
    forces = [contact.advance(step, indentation=at) for step, at in zip(np.diff(instants), depths[1:], strict=True)]
    expected = bem.simulate(scene, CYCLE, 1e-3).at(instants[1:])
    np.testing.assert_allclose(forces, expected, atol=4e-3 * np.ptp(expected))


def test_force_steps_match_a_force_protocol():
    protocol = bem.ForceProtocol([0.0, 1.0, 3.0, 4.0], [0.0, -4.0, -4.0, 1.0])
    contact = Contact(Scene(1.0, SLS))
    contact.advance(1.0, force=0.0)
    contact.advance(1e5, force=0.0)  # a force protocol begins relaxed
    depths = [contact.advance(duration, force=force) for duration, force in ((1.0, -4.0), (2.0, -4.0), (1.0, 1.0))]
    trajectory = bem.simulate(Scene(1.0, SLS), protocol)
    expected = np.interp([1.0, 3.0, 4.0], trajectory.time, trajectory.indentation)
    np.testing.assert_allclose(depths, expected, atol=0.05)


def test_copy_looks_ahead_changing_nothing():
    contact = Contact(Scene(1.0, SLS))
    contact.advance(1.0, indentation=5.0)
    before = (contact.time, contact.force, contact.indentation, contact.contact_radius)
    ahead = contact.copy()
    pulled = ahead.advance(0.2, indentation=3.0)
    assert repr(ahead).startswith("<Contact: time 1.2, indentation 3, force ")
    assert (contact.time, contact.force, contact.indentation, contact.contact_radius) == before
    assert contact.advance(0.2, indentation=3.0) == pulled


def test_a_deeper_indentation_finds_room():
    contact = Contact(Scene(1.0, SLS))
    for depth in (1.0, 10.0, 30.0):
        force = contact.advance(1.0, indentation=depth)
    path = bem.PiecewiseLinearProtocol([0.0, 1.0, 2.0, 3.0], [-(np.pi ** (2 / 3)), 1.0, 10.0, 30.0])
    assert force == pytest.approx(bem.simulate(Scene(1.0, SLS), path).force[-1], rel=4e-3)


def test_impossible_step_leaves_a_status():
    contact = Contact(Scene(1.0, Elastic()))
    contact.advance(1.0, indentation=1.0)
    before = (contact.time, contact.indentation)
    assert np.isnan(contact.advance(1.0, force=50.0))
    assert contact.status.startswith("detached")
    assert (contact.time, contact.indentation) == before
    assert np.isfinite(contact.advance(1.0, indentation=0.0))
    assert contact.status == "completed"


@pytest.mark.parametrize("step", [{"indentation": 20.0}, {"force": -60.0}, {"force": 50.0}], ids=str)
def test_failed_step_leaves_the_state(step, monkeypatch):
    """Also where the steps before were taken again on a larger mesh: here its budget ends the step."""
    contact = Contact(Scene(0.5, SLS), "draft", deepest=1.0)
    contact.advance(1.0, indentation=0.5)
    before = contact.time, contact.indentation, contact.force, contact.contact_radius
    with monkeypatch.context() as context:
        context.setattr("bem.contact.MOST_WORK", 2e6)
        assert np.isnan(contact.advance(1.0, **step))
    assert (contact.time, contact.indentation, contact.force, contact.contact_radius) == before
    assert np.isfinite(contact.advance(1.0, indentation=0.4))


def content_of(state):
    """All numbers of a state as bytes."""
    if isinstance(state, tuple):
        return b"".join(map(content_of, state))
    return np.asarray(state).tobytes()


def test_absurd_steps_leave_the_state(monkeypatch):
    """Of 400 steps at random, over 16 decades of time and 5 of depth and force, some two in five cannot be taken."""
    monkeypatch.setattr("bem.contact.MOST_WORK", 3e7)
    rng, failed = np.random.default_rng(5), 0
    for number in range(40):
        spring = (None, 0.05, 1.0, 20.0)[number % 4]
        scene = Scene(np.exp(rng.uniform(*np.log([0.02, 5.0]))), (SLS, Elastic())[number % 2], spring=spring)
        contact = Contact(scene, "draft", deepest=1.0)
        for _ in range(10):
            value = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-2.0, 3.0)
            step = {str(rng.choice(["indentation", "force"])): float(value)}
            before = content_of((contact.time, contact._now.progress.state, contact._now.progress.memory))
            if np.isnan(contact.advance(10.0 ** rng.uniform(-8.0, 8.0), **step)):
                failed += 1
                assert content_of((contact.time, contact._now.progress.state, contact._now.progress.memory)) == before
                assert contact.status != "completed"
            else:
                assert np.isfinite([contact.force, contact.indentation]).all()
    assert failed > 100


def test_a_real_bead_is_refused():
    with pytest.raises(ValueError, match=r"Contact takes boundary elements and cannot start: .* grid nodes"):
        Contact(Scene(1000.0, SLS))
