"""No damaged or incomplete file is read as if it were whole, none leads the reader elsewhere, and shards merge."""

import fcntl
import hashlib
import random
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import h5py
import numpy as np
import pytest
from h5py._objects import phil

from bem.dataset.campaign import Campaign
from bem.dataset.executors import CampaignError
from bem.dataset.file import load_dataset
from bem.dataset.run import merge, run_campaign
from bem.dataset.sealed_file import BLOCK, SEALED, DamagedFileError, open_dataset, seal
from surrogate.data.dataset import TrajectoryDataset
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import altered, assert_same_numbers, put, replaced
from tests.data_files import damaged, editing


def computed(out, shards, solver=stand_in.solve, **plan):
    """The files of some shards of a campaign; what failed is computed again."""
    plans = [Campaign(**plan, shard=shard) for shard in shards]
    return [run_campaign(plan, out, solver=solver, retry_failed=True).path for plan in plans]


@pytest.mark.usefixtures("in_this_process")
def test_shards_merge_into_the_whole_file(undisturbed, out, tmp_path):
    paths = computed(out, [(2, 3), (3, 3), (1, 3)], count=120, seed=4, native=True)
    assert paths[0].name == "data.shard-2-of-3.h5"
    second = load_dataset(paths[0])
    assert second.columns["index"].tolist() == list(range(1, 120, 3))
    np.testing.assert_array_equal(second.protocols["tabor"], load_dataset(undisturbed).protocols["tabor"][1::3])
    with pytest.raises(ValueError, match="without 40 of them, the first being trajectory 0"):
        merge(paths[:2], out)
    with pytest.raises(ValueError, match="must not overlap"):
        merge([*paths, paths[0]], out)
    assert not out.exists()
    assert merge(paths, out).count == 120
    assert_same_numbers(out, undisturbed)
    with pytest.raises(ValueError, match="must not overlap"):
        merge([paths[0], undisturbed], tmp_path / "other.h5")


def test_later_shards_are_merged_again(mending):
    out, mend = mending
    for failed in (True, False):
        paths = computed(out, [(1, 2), (2, 2)], stand_in.fails_until_mended, count=200, seed=1)
        assert bool(merge(paths, out).failures) == failed
        mend()


def drop(name):
    return lambda file: file.__delitem__(name)


def attribute(name, *value):
    return lambda file: file.attrs.__setitem__(name, *value) if value else file.attrs.__delitem__(name)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (drop("scalars/steps"), "without /scalars/steps"),
        (drop("protocols/tabor"), "without /protocols/tabor"),
        (drop("native/force"), "without /native/force"),
        (drop("fms"), "cannot be read"),
        (replaced("scalars/hysteresis", lambda rows: rows[:-1]), r"/scalars/hysteresis is float64 of shape \(119,\)"),
        (replaced("fms/force", lambda rows: rows[:, :-1]), r"whose /fms/force is float32 of shape \(120, 119\)"),
        (replaced("jumps/force_before", lambda rows: rows[1:]), "whose /jumps/force_before is"),
        (replaced("native/offsets", lambda rows: rows[1:]), "whose /native/offsets is"),
        (replaced("index", lambda rows: rows[::-1]), "whose /index does not increase"),
        (put("index", [2, 1], [1, 2]), "whose /index does not increase from 0 to less than 120"),
        (put("jumps/trajectory", [2, 1], [1, 2]), "whose /jumps/trajectory is not in the order of /index"),
        (put("native/offsets", [2, 1], [1, 2]), "whose /native/offsets do not increase from 0"),
        (put("status", 7), "whose /status is neither"),
        (put("jumps/trajectory", 4000), "whose /jumps/trajectory is not in the order"),
        (attribute("campaign"), "without the attribute 'campaign'"),
        (attribute("campaign", "{"), "cannot be read"),
        (attribute("campaign", '{"count": 3}'), "lacks 'design'"),
        (attribute("campaign", "none"), "whose attribute 'campaign' is 'none'"),
        (attribute("accuracy", "draft"), "whose attribute 'accuracy' is 'draft', and 'standard' in 'campaign'"),
        (attribute("host", '{"a": "' + 10**4 * "x" + '"}'), "whose attribute 'host' is"),
        (attribute("campaign", 10**5 * "["), "cannot be read"),
        (put("protocols/tabor", 0.0, 3), "whose /protocols/tabor is not above zero"),
        (put("protocols/dwell_time", -1.0, 3), "whose /protocols/dwell_time is not zero or above"),
        (put("protocols/peak_indentation", np.nan, 3), "whose /protocols/peak_indentation is not finite"),
        (put("fms/force", np.nan, 3), "whose /fms/force is not finite in every completed trajectory"),
        (put("scalars/nodes", np.inf, 3), "whose /scalars/nodes is not finite in every completed trajectory"),
        (put("jumps/time", np.nan), "whose /jumps/time is not finite"),
        (put("native/contact_radius", np.nan), "whose /native/contact_radius is not finite"),
        (replaced("scalars/steps", lambda rows: rows.astype(complex)), "/scalars/steps holds neither numbers nor text"),
        (lambda file: file["fms"].attrs.__setitem__("counts", [50, 20, 49]), "whose measurement points are"),
        (lambda file: file["fms"].attrs.__delitem__("counts"), "cannot be read"),
    ],
)
def test_incomplete_files_are_refused(change, message, undisturbed, tmp_path):
    path = altered(undisturbed, tmp_path, change)
    expected = rf"expected a complete data set; received '.*altered.h5', .*{message}"
    with pytest.raises(DamagedFileError, match=expected) as error:
        load_dataset(path, native=True)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 1000
    with ThreadPoolExecutor(1) as thread:
        assert thread.submit(phil.acquire, False).result()  # else a thread that frees an HDF5 object waits for ever
        thread.submit(phil.release).result()


