"""Campaigns that a signal, a lost worker, a full disk or damage ends, and how the same command continues them."""

import errno
import os
import random
import re
import shutil
import signal
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from bem.dataset.campaign import Campaign
from bem.dataset.executors import CampaignError
from bem.dataset.file import load_dataset
from bem.dataset.journal import MARK
from bem.dataset.run import run_campaign
from tests.bem.dataset import helpers, stand_in
from tests.data_files import editing

WORDS = ("campaign", "--count", 120, "--seed", 4, "--native", "--workers", 2)


def test_kill_at_random_moments_loses_and_duplicates_nothing(plan, undisturbed_slow, out, tmp_path):
    chance = random.Random(0)
    kept = 0
    for _ in range(2):
        process = helpers.start_command(*WORDS, "--out", out)
        helpers.await_parts(out, process, len(helpers.parts(out)) + 1)
        time.sleep(chance.uniform(0.0, 0.2))
        workers = helpers.children(process.pid)
        assert len(workers) >= 2 or process.poll() is not None
        process.kill()
        process.communicate()
        assert not out.exists() or len(load_dataset(out)) == 120
        assert len(helpers.parts(out)) >= kept
        kept = len(helpers.parts(out))
    summary = helpers.run_here(plan, out, solver=stand_in.slow)
    assert summary.computed < 120
    helpers.assert_same_numbers(out, undisturbed_slow)
    assert sorted(tmp_path.iterdir()) == [out]
    await_end(workers)


def await_end(processes):
    helpers.wait_for(lambda: not any(Path(f"/proc/{process}").exists() for process in processes))


INTERRUPTED = "bem: interrupted; what was done is saved, and the same command continues\n"


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    """A folder with a campaign of 120 trajectories of which some are done, terminated as by a batch system."""
    out = tmp_path_factory.mktemp("interrupted") / "data.h5"
    process = helpers.start_command("campaign", "--count", 120, "--seed", 4, "--workers", 2, "--out", out)
    helpers.await_parts(out, process, 4)
    before = len(helpers.parts(out))
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate(timeout=helpers.HANG)
    assert (process.returncode, errors) == (130, INTERRUPTED)
    assert len(helpers.parts(out)) >= before
    assert not out.exists()
    return out.parent


def test_control_c_reaches_the_workers_too_and_ends_all(undisturbed_slow, out, tmp_path):
    process = helpers.start_command(*WORDS, "--out", out, start_new_session=True)
    helpers.await_parts(out, process, 2)
    workers = helpers.children(process.pid)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    printed, errors = process.communicate(timeout=helpers.HANG)
    assert (process.returncode, printed, errors) == (130, "", INTERRUPTED)
    assert len(workers) >= 2
    await_end(workers)
    kept = helpers.parts(out)
    assert len(kept) >= 2
    assert not out.exists()
    result = helpers.command(*WORDS, "--out", out, solver=stand_in.slow)
    assert (result.exit_code, result.stderr) == (0, "")
    assert " 120 of them computed now" not in result.stdout
    helpers.assert_same_numbers(out, undisturbed_slow)
    assert list(tmp_path.iterdir()) == [out]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (("--accuracy", "draft"), "accuracy 'standard' there and 'draft' here"),
        (("--seed", 5), "seed 4 there and 5 here"),
        (("--count", 119), "count 120 there and 119 here"),
        (("--modulus-ratio", 0.2), "modulus_ratio 0.1 there and 0.2 here"),
        (("--design", "sobol"), "design 'paper' there and 'sobol' here"),
        (("--native",), "native False there and True here"),
    ],
)
def test_changed_options_on_what_was_interrupted_are_refused(changed, message, interrupted, tmp_path):
    out = shutil.copytree(interrupted, tmp_path / "copy") / "data.h5"
    kept = {path: path.read_bytes() for path in out.parent.iterdir()}
    result = helpers.command("campaign", "--count", 120, "--seed", 4, "--out", out, *changed)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert message in result.stderr
    assert "may be replaced with --replace" in result.stderr
    assert {path: path.read_bytes() for path in out.parent.iterdir()} == kept


@pytest.mark.parametrize("options", [("--workers", 1), ("--workers", 3), ("--retry-failed",), ("--replace",)])
def test_options_that_change_no_number_continue_what_was_interrupted(options, interrupted, tmp_path):
    out = shutil.copytree(interrupted, tmp_path / "copy") / "data.h5"
    words = ("campaign", "--count", 120, "--seed", 4, "--out", out, *options)
    result = helpers.command(*words, solver=stand_in.slow)
    assert (result.exit_code, result.stderr) == (0, "")
    assert int(re.search(r"(\d+) of them computed now", result.stdout)[1]) < 120
    assert list(out.parent.iterdir()) == [out]


