"""No damaged data set file is read as if it were whole, and none leads the reader elsewhere."""

import hashlib
import random
import subprocess
import sys

import h5py
import numpy as np
import pytest

from bem.dataset.file import load_dataset
from bem.dataset.sealed_file import BLOCK, SEALED, DamagedFileError, open_dataset
from surrogate.data.dataset import TrajectoryDataset
from tests.data_files import damaged, editing, unsealed
from tests.processes import ROOT

PUBLISHED = ROOT / "published" / "dataset.h5"


def assert_damages_are_refused(source, path, count):
    content, rng = source.read_bytes(), random.Random(count)
    tried = 0
    while tried < count:
        path.write_bytes(damaged(content, rng))
        if path.read_bytes() == content:
            continue
        tried += 1
        for read in (load_dataset, TrajectoryDataset.load):
            with pytest.raises(ValueError, match="expected a data set") as found:
                read(path)
            assert "\n" not in str(found.value)
            assert len(str(found.value)) < 1000


@pytest.mark.parametrize("count", [100, pytest.param(2500, marks=pytest.mark.slow)])
def test_random_damage_is_refused_in_one_sentence(count, undisturbed, tmp_path):
    # In a process of its own, so that one that hangs or crashes fails the test alone.
    check = "from tests.bem.dataset.test_damaged_files import assert_damages_are_refused as check"
    paths = ", ".join(f"Path({str(path)!r})" for path in (undisturbed, tmp_path / "damaged.h5"))
    code = f"from pathlib import Path\n{check}\ncheck({paths}, {count})"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=300, cwd=ROOT)


def test_the_sum_in_the_first_block_is_that_of_the_rest(undisturbed):
    content = undisturbed.read_bytes()
    title, digest, rest = content[:BLOCK].split(b"\n", 2)
    assert title == b"viscoelastic-contact-dataset: SHA-256 sum of all bytes after the first 512"
    assert digest.decode() == hashlib.sha256(content[BLOCK:]).hexdigest()
    assert not rest.strip(b"\0")
    with h5py.File(undisturbed) as file:
        assert (file.userblock_size, file.attrs[SEALED]) == (BLOCK, 1)


def test_a_file_without_its_first_block_is_not_taken_for_an_old_one(undisturbed, tmp_path):
    path = tmp_path / "data.h5"
    path.write_bytes(undisturbed.read_bytes()[BLOCK:])
    with h5py.File(path) as file:
        assert len(file["index"]) == 120
    with pytest.raises(DamagedFileError, match="truncated or damaged"):
        load_dataset(path)


def test_files_of_the_first_writers_are_read(undisturbed, tmp_path):
    path = unsealed(undisturbed, tmp_path / "old.h5")
    found, expected = load_dataset(path, native=True), load_dataset(undisturbed, native=True)
    np.testing.assert_equal(found.columns, expected.columns)
    assert TrajectoryDataset.load(path).sha256 == TrajectoryDataset.load(undisturbed).sha256


def test_the_published_file_is_the_one_models_were_trained_on():
    found = TrajectoryDataset.load(PUBLISHED)
    assert found.sha256 == "a8108732dbfcd7ea64fe9a88fbd16d06bb0ff632fdfa3f3fb03347a9501e7586"


def test_an_old_file_beside_its_sum_is_the_one_that_was_published(undisturbed, tmp_path):
    path = unsealed(undisturbed, tmp_path / "dataset.h5")
    line = f"{hashlib.sha256(path.read_bytes()).hexdigest()}  dataset.h5"
    (tmp_path / "SHA256SUMS").write_text(f"{'0' * 64}  other\n{line}\n", encoding="utf-8")
    assert len(load_dataset(path)) == 120
    with h5py.File(path, "r+") as file:
        file["scalars/steps"][3] += 1
    with pytest.raises(DamagedFileError, match="truncated or damaged"):
        load_dataset(path)
    (tmp_path / "SHA256SUMS").write_bytes(b"\n\xff")
    assert len(load_dataset(path)) == 120


def test_a_heap_at_which_the_library_hangs_is_refused(undisturbed, tmp_path):
    content = bytearray(unsealed(undisturbed, tmp_path / "old.h5").read_bytes())
    heap = content.index(b"GCOL\x01\0\0\0")
    content[heap + 16 : heap + 600] = bytes(584)
    path = tmp_path / "damaged.h5"
    path.write_bytes(content)
    code = f"from bem.dataset.file import load_dataset\nload_dataset({str(path)!r})"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert "DamagedFileError: expected a data set" in result.stderr


NAME = "scalars/end_force"
KEPT, LINK = "is kept in other files", "is a link to another place"
CLAIMS = "claims 8796093022208 bytes, more than the file can hold"


def virtual(file, folder):
    layout = h5py.VirtualLayout((120,), dtype="f8")
    layout[:] = h5py.VirtualSource(f"{folder}/other.h5", "end_force", (120,))
    file.create_virtual_dataset(NAME, layout)


@pytest.mark.parametrize("sealed", [True, False])
@pytest.mark.parametrize(
    ("harm", "words"),
    [
        (lambda file, at: file.create_dataset(NAME, (120,), "f8", external=[(f"{at}/secret.txt", 0, 960)]), KEPT),
        (virtual, KEPT),
        (lambda file, at: file.__setitem__(NAME, h5py.ExternalLink(f"{at}/other.h5", "end_force")), LINK),
        (lambda file, _: file.__setitem__(NAME, h5py.SoftLink("/scalars/hysteresis")), LINK),
        (lambda file, _: file.create_dataset(NAME, (2**40,), "f8", chunks=(1024,)), CLAIMS),
    ],
)
def test_a_file_that_leads_elsewhere_is_refused(harm, words, sealed, undisturbed, tmp_path):
    (tmp_path / "secret.txt").write_bytes(bytes(range(256)) * 4)
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["end_force"] = np.zeros(120)
    path = unsealed(undisturbed, tmp_path / "altered.h5")
    if sealed:
        path.write_bytes(undisturbed.read_bytes())
    with editing(path) if sealed else h5py.File(path, "r+") as file:
        del file[NAME]
        harm(file, tmp_path)
    for read in (load_dataset, TrajectoryDataset.load):
        with pytest.raises(
            DamagedFileError, match=rf"received '.*altered\.h5', which cannot be read \(/{NAME} {words}\)"
        ):
            read(path)
    with open_dataset(path):
        pass
