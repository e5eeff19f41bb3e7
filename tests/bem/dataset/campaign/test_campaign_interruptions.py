import errno
import json
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

from bem.dataset.campaign.checkpoints import CampaignError
from bem.dataset.campaign.plan import Campaign
from bem.dataset.campaign.run import run_campaign
from bem.dataset.file import load_dataset
from tests.bem.dataset.campaign import stand_in
from tests.bem.dataset.campaign.helpers import (
    HANG,
    Here,
    assert_same_numbers,
    await_parts,
    children,
    command,
    parts,
    run_here,
    start_campaign,
    start_command,
)


def test_kill_at_random_moments_loses_and_duplicates_nothing(plan, undisturbed_slow, tmp_path):
    out = tmp_path / "data.h5"
    chance = random.Random(0)
    kept = 0
    for _ in range(2):
        process = start_campaign(out)
        await_parts(out, process, len(parts(out)) + 1)
        time.sleep(chance.uniform(0.0, 0.2))
        workers = children(process.pid)
        assert len(workers) >= 2 or process.poll() is not None
        process.kill()
        process.wait()
        process.stderr.close()
        assert not out.exists() or len(load_dataset(out)) == 120
        assert len(parts(out)) >= kept
        kept = len(parts(out))
    summary = run_here(plan, out, solver=stand_in.slow)
    assert summary.computed < 120
    assert_same_numbers(out, undisturbed_slow)
    assert sorted(tmp_path.iterdir()) == [out]
    await_end(workers)


def await_end(processes):
    limit = time.monotonic() + HANG
    while alive := [process for process in processes if Path(f"/proc/{process}").exists()]:
        assert time.monotonic() < limit, alive
        time.sleep(0.1)


def interrupt(out, how, *options, at_least):
    """Start a campaign and end it by a signal once it has saved some parts."""
    process = start_command("campaign", *options, "--workers", 2, "--out", out)
    await_parts(out, process, at_least)
    before = len(parts(out))
    process.send_signal(how)
    _, errors = process.communicate(timeout=HANG)
    assert process.returncode == 130
    assert errors == "bem: interrupted; what was done is saved, and the same command continues\n"
    assert len(parts(out)) >= before
    assert not out.exists()


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    """A folder with a campaign of 120 trajectories of which some are done, terminated as by a batch system."""
    out = tmp_path_factory.mktemp("interrupted") / "data.h5"
    interrupt(out, signal.SIGTERM, "--count", 120, "--seed", 4, at_least=4)
    return out.parent


def test_a_terminated_campaign_saves_what_it_holds(interrupted):
    assert len(parts(interrupted / "data.h5")) >= 4


def test_an_interrupted_campaign_saves_what_it_holds(tmp_path):
    interrupt(tmp_path / "data.h5", signal.SIGINT, "--count", 3000, at_least=1)


def test_control_c_reaches_the_workers_too_and_ends_all(undisturbed_slow, tmp_path):
    out = tmp_path / "data.h5"
    words = ("campaign", "--count", 120, "--seed", 4, "--native", "--workers", 2, "--out", out)
    process = start_command(*words, start_new_session=True)
    await_parts(out, process, 2)
    workers = children(process.pid)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    printed, errors = process.communicate(timeout=HANG)
    assert (process.returncode, printed) == (130, "")
    assert errors == "bem: interrupted; what was done is saved, and the same command continues\n"
    assert len(workers) >= 2
    await_end(workers)
    kept = parts(out)
    assert len(kept) >= 2
    assert not out.exists()
    result = command(*words, solver=stand_in.slow)
    assert (result.exit_code, result.stderr) == (0, "")
    assert " 120 of them computed now" not in result.stdout
    assert_same_numbers(out, undisturbed_slow)
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
    kept = {path: path.read_bytes() for path in parts(out)}
    result = command("campaign", "--count", 120, "--seed", 4, "--out", out, *changed)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert message in result.stderr
    assert "may be replaced with --replace" in result.stderr
    assert {path: path.read_bytes() for path in parts(out)} == kept
    assert not out.exists()


