"""Histories of the sharp crack: what they are asked for, and what must hold of every one."""

from dataclasses import dataclass

import numpy as np
import pytest

from bem import (
    ForceProtocol,
    HardContact,
    PiecewiseLinearProtocol,
    PowerLaw,
    PronySeries,
    Scene,
    StandardLinearSolid,
)
from bem.methods.closed_forms import jkr
from bem.methods.outcomes import COMPLETED, DETACHED, OUT_OF_WORK
from bem.methods.records import MULTIPLY_ADDS
from bem.methods.sharp_crack import STEP_ERROR, march_crack
from bem.problem.tractions import Exponential

SOLID = StandardLinearSolid(0.1)
START = -(np.pi ** (2.0 / 3.0))


def path(times, depths, tabor):
    return PiecewiseLinearProtocol(times, tabor * np.array(depths))


@dataclass(frozen=True)
class OwnLaw(Exponential):
    """A law of a user."""


@pytest.mark.parametrize("scene", [Scene(100.0, SOLID), Scene(30.0, PronySeries([0.4, 0.3], [0.1, 3.0]), OwnLaw())])
def test_cycles_and_holds_complete(scene):
    times, depths = [0.0, 5.0, 5.5, 6.5, 7.5, 8.0, 14.0], [START, 3.0, 3.0, 0.0, 0.0, 2.0, START]
    result, error = march_crack(scene, path(times, depths, scene.tabor))
    records = result.records
    assert result.outcome == COMPLETED
    assert 0.0 < error < 0.05
    assert records["time"][-1] == times[-1]
    assert np.all(np.diff(records["time"]) >= 0.0)
    assert np.all(np.isin(times, records["time"]))
    assert np.all(np.isfinite(records["force"]))
    assert records["force"].max() < 1.6 / scene.material.modulus_ratio
    assert records["contact_radius"].min() == 0.0
    assert result.segment_steps.size == len(times) - 1


def test_snap_in_and_loss_are_jumps():
    result, _ = march_crack(Scene(100.0, SOLID), path([0.0, 5.0, 5.1], [START, 3.0, START], 100.0))
    snap, loss = result.jumps
    assert snap["force_after"] > 10.0 * snap["force_before"]
    assert loss["force_before"] > 1.0 > loss["force_after"]
    assert np.count_nonzero(result.records["time"] == loss["time"]) == 2


def test_recovering_dent_comes_into_contact():
    """Boundary elements at this Tabor parameter: lost at 5.11, in contact again at 6.96."""
    times, depths = [0.0, 5.0, 5.2, 5.5, 8.5, 9.5], [START, 3.0, 0.0, 0.0, 0.0, START]
    _, loss, back = march_crack(Scene(15.0, SOLID), path(times, depths, 15.0)).result.jumps
    assert loss["time"] == pytest.approx(5.11, abs=0.01)
    assert back["time"] == pytest.approx(6.96, abs=0.3)


def test_error_falls_with_tabor():
    errors = [
        march_crack(Scene(tabor, SOLID), path([0.0, 1.0], [3.0, -3.0], tabor)).error for tabor in (10.0, 100.0, 1000.0)
    ]
    assert np.all(np.diff(np.log(np.array(errors) - STEP_ERROR)) < -1.5)  # what the steps add is the same for all


@pytest.mark.parametrize("spring", [None, 2.0])
def test_fewer_steps_err_as_they_say(spring):
    """Against eight times as many steps and nodes: the expected error is that of nine histories in ten."""
    cycle, errors = path([0.0, 4.0, 6.0, 7.0], [START, 3.0, 3.0, START], 100.0), {}
    fine = march_crack(Scene(100.0, SOLID, spring=spring), cycle, fineness=4).result.records
    for fineness in (0.5, 1):
        records = march_crack(Scene(100.0, SOLID, spring=spring), cycle, fineness=fineness).result.records
        errors[fineness] = abs(records["force"].max() / fine["force"].max() - 1.0)
        assert errors[fineness] < STEP_ERROR / fineness
        assert records.size < fine.size
    assert min(errors.values()) > 0.0


def test_dwells_have_no_ripple():
    records = march_crack(Scene(300.0, SOLID), path([0.0, 5.0, 8.0], [START, 3.0, 3.0], 300.0)).result.records
    dwell = records[records["time"] > 5.01]
    log_time, force = np.log(dwell["time"] - 5.0), dwell["force"]
    between = np.diff(log_time)[:-1] / (log_time[2:] - log_time[:-2])
    smooth = force[:-2] + between * (force[2:] - force[:-2])
    assert np.abs(force[1:-1] / smooth - 1.0).max() < 2e-3
    assert np.diff(dwell["contact_radius"]).min() > -3e-4


def test_a_glassy_start_presses_harder():
    relaxed, glassy = (
        march_crack(Scene(100.0, SOLID), path([0.0, 1.0], [3.0, 3.0], 100.0), glassy=state).result.records["force"]
        for state in (False, True)
    )
    assert glassy[0] < 5.0 * relaxed[0] < 0.0
    assert abs(glassy[-1] - relaxed[-1]) < 0.4 * abs(glassy[0])


