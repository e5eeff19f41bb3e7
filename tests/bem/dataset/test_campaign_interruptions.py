"""Campaigns that a signal or a lost worker ends, and how the same command continues them."""

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
from bem.dataset.file import load_dataset
from bem.dataset.journal import MARK
from bem.dataset.run import run_campaign
from tests.bem.dataset import helpers, stand_in

WORDS = ("campaign", "--count", 120, "--seed", 4, "--native", "--workers", 2)


def test_kill_at_random_moments_loses_and_duplicates_nothing(plan, undisturbed_slow, tmp_path):
    out = tmp_path / "data.h5"
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


def test_control_c_reaches_the_workers_too_and_ends_all(undisturbed_slow, tmp_path):
    out = tmp_path / "data.h5"
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