@pytest.mark.usefixtures("in_this_process")
def test_damaged_parts_are_told_and_computed_again(interrupted, tmp_path):
    out = shutil.copytree(interrupted, tmp_path / "copy") / "data.h5"
    (path,) = helpers.journals(out)
    about, first, _, third, *rest, _ = path.read_bytes().split(MARK)
    changed = bytearray(third)
    changed[len(changed) // 2] ^= 1
    # The last one is whole, but of another campaign.
    helpers.begun(Campaign(count=40, seed=1), tmp_path / "other.h5", pytest.MonkeyPatch())
    other = helpers.parts(tmp_path / "other.h5")[0]
    cut = helpers.parts(tmp_path / "other.h5")[1][:1000]  # as if its process had been killed
    path.write_bytes(MARK.join([about, first[:-100], b"", bytes(changed), *rest, other, cut]))
    result = helpers.command("campaign", "--count", 120, "--seed", 4, "--out", out, solver=stand_in.slow)
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.startswith("4 damaged parts of an earlier run were computed again\n")
    run_campaign(Campaign(count=120, seed=4), tmp_path / "calm.h5", solver=stand_in.slow)
    helpers.assert_same_numbers(out, tmp_path / "calm.h5")


def test_a_killed_worker_costs_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("STAND_IN_MARKER", str(tmp_path / "marker"))
    stand_in.restart_workers()
    plan = Campaign(count=60, seed=4)
    summary = run_campaign(plan, tmp_path / "data.h5", workers=2, solver=stand_in.kills_its_worker_once)
    assert (tmp_path / "marker").exists()
    assert (summary.count, summary.failures) == (60, Counter())
    helpers.run_here(plan, tmp_path / "calm.h5", solver=stand_in.slow)
    helpers.assert_same_numbers(tmp_path / "data.h5", tmp_path / "calm.h5")


@pytest.mark.slow
def test_a_trajectory_that_always_kills_its_worker_is_recorded(tmp_path):
    plan = Campaign(count=200, seed=4)
    deadly = (plan.protocols["tabor"] > 3.0) & (plan.protocols["peak_indentation"] > 90.0)
    assert 0 < deadly.sum() < 5
    run_campaign(plan, tmp_path / "data.h5", workers=2, solver=stand_in.kills_its_worker_always)
    dataset = load_dataset(tmp_path / "data.h5")
    np.testing.assert_array_equal(dataset.columns["status"], deadly)
    assert "worker process died every time" in dataset.columns["reason"][deadly][0]


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
def test_real_write_errors_end_in_one_sentence(limit, out, tmp_path):
    # The first part is larger than the first limit, all together than the second.
    before = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))"
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
def test_a_damaged_description_is_told_and_a_journal_that_outlives_its_file_removed(
    plan, undisturbed, out, monkeypatch
):
    (path,) = helpers.begun(plan, out, monkeypatch)
    journal = path.read_bytes()
    path.write_bytes(journal.replace(b'"design"', b'"resign"', 1))
    with pytest.raises(ValueError, match=r"may be replaced with --replace: '.*parts' is damaged"):
        run_campaign(Campaign(count=7), out, solver=stand_in.solve)
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    helpers.assert_same_numbers(out, undisturbed)
    path.write_bytes(journal)  # as if the process had been killed before it removed this
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    assert list(out.parent.iterdir()) == [out]


def test_two_campaigns_on_one_file_exclude_each_other(plan, out):
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
def test_only_own_files_are_removed(plan, out, tmp_path, monkeypatch):
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
def test_another_campaigns_parts_stay_until_the_one_that_replaces_it_is_complete(out, tmp_path, monkeypatch):
    first, second = Campaign(count=40, seed=1), Campaign(count=40, seed=2)
    (theirs,) = helpers.begun(first, out, monkeypatch)
    (ours,) = {*helpers.begun(second, out, monkeypatch)} - {theirs}
    assert run_campaign(first, out, solver=stand_in.solve).computed == 0
    assert len(load_dataset(out)) == 40
    assert helpers.journals(out) == [ours]  # which may still continue
    helpers.begun(first, tmp_path / "other.h5", monkeypatch)[0].rename(theirs)
    assert run_campaign(second, out, solver=stand_in.solve, replace=True).computed == 0
    assert sorted(tmp_path.iterdir()) == [out]
