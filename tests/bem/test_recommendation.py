"""`recommend` keeps its promise on a random sample, leaves out what plainly does not matter, and its pages hold."""

import doctest
import re
from pathlib import Path

import numpy as np
import pytest

import bem
from bem import HardContact, Scene
from bem.problem.effects import Effects, choices, reduced
from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid
from bem.problem.protocol import LoadingProtocol, PiecewiseLinearProtocol
from bem.problem.scene import SMALLEST_TABOR
from bem.recommendation import difference, operations, recommend
from tests.processes import ROOT
from tests.validation.cases import drawn_from_the_papers_box

SLS = StandardLinearSolid(0.1)


PAGE = ROOT / "docs" / "effects.md"


def ramp(depth, rate, dwell=0.1, start=None):
    return LoadingProtocol(
        peak_indentation=depth, loading_rate=rate, dwell_time=dwell, unloading_rate=rate, start_indentation=start
    )


@pytest.mark.parametrize(("rate", "effects"), [(1e6, "elastic glassy"), (1e-3, "elastic rubbery")])
def test_extremes_need_no_memory_or_adhesion(rate, effects):
    advice = recommend(Scene(1.0, SLS), ramp(900.0, rate, 0.0), 0.05, best="fewest")
    assert str(advice.effects) == f"{effects}, without adhesion"
    assert advice.found_by == "estimate"
    assert advice.scene.material == Elastic()
    assert advice.scene.adhesion == HardContact()
    assert advice.estimate < 0.05


def test_a_touch_needs_everything():
    advice = recommend(Scene(1.0, SLS), ramp(-0.5, 3.0), 0.01)
    assert advice.found_by == "nothing is left out"
    assert str(advice) == f"{advice.effects} (nothing is left out)"
    assert (advice.estimate, advice.effects.everything, advice.effects.adhesion) == (0.0, True, True)


def test_terms_out_of_reach_are_left_out():
    broad = PronySeries([0.3, 0.3, 0.3], [1e-6, 1.0, 1e6])
    advice = recommend(Scene(1.0, broad), ramp(20.0, 20.0, 0.5), 0.02, best="fewest")
    assert (advice.effects.first, advice.effects.last) == (1, 2)


def test_left_out_terms_change_little():
    """Frozen and relaxed terms, simulated beside the full solid whose times are far away from the protocol."""
    scene, protocol = Scene(1.0, PronySeries([0.2, 0.3, 0.3], [1e-5, 1.0, 1e5])), ramp(4.0, 4.0, 0.2, -10.0)
    simple, path = reduced(scene, protocol, Effects(adhesion=True, first=1, last=2, of=3))
    assert simple.material == StandardLinearSolid(1.0 - 0.3 / 0.7)
    full, reduced_trajectory = bem.simulate(scene, protocol, 1e-3), bem.simulate(simple, path, 1e-3)
    assert difference(reduced_trajectory, full, protocol.history(1.0), "force") < 2e-3
    assert reduced_trajectory.pull_off_force == pytest.approx(full.pull_off_force, rel=5e-3)


def test_promise_holds_on_a_random_sample():
    for scene, protocol in drawn_from_the_papers_box(12):
        advice = recommend(scene, protocol, 0.05)
        full = bem.simulate(scene, protocol)
        simple = bem.simulate(advice.scene, advice.protocol)
        assert difference(simple, full, protocol.history(scene.tabor), "force") < 0.05
        assert operations(simple) <= operations(full)


@pytest.mark.parametrize("quantity", ["pull_off_force", "hysteresis"])
def test_other_quantities_are_simulated(quantity):
    advice = recommend(Scene(0.3, SLS), ramp(3.0, 1e-2, 1.0), 0.3, quantity=quantity, best="fewest")
    assert advice.found_by in ("simulation", "nothing is left out")
    if quantity == "pull_off_force":
        assert advice.effects.adhesion
        assert advice.effects.terms == 0