@pytest.mark.parametrize(
    "options",
    [
        ("--workers", 1),
        *(
            pytest.param(words, marks=pytest.mark.slow)
            for words in (("--workers", 3), ("--retry-failed",), ("--replace",))
        ),
    ],
)
def test_options_that_change_no_number_continue_what_was_interrupted(options, interrupted, tmp_path):
    out = shutil.copytree(interrupted, tmp_path / "copy") / "data.h5"
    process = start_command("campaign", "--count", 120, "--seed", 4, "--out", out, *options)
    printed, errors = process.communicate(timeout=HANG)
    assert (process.returncode, errors) == (0, "")
    assert int(re.search(r"(\d+) of them computed now", printed)[1]) < 120
    assert list(out.parent.iterdir()) == [out]


@pytest.mark.usefixtures("in_this_process")
def test_damaged_parts_are_told_and_computed_again(interrupted, tmp_path):
    out = shutil.copytree(interrupted, tmp_path / "copy") / "data.h5"
    first, second, *_ = parts(out)
    first.write_bytes(first.read_bytes()[1:])
    second.write_bytes(b"")
    # Whole, but of another campaign: it has the name it had there.
    begun(Campaign(count=40, seed=1), tmp_path / "other.h5", pytest.MonkeyPatch())
    for path in parts(tmp_path / "other.h5")[:1]:
        (first.parent / path.name).write_bytes(path.read_bytes())
    result = command("campaign", "--count", 120, "--seed", 4, "--out", out, solver=stand_in.slow)
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.startswith("3 damaged parts of an earlier run were computed again\n")
    run_campaign(Campaign(count=120, seed=4), tmp_path / "calm.h5", solver=stand_in.slow)
    assert_same_numbers(out, tmp_path / "calm.h5")


@pytest.mark.usefixtures("in_this_process")
def test_a_target_deleted_while_running_is_written_all_the_same(tmp_path, monkeypatch):
    out, mended = tmp_path / "data.h5", tmp_path / "mended"
    monkeypatch.setenv("STAND_IN_MARKER", str(mended))
    plan = Campaign(count=200, seed=1)

    def run(**options):
        return run_campaign(plan, out, solver=stand_in.fails_until_mended, workers=1, **options)

    def delete(done, _):
        out.unlink(missing_ok=True)

    before = load_dataset(run().path)
    mended.touch()
    found = run(retry_failed=True, progress=delete)
    assert (found.count, found.failures) == (200, Counter())
    after = load_dataset(out)
    np.testing.assert_array_equal(after.force[before.completed], before.force[before.completed])
    assert sorted(tmp_path.iterdir()) == [out, mended]


@pytest.mark.parametrize(("solver", "run"), [("solve", run_campaign), ("slow", run_here)])
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
        assert_same_numbers(out, undisturbed)


@pytest.mark.parametrize("limit", [10_000, 150_000])
def test_real_write_errors_end_in_one_sentence(limit, tmp_path):
    # The least part is larger than the first limit, the file than the second.
    before = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))"
    out = tmp_path / "data.h5"
    options = ("--count", 600, "--native", "--workers", 1)
    process = start_command("campaign", *options, "--out", out, solver="solve", before=before)
    _, errors = process.communicate(timeout=HANG)
    assert (process.returncode, errors.count("\n")) == (1, 1), errors
    assert "File too large" in errors
    assert "the same command continues" in errors
    assert not out.exists()
    assert bool(parts(out)) == (limit > 50_000)
    assert not list(tmp_path.rglob("*.writing"))


def test_a_killed_worker_costs_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("STAND_IN_MARKER", str(tmp_path / "marker"))
    stand_in.restart_workers()
    plan = Campaign(count=60, seed=4)
    summary = run_campaign(plan, tmp_path / "data.h5", workers=2, solver=stand_in.kills_its_worker_once)
    assert (tmp_path / "marker").exists()
    assert (summary.count, summary.failures) == (60, Counter())
    run_here(plan, tmp_path / "calm.h5", solver=stand_in.slow)
    assert_same_numbers(tmp_path / "data.h5", tmp_path / "calm.h5")


