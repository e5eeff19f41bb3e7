"""The bounds against closed forms, and what becomes of a result that breaks one."""

import numpy as np
import pytest

import bem
from bem import simulation
from bem.methods.outcomes import COMPLETED, NOT_BALANCED, NOT_FINITE, TOO_MUCH_TENSION, UNPHYSICAL
from bem.methods.physical_bounds import most_tension, rigid_tension, within_bounds
from bem.methods.records import JUMP, RECORD, MarchResult, new_work
from bem.problem.indenter import tension_without_deformation

LAWS = [bem.LennardJones(), bem.Exponential(), bem.ConstantStress(), bem.ConstantStress(0.05), bem.ConstantStress(1.0)]


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_rigid_paraboloid_is_bradleys(law):
    assert rigid_tension(0.3, 2.0, law) == pytest.approx(2.0, rel=2e-3)
    assert most_tension(bem.Scene(0.3, adhesion=law)) == 2.0
    assert most_tension(bem.Scene(0.3, bem.StandardLinearSolid(0.01), law)) == pytest.approx(200.0)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0, 8.0])
def test_other_tips_bear_the_largest_gap(exponent):
    forces = [tension_without_deformation(0.3, exponent, gap) for gap in np.linspace(0.75, 1.25, 500)]
    assert rigid_tension(0.3, exponent, bem.LennardJones()) == pytest.approx(max(forces), rel=2e-3)


def test_no_adhesion_means_no_tension():
    assert most_tension(bem.Scene(0.3, adhesion=bem.HardContact())) == 0.0


@pytest.mark.parametrize(
    ("force", "energy", "outcome"),
    [
        ([0.0, 2.0, 1.0], -1.5, COMPLETED),
        ([0.0, np.nan, 1.0], -1.5, NOT_FINITE),
        ([0.0, 2.1, 1.0], -1.55, TOO_MUCH_TENSION),
        ([0.0, -20.0, 1.0], 9.5, UNPHYSICAL),
        ([0.0, 2.0, 1.0], -1.0, NOT_BALANCED),
    ],
)
def test_the_outcome_names_the_broken_bound(force, energy, outcome):
    records, steps = np.zeros(3, RECORD), np.array([2])
    records["indentation"], records["force"] = [0.0, 0.5, 1.0], force  # what goes in is minus the mean force
    result = MarchResult(records, np.empty(0, JUMP), new_work(), steps, np.array([0.0, energy + 0.25]), COMPLETED)
    assert within_bounds(result, bem.Scene(1.0), least_force=-10.0, target=4e-3).outcome == outcome


def test_broken_bound_is_computed_by_steps(monkeypatch):
    def doubled(*request):
        result = march_elastic(*request)
        result.records["force"] *= 2.0
        return result

    scene, march_elastic = bem.Scene(0.5), simulation.march_elastic
    protocol = bem.LoadingProtocol(peak_indentation=1.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
    by_branch = bem.simulate(scene, protocol)
    monkeypatch.setattr(simulation, "march_elastic", doubled)
    by_steps = bem.simulate(scene, protocol)
    assert (by_branch.stats.method, by_steps.stats.method) == ("elastic branch", "boundary elements")
    assert by_steps.pull_off_force == pytest.approx(by_branch.pull_off_force, rel=4e-3)
