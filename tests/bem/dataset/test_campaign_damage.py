"""Campaigns on full disks, with damaged or deleted parts, and beside other campaigns and files of the user."""

import errno
import os
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from bem.dataset.campaign import Campaign
from bem.dataset.executors import CampaignError
from bem.dataset.file import load_dataset
from bem.dataset.run import run_campaign
from tests.bem.dataset import helpers, stand_in
from tests.data_files import editing


def stop(now):
    if now:
        raise InterruptedError


def test_failed_trajectories_are_computed_again_when_asked(mending):
    out, mend = mending
    plan = Campaign(count=200, seed=1)
    deep = int(np.sum(plan.protocols["tabor"] > 3.0))

    def run(**options):
        return run_campaign(plan, out, solver=stand_in.fails_until_mended, **options)

    assert sum(run().failures.values()) == deep
    assert run().computed == 0
    again = run(retry_failed=True)
    assert (again.computed, sum(again.failures.values())) == (deep, deep)
    mend()
    with editing(out) as file:
        file.attrs["core_seconds"] = file.attrs["wall_seconds"] = 1e6
    before = load_dataset(out)

    with pytest.raises(InterruptedError):
        run(retry_failed=True, progress=lambda done, _: stop(done > 200 - deep))
    assert run().computed == 0  # and leaves what the retry saved
    # A target deleted while running is written all the same.
    found = run(retry_failed=True, progress=lambda *_: out.unlink(missing_ok=True))
    assert 0 < found.computed < deep
    assert (found.count, found.failures) == (200, Counter())
    after = load_dataset(out)
    np.testing.assert_array_equal(after.force[before.completed], before.force[before.completed])
    assert min(after.attributes[name] for name in ("core_seconds", "wall_seconds")) > 1e6  # all of its calls
    assert run(retry_failed=True).computed == 0
    assert sorted(path.name for path in out.parent.iterdir()) == ["data.h5", "mended"]


@pytest.mark.parametrize(("solver", "run"), [("solve", run_campaign), ("slow", helpers.run_here)])
def test_a_folder_deleted_while_running_ends_in_one_sentence(solver, run, undisturbed, plan, tmp_path):
    out = tmp_path / "there" / "data.h5"

    def delete(done, _):
        if done > 60:
            shutil.rmtree(out.parent)

    with pytest.raises(CampaignError, match=r"cannot write '.*'.*somebody removed what was saved") as found:
        run(plan, out, solver=getattr(stand_in, solver), progress=delete)
    assert "\n" not in str(found.value)
    assert list(tmp_path.iterdir()) == []
    if solver == "solve":
        assert run_campaign(plan, out, solver=stand_in.solve).computed == 120
        helpers.assert_same_numbers(out, undisturbed)


