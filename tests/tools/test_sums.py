import json
import subprocess
import sys

import h5py
import pytest

from tests.processes import ROOT
from tools import sums

PUBLISHED = ROOT / "published"


@pytest.fixture
def published(tmp_path):
    (tmp_path / "published/models/M1-concat").mkdir(parents=True)
    for name in ("dataset.h5", "models/M1-concat/run.json", "models/M1-concat/history.csv"):
        (tmp_path / "published" / name).write_text(name, encoding="utf-8")
    return tmp_path / "published"


def complaints(folder):
    command = ["sha256sum", "--check", "--quiet", sums.NAME]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return sorted(line.partition(":")[0] for line in done.stdout.splitlines())


def test_only_the_files_that_are_named_get_a_new_line(published):
    sums.add(published, [published])
    assert list(sums.read(published)) == ["dataset.h5", "models/M1-concat/history.csv", "models/M1-concat/run.json"]
    assert complaints(published) == []
    (published / "dataset.h5").write_text("damaged", encoding="utf-8")
    (published / "models/M1-concat/history.csv").write_text("new", encoding="utf-8")
    (published / "models/M1-concat/run.json").unlink()
    assert len(complaints(published)) == 3
    sums.add(published, [published / "models"])
    assert list(sums.read(published)) == ["dataset.h5", "models/M1-concat/history.csv"]
    assert complaints(published) == ["dataset.h5"]


def test_what_cannot_be_published_is_refused_in_one_sentence(published):
    (published / "linked").symlink_to(published / "dataset.h5")
    for path, words in (("absent", "not found"), ("linked", "no links"), ("..", "must lie in")):
        command = [sys.executable, ROOT / "tools/sums.py", published, published / path]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr.count("\n"), words in done.stderr) == (1, 1, True)
    assert not (published / sums.NAME).exists()


def tracked():
    words = ["git", "ls-files", "-z", "--", "."]
    listed = subprocess.run(words, cwd=PUBLISHED, capture_output=True, text=True, check=False).stdout.split("\0")
    return sorted({name for name in listed if name} - {sums.NAME})


def test_every_published_file_has_its_line():
    """`make verify` compares the sums; a file of one's own, which is not tracked, needs none."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a clone")
    assert sorted(sums.read(PUBLISHED)) == tracked()
    assert not [name for name in tracked() if (PUBLISHED / name).is_symlink()]


@pytest.mark.parametrize(
    "path",
    [*PUBLISHED.glob("*.json"), *PUBLISHED.glob("measurements/*.json"), *PUBLISHED.glob("*/**/run.json")],
    ids=lambda path: str(path.relative_to(PUBLISHED)),
)
def test_a_result_says_how_it_was_made(path):
    content = json.loads(path.read_text(encoding="utf-8"))
    assert path.name == "dataset.croissant.json" or {"command", "versions"} <= content.keys()


def test_the_data_set_says_how_it_was_made():
    with h5py.File(PUBLISHED / "dataset.h5") as file:
        assert {"command", "versions", "git_revision", "seed"} <= file.attrs.keys()