def test_any_history_will_do():
    cycles = PiecewiseLinearProtocol([0, 1, 2, 3, 4], [-2, 20, 0, 20, -2])
    advice = recommend(Scene(1.0, SLS), cycles, 0.1)
    assert advice.protocol is cycles
    assert advice.effects.terms == 1


def test_peak_below_contact_is_a_protocol():
    advice = recommend(Scene(1.0, SLS), ramp(-1.5, 10.0), 0.5, best="fewest")
    assert advice.effects.terms == 0
    assert advice.scene.tabor != 1.0
    assert advice.protocol == ramp(-1.5, 10.0).history(1.0)


@pytest.mark.parametrize("best", ["cheapest", "fewest"])
def test_choices_outside_scenes_are_none(best):
    rigid = Scene(SMALLEST_TABOR, SLS)
    assert all(reduced(rigid, ramp(1.0, 1.0), effects)[0].tabor >= SMALLEST_TABOR for effects in choices(rigid))
    assert recommend(rigid, ramp(1.0, 1.0), 0.05, best=best).scene.tabor >= SMALLEST_TABOR


def test_cheapest_costs_no_more_than_full():
    slow, scene = ramp(5.0, 1e-2), Scene(5.0, SLS)
    fewest, cheapest = (recommend(scene, slow, 0.3, best=best) for best in ("fewest", "cheapest"))
    assert fewest.effects.terms == 0
    assert cheapest.cost <= min(fewest.cost, 1.0)


def test_operations_tell_the_slower_scene():
    touch, press = (bem.simulate(Scene(1.0, SLS), ramp(depth, 10.0), "draft") for depth in (0.5, 50.0))
    assert 0.0 < operations(touch) < operations(press)
    assert operations(bem.simulate(Scene(1e4, SLS), ramp(50.0, 10.0), profiles=2)) == np.inf  # cannot start


def test_radii_have_the_full_scenes_units():
    """A contact without adhesion has the radius of Hertz, sqrt(indentation / mu), whatever its modulus."""
    scene = Scene(1.0, SLS, HardContact())
    advice = recommend(scene, ramp(9.0, 1e7, 0.0), 0.05, best="fewest")
    assert advice.scene.tabor == pytest.approx(0.1 ** (2.0 / 3.0))
    assert advice.radius_scale == pytest.approx(0.1 ** (1.0 / 3.0))
    radius = advice.radius_scale * np.max(bem.simulate(advice.scene, advice.protocol).contact_radius)
    assert radius == pytest.approx(3.0, rel=0.02)
    assert recommend(scene, ramp(9.0, 1e-3), 0.05).radius_scale == 1.0


def test_only_a_stiff_spring_is_left_out():
    protocol = ramp(5.0, 5.0, 0.0, -9.0)
    stiff, soft = (recommend(Scene(1.0, SLS, spring=k), protocol, 0.02, best="fewest") for k in (1e5, 1.0))
    assert str(stiff.effects) == "viscoelastic, adhesive"
    assert stiff.scene == Scene(1.0, SLS)
    assert stiff.found_by == "estimate"
    assert str(soft.effects) == "viscoelastic, adhesive, with a spring"
    assert soft.scene.spring == 1.0
    assert soft.found_by == "nothing is left out"


def test_files_named_by_the_page_exist():
    text = PAGE.read_text(encoding="utf-8")
    rows = re.findall(r"^\| .*\|(.*)\|$", text.split("Code in `bem/methods/`")[1], flags=re.MULTILINE)
    named = re.findall(r"`([\w./]+(?:\.py|/))`", "".join(rows))
    assert len(named) >= 8
    assert [path for path in named if not (Path(bem.__file__).parent / "methods" / path).exists()] == []
    assert "images/figure-effects.png" in text
    assert (PAGE.parent / "images" / "figure-effects.png").is_file()


@pytest.mark.parametrize(("page", "least"), [(PAGE, 10), (PAGE.with_name("cost.md"), 4)])
def test_every_example_of_the_page_holds(page, least):
    examples = doctest.testfile(str(page), module_relative=False)
    assert examples.attempted > least
    assert examples.failed == 0
