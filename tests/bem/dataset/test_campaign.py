import numpy as np
import pytest

from bem.dataset.campaign import Campaign
from bem.dataset.designs import Design
from bem.dataset.file import load_dataset, open_dataset
from bem.dataset.measurement_steps import measurement_grid
from bem.dataset.records import NATIVE_QUANTITIES
from bem.dataset.run import run_campaign
from surrogate.data.dataset import TrajectoryDataset
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import assert_same_numbers


def test_file_holds_what_its_documentation_says(plan, undisturbed):
    dataset = load_dataset(undisturbed)
    learned = TrajectoryDataset.load(undisturbed)
    assert len(dataset) == len(learned.completed) == 120
    assert dataset.counts == learned.points_per_phase == (50, 20, 50)
    for name, values in plan.protocols.items():
        np.testing.assert_array_equal(dataset.protocols[name], values)
    attributes = dataset.attributes
    assert (attributes["design"], attributes["seed"], attributes["accuracy"]) == ("paper", 4, "standard")
    assert attributes["ranges"]["tabor"] == [0.2, 3.2]
    assert attributes["command"] == "bem campaign --count 120"
    assert {"python", "numpy", "scipy", "numba"} <= attributes["versions"].keys()
    assert attributes["host"]
    assert attributes["git_revision"]
    assert attributes["core_seconds"] > 0.0
    assert 5e7 < attributes["peak_memory"] < 1e11
    jumps = dataset.columns["jumps/trajectory"]
    np.testing.assert_array_equal(np.unique(jumps), np.flatnonzero(plan.protocols["tabor"] > 1.0))
    np.testing.assert_array_equal(dataset.scalars["jump_count"], np.bincount(jumps, minlength=120))


def test_histories_are_the_solvers_own(plan, undisturbed):
    times, rows = measurement_grid(**plan.protocols)[0], np.array([0, 57, 119])
    with open_dataset(undisturbed) as file:
        for row, case in zip(rows, plan.cases_of(rows), strict=True):
            piece, found = slice(*file["native/offsets"][row : row + 2]), stand_in.solve(*case)
            for name in NATIVE_QUANTITIES:
                np.testing.assert_array_equal(file[f"native/{name}"][piece], getattr(found, name))
            np.testing.assert_array_equal(file["fms/force"][row], found.at(times[row]).astype(np.float32))
            assert file["scalars/pull_off_force"][row] == found.pull_off_force


@pytest.mark.usefixtures("in_this_process")
def test_failures_are_recorded_with_their_reason(tmp_path):
    plan = Campaign(count=200, seed=1)
    summary = run_campaign(plan, tmp_path / "data.h5", solver=stand_in.sometimes_fails)
    tabor = plan.protocols["tabor"]
    assert summary.failures == {
        "ArithmeticError: tabor is too large for me": np.sum(tabor > 3.0),
        "no stable equilibrium found": np.sum(tabor < 0.25),
    }
    dataset = load_dataset(tmp_path / "data.h5")
    np.testing.assert_array_equal(dataset.completed, np.flatnonzero((tabor <= 3.0) & (tabor >= 0.25)))
    lost = dataset.columns["status"] == 1
    assert np.isnan(dataset.force[lost]).all()
    assert np.isnan(dataset.scalars["pull_off_force"][lost]).all()


def test_the_same_command_again_only_reads(plan, undisturbed, monkeypatch):
    def refused(*_):
        raise ValueError("Expected an output file that can be written")

    content, seen = undisturbed.read_bytes(), []
    monkeypatch.setattr("bem.dataset.run.require_output", refused)
    assert run_campaign(plan, undisturbed, solver=stand_in.solve, progress=lambda *of: seen.append(of)).computed == 0
    assert undisturbed.read_bytes() == content
    assert seen == [(120, 0)]
    with pytest.raises(ValueError, match="can be written"):
        run_campaign(plan, undisturbed.with_name("other.h5"), solver=stand_in.solve)


@pytest.mark.usefixtures("in_this_process")
def test_another_campaign_does_not_overwrite_unless_asked(undisturbed, tmp_path):
    plan = Campaign(count=120, seed=5, design=Design("sobol"))
    content = undisturbed.read_bytes()
    copy = tmp_path / "data.h5"
    copy.write_bytes(content)
    with pytest.raises(ValueError, match="design 'paper' there and 'sobol' here, seed 4 there and 5 here, native True"):
        run_campaign(plan, copy, solver=stand_in.solve)
    with pytest.raises(ValueError, match="made by another version of the solver"):
        run_campaign(Campaign(count=120, seed=4, native=True), copy, solver=stand_in.slow)
    assert copy.read_bytes() == content
    assert run_campaign(plan, copy, solver=stand_in.solve, replace=True).computed == 120
    run_campaign(plan, tmp_path / "fresh.h5", solver=stand_in.solve)
    assert_same_numbers(copy, tmp_path / "fresh.h5")


@pytest.mark.usefixtures("in_this_process")
def test_a_link_stays_one_and_what_it_leads_to_is_written(tmp_path):
    (tmp_path / "there").mkdir()
    link = tmp_path / "data.h5"
    link.symlink_to(tmp_path / "there" / "real.h5")
    run_campaign(Campaign(count=10), link, solver=stand_in.solve, workers=1)
    assert link.is_symlink()
    assert len(load_dataset(tmp_path / "there" / "real.h5")) == 10
    link.unlink()
    link.symlink_to(link)
    with pytest.raises(ValueError, match="Expected an output file that can be written"):
        run_campaign(Campaign(count=10), link, solver=stand_in.solve, workers=1)