def test_faster_pulling_takes_more_force():
    largest = [
        march_crack(Scene(100.0, SOLID), path([0.0, time], [3.0, -3.0], 100.0)).result.records["force"].max()
        for time in (1e7, 1e5, 1e3, 10.0, 0.1)
    ]
    assert np.all(np.diff(largest) > 0.0)


def test_halved_steps_give_the_same():
    times = np.array([0.0, 5.0, 8.0, 13.0])
    depths = np.array([START, 3.0, 3.0, START])
    middle = np.linspace(0.0, 13.0, 60)
    fine = np.union1d(times, middle)
    forces = [
        march_crack(Scene(100.0, SOLID), path(nodes, np.interp(nodes, times, depths), 100.0))
        .result.records["force"]
        .max()
        for nodes in (times, fine)
    ]
    assert forces[0] == pytest.approx(forces[1], rel=5e-3)


@pytest.mark.parametrize(
    "scene",
    [Scene(30.0, SOLID, HardContact()), Scene(30.0, SOLID, indenter=PowerLaw(1.0))],
)
def test_other_scenes_are_refused(scene):
    with pytest.raises(ValueError, match="a sharp crack needs adhesion and a paraboloid"):
        march_crack(scene, path([0.0, 1.0], [-3.0, 1.0], 30.0))


def test_a_weight_makes_it_creep_to_rest():
    """By JKR: depth of a relaxed contact under the compression of 5."""
    scene = Scene(1000.0, SOLID)
    result, _ = march_crack(scene, ForceProtocol([0.0, 0.1, 1e10], [0.0, -5.0, -5.0]))
    assert result.outcome == COMPLETED
    assert np.diff(result.records["indentation"]).min() > -1e-4 * scene.tabor
    radius = result.records["contact_radius"][-1]
    assert float(jkr.force_from_contact_radius(radius)) == pytest.approx(-5.0, rel=3e-3)
    assert result.records["force"][-1] == pytest.approx(-5.0, abs=1e-4)


def test_a_pulled_contact_flies_off():
    slow, fast = (
        march_crack(Scene(1000.0, SOLID), ForceProtocol([0.0, time], [0.0, 30.0])).result for time in (1e13, 1e-3)
    )
    assert slow.outcome == fast.outcome == DETACHED
    assert np.isnan(slow.jumps["indentation_after"]).tolist() == [True]
    assert slow.records["force"][-1] == pytest.approx(jkr.PULL_OFF_FORCE, rel=5e-3)
    assert 1.5 < fast.records["force"][-1] / slow.records["force"][-1] < 10.0


def test_no_contact_bears_a_pull():
    result, error = march_crack(Scene(1000.0, SOLID), ForceProtocol([0.0, 1.0], [10.0, 0.0]))
    assert (result.outcome, result.records.size) == (DETACHED, 0)
    assert np.isnan(error)


def test_a_stiff_spring_is_none():
    times, depths = [0.0, 5.0, 8.0, 13.0], [START, 3.0, 3.0, START]
    held, sprung = (
        march_crack(Scene(100.0, SOLID, spring=spring), path(times, depths, 100.0)).result for spring in (None, 1e6)
    )
    assert sprung.records["force"].max() == pytest.approx(held.records["force"].max(), rel=1e-3)
    assert len(sprung.jumps) == len(held.jumps)


def test_a_spring_is_in_balance():
    scene = Scene(300.0, SOLID, spring=0.01)
    times, depths = np.array([0.0, 5.0, 8.0, 13.0]), np.array([START, 3.0, 3.0, 6.0 * START])
    result, _ = march_crack(scene, path(times, depths, 300.0))
    records = result.records
    stage = np.interp(records["time"], times, 300.0 * depths)
    jumps = np.isin(records["time"], result.jumps["time"])
    misfit = records["indentation"] - records["force"] / scene.spring - stage
    assert np.abs(misfit[~jumps]).max() < 1e-4 * 300.0 * 10.0
    assert len(result.jumps) == 2


def test_the_budget_ends_it():
    result, _ = march_crack(Scene(100.0, SOLID), path([0.0, 5.0, 10.0], [START, 3.0, START], 100.0), most_work=5e7)
    assert result.outcome == OUT_OF_WORK
    assert 0.0 < result.records["time"][-1] < 10.0


def test_cost_does_not_grow_with_tabor():
    """Some 30 ms of one core: a multiply-add of the budget takes 0.1 ns."""
    work = [
        march_crack(Scene(tabor, SOLID), path([0.0, 7.0, 8.0, 8.5], [START, 3.0, 3.0, START], tabor)).result.work
        for tabor in (100.0, 1000.0, 3000.0)
    ]
    assert max(counts[MULTIPLY_ADDS] for counts in work) < 5e8
    assert work[2][MULTIPLY_ADDS] < 1.05 * work[0][MULTIPLY_ADDS]


def test_no_error_is_known_without_contact():
    scene = Scene(100.0, StandardLinearSolid(0.1))
    assert np.isnan(march_crack(scene, PiecewiseLinearProtocol([0.0, 1.0], [-3000.0, -2000.0])).error)