@pytest.mark.slow
def test_a_trajectory_that_always_kills_its_worker_is_recorded(tmp_path):
    plan = Campaign(count=200, seed=4)
    deadly = (plan.protocols["tabor"] > 3.0) & (plan.protocols["peak_indentation"] > 90.0)
    assert 0 < deadly.sum() < 5
    run_campaign(plan, tmp_path / "data.h5", workers=2, solver=stand_in.kills_its_worker_always)
    dataset = load_dataset(tmp_path / "data.h5")
    np.testing.assert_array_equal(dataset.columns["status"], deadly)
    assert "worker process died every time" in dataset.columns["reason"][deadly][0]


@pytest.mark.usefixtures("in_this_process")
def test_a_full_disk_ends_in_one_sentence_and_loses_nothing(plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    settle, left = Path.replace, [4]  # campaign.json and three parts

    def until_full(temporary, path):
        if left[0] == 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        left[0] -= 1
        return settle(temporary, path)

    with monkeypatch.context() as full:
        full.setattr(Path, "replace", until_full)
        with pytest.raises(CampaignError, match=r"No space left on device.*the same command continues"):
            run_campaign(plan, out, solver=stand_in.solve)
    assert len(parts(out)) == 3
    assert not out.exists()
    summary = run_campaign(plan, out, solver=stand_in.solve)
    assert 0 < summary.computed < 120
    assert_same_numbers(out, undisturbed)


@pytest.mark.usefixtures("in_this_process")
def test_a_disk_full_at_the_very_end_keeps_the_parts(plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"

    settle = Path.replace

    def full(temporary, path):
        if path == out:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return settle(temporary, path)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", full)
        with pytest.raises(CampaignError, match="No space left on device"):
            run_campaign(plan, out, solver=stand_in.solve)
    assert not out.exists()
    assert not list(tmp_path.rglob("*.writing"))
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    assert_same_numbers(out, undisturbed)


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("harm", ["truncate", "flip", "empty"])
def test_a_damaged_part_is_computed_again(harm, plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    with monkeypatch.context() as patch:
        patch.setattr("bem.dataset.campaign.plan.write_dataset", lambda *_: (_ for _ in ()).throw(OSError("unplugged")))
        with pytest.raises(CampaignError, match="unplugged"):
            run_campaign(plan, out, solver=stand_in.solve)
    path = parts(out)[0]
    content = bytearray(path.read_bytes())
    with np.load(path) as file:
        size = len(file["index"])
    content[len(content) // 2] ^= 1
    path.write_bytes({"truncate": content[: len(content) // 2], "flip": content, "empty": b""}[harm])
    summary = run_campaign(plan, out, solver=stand_in.solve)
    assert (summary.damaged, summary.computed) == (1, size)
    assert_same_numbers(out, undisturbed)


def test_two_campaigns_on_one_file_exclude_each_other(plan, tmp_path):
    out = tmp_path / "data.h5"
    process = start_campaign(out, count=4000)
    try:
        await_parts(out, process, 1)
        with pytest.raises(CampaignError, match="another campaign is writing"):
            run_campaign(Campaign(count=4000, seed=4, native=True), out, solver=stand_in.slow)
    finally:
        process.kill()
        process.wait()
        process.stderr.close()
    with pytest.raises(ValueError, match=r"another one is under way.*: count 4000 there and 120 here"):
        run_campaign(plan, out, solver=stand_in.slow)


def begun(plan, out, monkeypatch, solver=stand_in.solve):
    """A campaign all of whose parts are there, but not the file."""
    with monkeypatch.context() as patch:
        patch.setattr("bem.dataset.campaign.plan.write_dataset", lambda *_: (_ for _ in ()).throw(OSError("unplugged")))
        with pytest.raises(CampaignError, match="unplugged"):
            run_campaign(plan, out, solver=solver, replace=True)
    assert not out.exists()
    return out.with_name(out.name + ".parts")


@pytest.mark.usefixtures("in_this_process")
def test_a_folder_of_the_user_is_left_alone(plan, tmp_path):
    out = tmp_path / "z.h5"
    folder = tmp_path / "z.h5.parts"
    folder.mkdir()
    (folder / "thesis.tex").write_text("x", encoding="utf-8")
    for replace in (False, True):
        with pytest.raises(ValueError, match=r"that folder holds 'thesis.tex', which no campaign wrote"):
            run_campaign(plan, out, solver=stand_in.solve, replace=replace)
    (folder / "thesis.tex").rename(folder / "lock")
    with pytest.raises(ValueError, match="which no campaign wrote"):
        run_campaign(plan, out, solver=stand_in.solve)
    assert (folder / "lock").read_text(encoding="utf-8") == "x"
    assert sorted(tmp_path.rglob("*")) == [folder, folder / "lock"]


@pytest.mark.usefixtures("in_this_process")
def test_only_own_files_are_removed(plan, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    (tmp_path / "data.h5.writing").write_text("mine", encoding="utf-8")
    place = begun(plan, out, monkeypatch)
    (own,) = place.glob("campaign-*")
    (own / "notes.txt").write_text("x", encoding="utf-8")
    (place / ".nfs0001").touch()  # as a file server does
    run_campaign(plan, out, solver=stand_in.solve)
    assert [path.name for path in own.iterdir()] == ["notes.txt"]
    assert (tmp_path / "data.h5.writing").read_text(encoding="utf-8") == "mine"


@pytest.mark.usefixtures("in_this_process")
def test_a_damaged_description_is_written_again(plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    (path,) = begun(plan, out, monkeypatch).glob("campaign-*/campaign.json")
    path.write_text('{"design": ', encoding="utf-8")
    with pytest.raises(ValueError, match=r"its description '.*campaign.json' is missing or damaged"):
        run_campaign(Campaign(count=7), out, solver=stand_in.solve)
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    assert_same_numbers(out, undisturbed)


@pytest.mark.usefixtures("in_this_process")
def test_a_part_that_outlives_its_file_is_removed(plan, undisturbed, tmp_path, monkeypatch):
    out = tmp_path / "data.h5"
    place = begun(plan, out, monkeypatch)
    out.write_bytes(undisturbed.read_bytes())
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    assert not place.exists()


@pytest.mark.usefixtures("in_this_process")
def test_another_campaigns_parts_stay_until_the_one_that_replaces_it_is_complete(tmp_path, monkeypatch):
    first, second = Campaign(count=40, seed=1), Campaign(count=40, seed=2)
    out = tmp_path / "data.h5"
    place = begun(first, out, monkeypatch)
    kept = parts(out)
    begun(second, out, monkeypatch)
    assert set(kept) < set(parts(out))
    assert {json.loads(path.read_text())["seed"] for path in place.glob("*/campaign.json")} == {1, 2}
    assert run_campaign(first, out, solver=stand_in.solve).computed == 0
    assert len(load_dataset(out)) == 40
    assert place.exists()  # of the second, which may still continue
    assert run_campaign(second, out, solver=stand_in.solve, replace=True).computed == 0
    assert sorted(tmp_path.iterdir()) == [out]


def test_what_arrived_before_the_scheduler_was_lost_is_kept(plan, undisturbed, tmp_path, monkeypatch):
    class Lossy(Here):
        def run(self, batches, task):
            yield from ((batch, task(batch)) for batch in batches[:20])
            raise CampaignError("lost the Dask scheduler")

    out = tmp_path / "data.h5"
    with monkeypatch.context() as patch:
        patch.setattr("bem.dataset.campaign.run.LocalExecutor", Lossy)
        with pytest.raises(CampaignError, match="lost the Dask scheduler"):
            run_campaign(plan, out, solver=stand_in.solve)
    assert run_campaign(plan, out, solver=stand_in.solve).computed <= 100
    assert_same_numbers(out, undisturbed)