@pytest.mark.parametrize("limit", [10_000, 500_000])
def test_real_write_errors_end_in_one_sentence(limit, tmp_path):
    # The first part is larger than the first limit, all together than the second.
    before = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))"
    out = tmp_path / "data.h5"
    options = ("--count", 600, "--native", "--workers", 1)
    process = helpers.start_command("campaign", *options, "--out", out, solver="solve", before=before)
    _, errors = process.communicate(timeout=helpers.HANG)
    assert (process.returncode, errors.count("\n")) == (1, 1), errors
    assert "File too large" in errors
    assert "the same command continues" in errors
    assert not out.exists()
    assert bool(helpers.parts(out)) == (limit > 50_000)
    assert not list(tmp_path.rglob("*.writing"))


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("room", [4, None])
def test_a_full_disk_ends_in_one_sentence_and_loses_nothing(room, plan, undisturbed, tmp_path, monkeypatch):
    """After the description and three parts, in the middle of the fourth, or at the very end."""
    out, written, write = tmp_path / "data.h5", [], os.write

    def until_full(file, content):
        if len(written) == room:
            write(file, content[:100])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written.append(write(file, content))
        return written[-1]

    with monkeypatch.context() as full:
        full.setattr("os.write", until_full)
        full.setattr(
            Path, "replace", lambda *_: (_ for _ in ()).throw(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
        )
        with pytest.raises(CampaignError, match=r"No space left on device.*the same command continues"):
            run_campaign(plan, out, solver=stand_in.solve)
    assert len(helpers.parts(out)) == len(written) - 1
    assert list(tmp_path.iterdir()) == helpers.journals(out)
    if room is not None:  # what was cut short is not taken for damage, also once more was written after it
        kept = len(helpers.parts(out))
        with pytest.raises(InterruptedError):
            run_campaign(plan, out, solver=stand_in.solve, progress=lambda *_: stop(len(helpers.parts(out)) > kept))
    found = run_campaign(plan, out, solver=stand_in.solve)
    assert (found.computed > 0, found.damaged) == (room is not None, 0)
    helpers.assert_same_numbers(out, undisturbed)


@pytest.mark.usefixtures("in_this_process")
def test_a_damaged_description_is_told(plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    (path,) = helpers.begun(plan, out, monkeypatch)
    path.write_bytes(path.read_bytes().replace(b'"design"', b'"resign"', 1))
    with pytest.raises(ValueError, match=r"may be replaced with --replace: '.*parts' is damaged"):
        run_campaign(Campaign(count=7), out, solver=stand_in.solve)
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    helpers.assert_same_numbers(out, undisturbed)


def test_two_campaigns_on_one_file_exclude_each_other(plan, tmp_path):
    out = tmp_path / "data.h5"
    process = helpers.start_command("campaign", "--count", 4000, "--seed", 4, "--native", "--workers", 2, "--out", out)
    try:
        helpers.await_parts(out, process, 1)
        with pytest.raises(CampaignError, match="another campaign is writing"):
            run_campaign(Campaign(count=4000, seed=4, native=True), out, solver=stand_in.slow)
    finally:
        process.kill()
        process.communicate()
    with pytest.raises(ValueError, match=r"another one is under way.*: count 4000 there and 120 here"):
        run_campaign(plan, out, solver=stand_in.slow)


@pytest.mark.usefixtures("in_this_process")
def test_only_own_files_are_removed(plan, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    helpers.begun(plan, out, monkeypatch)
    mine = [tmp_path / name for name in ("data.h5.writing", "data.h5.mine.parts", f"data_h5.{'0' * 16}.parts")]
    for path in mine:
        path.write_text("mine", encoding="utf-8")
    (tmp_path / "data.h5.parts").mkdir()
    run_campaign(plan, out, solver=stand_in.solve, replace=True)
    assert {path.read_text(encoding="utf-8") for path in mine} == {"mine"}
    assert len(list(tmp_path.iterdir())) == 5


@pytest.mark.usefixtures("in_this_process")
def test_a_link_in_place_of_a_journal_is_refused(tmp_path, monkeypatch):
    (path,) = helpers.begun(Campaign(count=9), tmp_path / "data.h5", monkeypatch)
    path.unlink()
    path.symlink_to("nowhere")
    with pytest.raises(CampaignError, match=r"cannot write beside '.*data.h5' \(Too many levels of symbolic links\)"):
        run_campaign(Campaign(count=9), tmp_path / "data.h5", solver=stand_in.solve)


@pytest.mark.usefixtures("in_this_process")
def test_a_journal_that_outlives_its_file_is_removed(plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    helpers.begun(plan, out, monkeypatch)
    out.write_bytes(undisturbed.read_bytes())
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.usefixtures("in_this_process")
def test_another_campaigns_parts_stay_until_the_one_that_replaces_it_is_complete(tmp_path, monkeypatch):
    first, second = Campaign(count=40, seed=1), Campaign(count=40, seed=2)
    out = tmp_path / "data.h5"
    (theirs,) = helpers.begun(first, out, monkeypatch)
    (ours,) = {*helpers.begun(second, out, monkeypatch)} - {theirs}
    assert run_campaign(first, out, solver=stand_in.solve).computed == 0
    assert len(load_dataset(out)) == 40
    assert helpers.journals(out) == [ours]  # which may still continue
    helpers.begun(first, tmp_path / "other.h5", monkeypatch)[0].rename(theirs)
    assert run_campaign(second, out, solver=stand_in.solve, replace=True).computed == 0
    assert sorted(tmp_path.iterdir()) == [out]
