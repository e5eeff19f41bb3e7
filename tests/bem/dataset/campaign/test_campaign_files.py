import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

from bem.dataset.campaign.checkpoints import CampaignError
from bem.dataset.campaign.files import merge
from bem.dataset.campaign.plan import Campaign
from bem.dataset.campaign.run import run_campaign
from bem.dataset.file import load_dataset
from bem.dataset.opening import DamagedFileError
from bem.dataset.verification import verify
from surrogate.data.dataset import TrajectoryDataset
from tests.bem.dataset.campaign import stand_in
from tests.bem.dataset.campaign.helpers import altered, assert_same_numbers, put
from tests.data_files import editing


@pytest.mark.usefixtures("in_this_process")
def test_shards_merge_into_the_undisturbed_file(undisturbed, tmp_path):
    out = tmp_path / "data.h5"
    paths = []
    for number in (2, 3, 1):
        plan = Campaign(count=120, seed=4, native=True, shard=(number, 3))
        paths.append(run_campaign(plan, out, solver=stand_in.solve).path)
    assert paths[0].name == "data.shard-2-of-3.h5"
    assert len(load_dataset(paths[0])) == 40
    with pytest.raises(ValueError, match="without 40 of them, the first being trajectory 0"):
        merge(paths[:2], out)
    with pytest.raises(ValueError, match="must not overlap"):
        merge([*paths, paths[0]], out)
    assert not out.exists()
    assert merge(paths, out).count == 120
    assert_same_numbers(out, undisturbed)
    with pytest.raises(ValueError, match="must not overlap"):
        merge([paths[0], undisturbed], tmp_path / "other.h5")


@pytest.mark.usefixtures("in_this_process")
def test_shards_completed_later_are_merged_again(tmp_path, monkeypatch):
    out, mended = tmp_path / "data.h5", tmp_path / "mended"
    monkeypatch.setenv("STAND_IN_MARKER", str(mended))
    plans = [Campaign(count=200, seed=1, shard=(number, 2)) for number in (1, 2)]

    def run(plan, **options):
        return run_campaign(plan, out, solver=stand_in.fails_until_mended, workers=1, **options).path

    paths = [run(plan) for plan in plans]
    assert sum(merge(paths, out).failures.values()) > 0
    mended.touch()
    for plan in plans:
        run(plan, retry_failed=True)
    assert merge(paths, out).failures == Counter()


def drop(name):
    return lambda file: file.__delitem__(name)


def forget(name):
    return lambda file: file.attrs.__delitem__(name)


def set_attribute(name, value):
    return lambda file: file.attrs.__setitem__(name, value)


def replace(name, content):
    def change(file):
        del file[name]
        file[name] = content

    return change


