"""What is too small to matter is left out, said, and changes no result by more than its bound."""

import numpy as np
import pytest

from bem import HardContact, Scene, recommend, simulate, simulation
from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid
from bem.problem.negligible_effects import SimplifiedScene, simplified_scene
from bem.problem.protocol import ForceProtocol, LoadingProtocol, PiecewiseLinearProtocol
from tests.validation.cases import corners_of_the_papers_box, drawn_from_the_papers_box, ramps

SLS = StandardLinearSolid(0.1)
PATH = ramps(3.0, 2.0, 0.2, 2.0, -6.0)
SMALL, FAST, SLOW = ([0.8, 1e-6], [1.0, 0.05]), ([0.8, 0.1], [1.0, 1e-9]), ([0.8, 0.1], [1.0, 1e7])
CASES = [
    (Scene(1.0, StandardLinearSolid(1.0 - 1e-6)), "small term of strength 1e-06 and time 1", Elastic()),
    (Scene(1.0, PronySeries(*SMALL)), "small term of strength 1e-06 and time 0.05", PronySeries([0.8], [1.0])),
    (Scene(1.0, PronySeries(*FAST)), "fast term of strength 0.1 and time 1e-09", PronySeries([0.8], [1.0])),
    (Scene(1.0, PronySeries(*SLOW)), "slow term of strength 0.1 and time 1e+07", PronySeries([0.8 / 0.9], [1.0])),
    (Scene(1.0, SLS, spring=1e7), "spring of 1e+07", SLS),
    (Scene(1.0, spring=1e7), "spring of 1e+07", Elastic()),
]


@pytest.mark.parametrize(("scene", "named", "material"), CASES)
def test_negligible_effect_is_left_out(scene, named, material, monkeypatch):
    trajectory, glassy = simulate(scene, PATH), {"initial_state": "glassy"} if named.startswith("slow") else {}
    if glassy:  # the attraction at the start has deformed the slow solid
        assert trajectory.stats.left_out == ()
        trajectory = simulate(scene, PATH, **glassy)
    assert trajectory.stats.left_out == (named,)
    assert 0.0 < trajectory.stats.left_out_error < 0.1 * trajectory.accuracy
    assert trajectory.stats.memory_vectors == material.strengths.size
    scenes = []
    monkeypatch.setattr(
        simulation, "simplified_scene", lambda scene, *_: scenes.append(scene) or SimplifiedScene(scene, (), 0.0)
    )
    full = simulate(scene, PATH, 1e-3, **glassy)
    assert scenes == [scene]
    assert full.stats.left_out == ()
    assert trajectory.pull_off_force == pytest.approx(full.pull_off_force, rel=trajectory.accuracy)
    assert trajectory.hysteresis == pytest.approx(full.hysteresis, rel=2.0 * trajectory.hysteresis_accuracy)
    assert trajectory.contact_radius.max() == pytest.approx(full.contact_radius.max(), rel=0.01)
    assert trajectory.spring == scene.spring
    np.testing.assert_allclose(trajectory.stage, PATH.history(1.0).indentation_at(trajectory.time), atol=1e-12)


@pytest.mark.parametrize(
    ("scene", "protocol"),
    [
        (Scene(1.0, SLS), PATH),
        (Scene(1.0, SLS, spring=1e3), PATH),
        (Scene(1.0, StandardLinearSolid(0.99)), PATH),
        (Scene(1.0, PronySeries([0.8, 0.1], [1.0, 1e-4])), PATH),
        (Scene(1.0, PronySeries([0.8, 0.1], [1.0, 1e3])), PATH),
        (Scene(1.0, PronySeries(*FAST)), ForceProtocol([0.0, 1.0], [0.0, -1.0])),
        (Scene(1.0, PronySeries(*SMALL), HardContact()), PATH),
        (Scene(1.0), PATH),
    ],
)
def test_what_matters_or_costs_nothing_stays(scene, protocol):
    path = protocol.history(1.0) if isinstance(protocol, LoadingProtocol) else protocol
    assert simplified_scene(scene, path, 4e-3) == (scene, (), 0.0)


def test_papers_box_leaves_nothing_out():
    for scene, protocol in [*corners_of_the_papers_box(), *drawn_from_the_papers_box(200)]:
        for target in (4e-3, 5e-2):
            assert simplified_scene(scene, protocol.history(scene.tabor), target) == (scene, (), 0.0)


def test_bounds_together_stay_below_a_tenth():
    count = 20
    material = PronySeries(np.full(count, 4e-5), np.geomspace(0.1, 10.0, count))
    path = PiecewiseLinearProtocol([0.0, 1.0], [-3.0, 1.0])
    simplified = simplified_scene(Scene(1.0, material), path, 4e-3)
    assert 1 < len(simplified.left_out) < count
    assert simplified.error < 4e-4
    assert simplified.scene.material.strengths.size == count - len(simplified.left_out)


def test_a_mesh_of_ones_own_keeps_everything():
    trajectory = simulate(CASES[0][0], PATH, "draft", mesh=np.linspace(0.0, 9.0, 90))
    assert trajectory.stats.left_out == ()
    assert trajectory.stats.memory_vectors == 1


@pytest.mark.parametrize(("scene", "material"), [(CASES[1][0], CASES[1][2]), (CASES[4][0], CASES[4][2])])
def test_recommendation_has_the_same_bounds(scene, material):
    recommendation = recommend(scene, PATH, 1e-3, best="fewest")
    assert recommendation.found_by == "estimate"
    assert recommendation.scene.spring is None
    assert recommendation.scene.material.strengths.tolist() == pytest.approx(material.strengths.tolist())
