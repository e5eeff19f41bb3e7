"""Campaigns that a signal, a full disk or damage ends, and how the same command continues them."""

import os
import resource
import shutil
import signal
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from bem.dataset.campaign import Campaign
from bem.dataset.executors import CampaignError
from bem.dataset.file import load_dataset
from bem.dataset.journal import MARK, Journal
from bem.dataset.run import run_campaign
from tests.bem.dataset import helpers, stand_in
from tests.data_files import editing

WORDS = ("campaign", "--count", 120, "--seed", 4, "--native")
pytestmark = pytest.mark.usefixtures("in_this_process")
INTERRUPTED = "bem: interrupted; what was done is saved, and the same command continues\n"


@pytest.mark.parametrize(
    "number", [signal.SIGKILL, signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_signal_ends_all_and_loses_nothing(number, undisturbed, out):
    process = helpers.start_command(*WORDS, "--workers", 2, "--out", out, start_new_session=True)
    helpers.wait_for(lambda: len(helpers.parts(out)) >= 2 or process.poll() is not None)
    workers = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    before = len(helpers.parts(out))
    # A terminal sends Ctrl-C to all.
    (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
    printed, errors = process.communicate(timeout=helpers.HANG)
    killed = number == signal.SIGKILL
    assert (process.returncode, printed) == (-number if killed else 130, "")
    assert killed or errors == INTERRUPTED
    assert len(workers) >= 2
    helpers.wait_for(lambda: not any(Path(f"/proc/{process}").exists() for process in workers))
    assert len(helpers.parts(out)) >= before
    assert not out.exists()
    result = helpers.command(*WORDS, "--out", out, solver=stand_in.slow)
    assert (result.exit_code, result.stderr) == (0, "")
    assert " 120 of them computed now" not in result.stdout
    helpers.assert_same_numbers(out, undisturbed)
    assert list(out.parent.iterdir()) == [out]


def test_interrupted_needs_the_same_options(plan, undisturbed, out):
    helpers.interrupted(plan, out)
    kept = {path: path.read_bytes() for path in out.parent.iterdir()}
    changed = ("--count", 119, "--seed", 5, "--accuracy", "draft", "--modulus-ratio", 0.2, "--design", "sobol")
    result = helpers.command("campaign", *changed, "--out", out)
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    for difference in (
        *("design 'paper' there and 'sobol' here", "modulus_ratio 0.1 there and 0.2 here", "seed 4 there and 5 here"),
        *("count 120 there and 119 here", "accuracy 'standard' there and 'draft' here", "native True there and False"),
        "may be replaced with --replace",
    ):
        assert difference in result.stderr
    assert {path: path.read_bytes() for path in out.parent.iterdir()} == kept
    again = (*WORDS, "--workers", 3, "--retry-failed", "--replace", "--out", out)
    result = helpers.command(*again, solver=stand_in.solve)
    assert (result.exit_code, result.stderr) == (0, "")
    assert 0 < int(result.stdout.split(", ")[1].split()[0]) < 120
    helpers.assert_same_numbers(out, undisturbed)


def test_damaged_parts_are_computed_again(plan, undisturbed, out, tmp_path):
    path = helpers.interrupted(plan, out, 70)
    about, first, _, third, *later, _ = path.read_bytes().split(MARK)
    changed = bytearray(third)
    changed[len(changed) // 2] ^= 1
    # The last one is whole, but of another campaign.
    helpers.begun(Campaign(count=40, seed=1), tmp_path / "other.h5")
    foreign = helpers.parts(tmp_path / "other.h5")[0]
    cut = helpers.parts(tmp_path / "other.h5")[1][:1000]  # as if its process had been killed
    path.write_bytes(MARK.join([about, first[:-100], b"", bytes(changed), *later, foreign, cut]))
    result = helpers.command(*WORDS, "--out", out, solver=stand_in.solve)
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.startswith("4 damaged parts of an earlier run were computed again\n")
    helpers.assert_same_numbers(out, undisturbed)


def test_failed_ones_are_computed_on_request(mending):
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
        run(retry_failed=True, progress=helpers.stop_after(200 - deep))
    assert run().computed == 0  # and leaves what the retry saved
    # A target deleted while running is written all the same.
    summary = run(retry_failed=True, progress=lambda *_: out.unlink(missing_ok=True))
    assert 0 < summary.computed < deep
    assert (summary.count, summary.failures) == (200, Counter())
    after = load_dataset(out)
    np.testing.assert_array_equal(after.force[before.completed], before.force[before.completed])
    assert min(after.attributes[name] for name in ("core_seconds", "wall_seconds")) > 1e6  # all of its calls
    assert run(retry_failed=True).computed == 0
    assert sorted(path.name for path in out.parent.iterdir()) == ["data.h5", "mended"]


def test_deleted_folder_gives_one_sentence(plan, tmp_path):
    def delete(done, _):
        if done > 60:
            shutil.rmtree(tmp_path / "there")

    with pytest.raises(CampaignError, match=r"cannot write '.*'.*somebody removed what was saved") as error:
        run_campaign(plan, tmp_path / "there" / "data.h5", solver=stand_in.solve, progress=delete)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("entries", [0, 3])
def test_full_disk_loses_nothing(entries, plan, undisturbed, out):
    """In the middle of the first part or of the fourth one; what was cut short is not taken for damage."""
    journal = helpers.interrupted(plan, out, 100).read_bytes().split(MARK)
    helpers.journals(out)[0].unlink()
    former = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(MARK.join(journal[: entries + 1])) + 1000, former[1]))
    try:
        result = helpers.command(*WORDS, "--out", out, solver=stand_in.solve)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, former)
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
    assert "(File too large); what was saved before is kept, and the same command continues" in result.stderr
    assert len(helpers.parts(out)) == entries
    assert list(out.parent.iterdir()) == helpers.journals(out)
    helpers.interrupted(plan, out)  # also once more was written after it
    summary = run_campaign(plan, out, solver=stand_in.solve)
    assert (0 < summary.computed < 120, summary.damaged) == (True, 0)
    helpers.assert_same_numbers(out, undisturbed)


def test_damaged_description_and_old_journal(plan, undisturbed, out):
    (path,) = helpers.begun(plan, out)
    journal = path.read_bytes()
    path.write_bytes(journal.replace(b'"design"', b'"resign"', 1))
    with pytest.raises(ValueError, match=r"may be replaced with --replace: '.*parts' is damaged"):
        run_campaign(Campaign(count=7), out, solver=stand_in.solve)
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    helpers.assert_same_numbers(out, undisturbed)
    path.write_bytes(journal)  # as if the process had been killed before it removed this
    assert run_campaign(plan, out, solver=stand_in.solve).computed == 0
    assert list(out.parent.iterdir()) == [out]


def test_campaigns_exclude_each_other(plan, out):
    refused = pytest.raises(CampaignError, match="another campaign is writing")
    with Journal(out, plan.identity(stand_in.solve)), refused:
        run_campaign(plan, out, solver=stand_in.solve)


def test_only_own_files_are_removed(plan, out, tmp_path):
    helpers.begun(plan, out)
    mine = [tmp_path / name for name in ("data.h5.writing", "data.h5.mine.parts", f"data_h5.{'0' * 16}.parts")]
    for path in mine:
        path.write_text("mine", encoding="utf-8")
    (tmp_path / "data.h5.parts").mkdir()
    run_campaign(plan, out, solver=stand_in.solve, replace=True)
    assert {path.read_text(encoding="utf-8") for path in mine} == {"mine"}
    assert len(list(tmp_path.iterdir())) == 5


def test_link_as_journal_is_refused(out):
    (path,) = helpers.begun(Campaign(count=9), out)
    path.unlink()
    path.symlink_to("nowhere")
    with pytest.raises(CampaignError, match=r"cannot write beside '.*data.h5' \(Too many levels of symbolic links\)"):
        run_campaign(Campaign(count=9), out, solver=stand_in.solve)


def test_old_parts_stay_until_replaced(out, tmp_path):
    first, second = Campaign(count=40, seed=1), Campaign(count=40, seed=2)
    (theirs,) = helpers.begun(first, out)
    (ours,) = {*helpers.begun(second, out)} - {theirs}
    assert run_campaign(first, out, solver=stand_in.solve).computed == 0
    assert len(load_dataset(out)) == 40
    assert helpers.journals(out) == [ours]  # which may still continue
    helpers.begun(first, tmp_path / "other.h5")[0].rename(theirs)
    assert run_campaign(second, out, solver=stand_in.solve, replace=True).computed == 0
    assert sorted(tmp_path.iterdir()) == [out]