def shape(name, rows):
    def change(file):
        content = file[name][...][rows]
        del file[name]
        file[name] = content

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (drop("scalars/steps"), "without /scalars/steps"),
        (drop("jumps/time"), "without /jumps/time"),
        (drop("protocols/tabor"), "without /protocols/tabor"),
        (drop("native/force"), "without /native/force"),
        (drop("fms"), "cannot be read"),
        (drop("reason"), "without /reason"),
        (shape("scalars/hysteresis", np.s_[:-1]), r"whose /scalars/hysteresis is float64 of shape \(119,\)"),
        (shape("fms/force", np.s_[:, :-1]), r"whose /fms/force is float32 of shape \(120, 119\)"),
        (shape("jumps/force_before", np.s_[1:]), "whose /jumps/force_before is"),
        (shape("native/offsets", np.s_[1:]), "whose /native/offsets is"),
        (shape("index", np.s_[::-1]), "whose /index does not increase"),
        (put("index", 3), "whose /index does not increase"),
        (put("status", 7), "whose /status is neither"),
        (put("jumps/trajectory", 4000), "whose /jumps/trajectory is not in the order"),
        (forget("campaign"), "without the attribute 'campaign'"),
        (forget("wall_seconds"), "without the attribute 'wall_seconds'"),
        (forget("host"), "without the attribute 'host'"),
        (set_attribute("campaign", "{"), "cannot be read"),
        (set_attribute("campaign", '{"count": 3}'), "lacks 'design'"),
        (set_attribute("campaign", "none"), "whose attribute 'campaign' is 'none'"),
        (set_attribute("wall_seconds", "long"), "whose attribute 'wall_seconds' is 'long'"),
        (set_attribute("accuracy", "draft"), "whose attribute 'accuracy' is 'draft', and 'standard' in 'campaign'"),
        (set_attribute("host", '{"a": "' + 10**4 * "x" + '"}'), "whose attribute 'host' is"),
        (set_attribute("campaign", 10**5 * "["), "cannot be read"),
        (put("protocols/tabor", -1.0), "whose /protocols/tabor is not above zero"),
        (put("protocols/dwell_time", -1.0), "whose /protocols/dwell_time is below zero"),
        (put("protocols/peak_indentation", np.nan), "whose /protocols/peak_indentation is not finite"),
        (put("fms/force", np.nan), "whose /fms/force is not finite in every completed trajectory"),
        (put("scalars/nodes", np.inf), "whose /scalars/nodes is not finite in every completed trajectory"),
        (put("jumps/time", np.nan), "whose /jumps/time is not finite"),
        (put("native/contact_radius", np.nan), "whose /native/contact_radius is not finite"),
        (replace("scalars/steps", np.zeros(120, dtype=complex)), "/scalars/steps holds neither numbers nor text"),
        (lambda file: file["fms"].attrs.__setitem__("counts", [50, 20, 49]), "whose measurement points are"),
        (lambda file: file["fms"].attrs.__delitem__("counts"), "cannot be read"),
    ],
)
def test_incomplete_files_are_refused_in_one_sentence(change, message, undisturbed, tmp_path):
    path = altered(undisturbed, tmp_path, change)
    expected = rf"expected a complete data set; received '.*altered.h5', .*{message}"
    with pytest.raises(DamagedFileError, match=expected) as found:
        load_dataset(path, native=True)
    assert "\n" not in str(found.value)
    assert len(str(found.value)) < 1000
    if "native" not in message:
        with pytest.raises(ValueError, match=expected):
            TrajectoryDataset.load(path)
    with pytest.raises(ValueError, match=expected):
        verify(path, solver=stand_in.solve)
    out = tmp_path / "merged.h5"
    with pytest.raises(ValueError, match=expected):
        merge([path], out)
    assert not out.exists()


def test_a_file_another_program_is_writing_is_not_called_damaged(undisturbed, tmp_path):
    path = tmp_path / "busy.h5"
    path.write_bytes(undisturbed.read_bytes())
    code = f"import h5py, sys; f = h5py.File({str(path)!r}, 'r+'); print('open', flush=True); sys.stdin.read()"
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "open\n"
        with pytest.raises(ValueError, match="which another program is writing"):
            load_dataset(path)
    finally:
        process.communicate()


def test_merging_keeps_where_the_shards_come_from(tmp_path):
    paths = []
    for number, host in ((1, "Linux x86_64, 4 cores of A"), (2, "Linux x86_64, 8 cores of B")):
        plan = Campaign(count=20, seed=4, shard=(number, 2))
        path = run_campaign(plan, tmp_path / "data.h5", solver=stand_in.solve, workers=2).path
        with editing(path) as file:
            file.attrs["host"] = host
        paths.append(path)
    shards = [load_dataset(path).attributes for path in paths]
    merge(paths, tmp_path / "data.h5", command="bem merge")
    found = load_dataset(tmp_path / "data.h5").attributes
    assert found["host"] == ["Linux x86_64, 4 cores of A", "Linux x86_64, 8 cores of B"]
    assert found["versions"] == shards[0]["versions"]
    assert (found["workers"], found["command"]) == (4, "bem merge")
    assert found["core_seconds"] == sum(shard["core_seconds"] for shard in shards)


def test_merging_into_a_folder_that_is_not_there_promises_nothing(undisturbed, tmp_path):
    with pytest.raises(CampaignError) as found:
        merge([undisturbed], tmp_path / "absent" / "data.h5")
    assert "No such file or directory" in str(found.value)
    assert "continues" not in str(found.value)