def test_file_being_written_is_not_damaged(undisturbed, tmp_path):
    path = shutil.copy(undisturbed, tmp_path / "busy.h5")
    code = f"import h5py, sys; f = h5py.File({str(path)!r}, 'r+'); print('open', flush=True); sys.stdin.read()"
    process = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout.readline() == "open\n"
        with pytest.raises(ValueError, match="which another program is writing"):
            load_dataset(path)
    finally:
        process.communicate()


def test_a_data_set_is_read_without_a_lock(undisturbed):
    """As on a disk of the network without locks, where the library's own lock fails too."""
    with undisturbed.open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert len(load_dataset(undisturbed).columns["index"]) == 120


@pytest.mark.usefixtures("in_this_process")
def test_merge_keeps_sources_of_shards(tmp_path):
    hosts = ["Linux x86_64, 4 cores of A", "Linux x86_64, 8 cores of B"]
    paths = computed(tmp_path / "data.h5", [(1, 2), (2, 2)], count=20, seed=4)
    for path, host in zip(paths, hosts, strict=True):
        with editing(path) as file:
            file.attrs["host"] = host
    shards = [load_dataset(path).attributes for path in paths]
    merge(paths, tmp_path / "data.h5", command="bem merge")
    attributes = load_dataset(tmp_path / "data.h5").attributes
    assert (attributes["host"], attributes["versions"]) == (hosts, shards[0]["versions"])
    assert (attributes["workers"], attributes["command"]) == (2, "bem merge")
    assert attributes["core_seconds"] == sum(shard["core_seconds"] for shard in shards)
    assert attributes["wall_seconds"] == max(shard["wall_seconds"] for shard in shards)  # they ran side by side


def test_merge_into_absent_folder_is_refused(undisturbed, tmp_path):
    with pytest.raises(CampaignError) as error:
        merge([undisturbed], tmp_path / "absent" / "data.h5")
    assert "No such file or directory" in str(error.value)
    assert "continues" not in str(error.value)


@pytest.mark.parametrize("count", [100, pytest.param(2500, marks=pytest.mark.slow)])
def test_random_damage_is_refused(count, undisturbed, tmp_path):
    path, data, rng = tmp_path / "damaged.h5", undisturbed.read_bytes(), random.Random(count)
    for _ in range(count):
        path.write_bytes(damaged(data, rng))
        if path.read_bytes() == data:
            continue
        with pytest.raises(ValueError, match="expected a data set") as error:
            load_dataset(path)
        assert "\n" not in str(error.value)
        assert len(str(error.value)) < 1000


def test_right_sum_of_other_bytes_is_no_hdf5(undisturbed, tmp_path):
    data = bytearray(undisturbed.read_bytes())
    data[BLOCK + 8 : BLOCK + 64] = bytes(56)
    (tmp_path / "forged.h5").write_bytes(data)
    with (tmp_path / "forged.h5").open("r+b") as file:
        seal(file)
    with pytest.raises(DamagedFileError, match="truncated or damaged"):
        load_dataset(tmp_path / "forged.h5")


def test_sum_in_the_first_block_is_needed(undisturbed, tmp_path):
    data = undisturbed.read_bytes()
    title, digest, remaining = data[:BLOCK].split(b"\n", 2)
    assert title == b"viscoelastic-contact-dataset: SHA-256 sum of all bytes after the first 512"
    assert digest.decode() == hashlib.sha256(data[BLOCK:]).hexdigest()
    assert not remaining.strip(b"\0")
    with h5py.File(undisturbed) as file:
        assert (file.userblock_size, file.attrs[SEALED]) == (BLOCK, 1)
    path = tmp_path / "data.h5"
    path.write_bytes(data[BLOCK:])
    with h5py.File(path) as file:
        assert len(file["index"]) == 120
    for read in (load_dataset, TrajectoryDataset.load):
        with pytest.raises(ValueError, match="of another kind, or without the checksum of a data set"):
            read(path)


NAME = "scalars/end_force"
KEPT, LINK = "is kept in other files", "is a link to another place"


def virtual(file, folder):
    layout = h5py.VirtualLayout((120,), dtype="f8")
    layout[:] = h5py.VirtualSource(f"{folder}/other.h5", "end_force", (120,))
    file.create_virtual_dataset(NAME, layout)


@pytest.mark.parametrize(
    ("harm", "reason"),
    [
        (lambda file, at: file.create_dataset(NAME, (120,), "f8", external=[(f"{at}/secret.txt", 0, 960)]), KEPT),
        (virtual, KEPT),
        (lambda file, at: file.__setitem__(NAME, h5py.ExternalLink(f"{at}/other.h5", "end_force")), LINK),
        (lambda file, _: file.__setitem__(NAME, h5py.SoftLink("/scalars/hysteresis")), LINK),
    ],
)
def test_file_with_outside_links_is_refused(harm, reason, undisturbed, tmp_path):
    (tmp_path / "secret.txt").write_bytes(bytes(range(256)) * 4)
    with h5py.File(tmp_path / "other.h5", "w") as foreign:
        foreign["end_force"] = np.zeros(120)
    path = shutil.copy(undisturbed, tmp_path / "altered.h5")
    with editing(path) as file:
        del file[NAME]
        harm(file, tmp_path)
    with pytest.raises(DamagedFileError, match=rf"received '.*altered\.h5', which cannot be read \(/{NAME} {reason}\)"):
        load_dataset(path)
    with open_dataset(path):
        pass
