import json
import subprocess

import h5py
import pytest

from tests.processes import ROOT
from tests.test_makefile import make

PUBLISHED = ROOT / "published"
NAME = "SHA256SUMS"


@pytest.fixture
def published(tmp_path):
    (tmp_path / "published/models/M1-concat").mkdir(parents=True)
    for name in ("dataset.h5", "models/M1-concat/run.json", "models/M1-concat/history.csv"):
        (tmp_path / "published" / name).write_text(name, encoding="utf-8")
    return tmp_path / "published"


def renew(folder, *paths):
    files = " ".join(str(path) for path in paths)
    make("-s", "sums", f"PUBLISHED={folder}", f"FILES={files}")


def read(folder):
    return [line.partition("  ")[2] for line in (folder / NAME).read_text(encoding="utf-8").splitlines()]


def complaints(folder):
    command = ["sha256sum", "--check", "--quiet", NAME]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    return sorted(line.partition(":")[0] for line in done.stdout.splitlines())


def test_only_named_files_get_a_new_line(published):
    (published / "models/M1-concat-large").write_text("of another name", encoding="utf-8")
    renew(published, published / "dataset.h5", published / "models")
    names = ["dataset.h5", "models/M1-concat-large", "models/M1-concat/history.csv", "models/M1-concat/run.json"]
    assert (read(published), complaints(published)) == (names, [])
    (published / "dataset.h5").write_text("damaged", encoding="utf-8")
    (published / "models/M1-concat/history.csv").write_text("new", encoding="utf-8")
    (published / "models/M1-concat/run.json").unlink()
    assert len(complaints(published)) == 3
    renew(published, published / "models/M1-concat")
    assert (read(published), complaints(published)) == (names[:-1], ["dataset.h5"])


def tracked():
    command = ["git", "ls-files", "-z", "--", "."]
    listed = subprocess.run(command, cwd=PUBLISHED, capture_output=True, text=True, check=False).stdout.split("\0")
    return sorted({name for name in listed if name} - {NAME})


def test_every_published_file_has_its_line():
    """`make verify` compares the sums; a file of one's own, which is not tracked, needs none."""
    if not (ROOT / ".git").exists():
        pytest.skip("not a clone")
    assert read(PUBLISHED) == tracked()
    assert not [name for name in tracked() if (PUBLISHED / name).is_symlink()]


@pytest.mark.parametrize(
    "path",
    [*PUBLISHED.glob("*.json"), *PUBLISHED.glob("measurements/*.json"), *PUBLISHED.glob("*/**/run.json")],
    ids=lambda path: str(path.relative_to(PUBLISHED)),
)
def test_a_result_says_how_it_was_made(path):
    result = json.loads(path.read_text(encoding="utf-8"))
    assert path.name == "dataset.croissant.json" or {"command", "versions"} <= result.keys()


def test_the_data_set_says_how_it_was_made():
    with h5py.File(PUBLISHED / "dataset.h5") as file:
        assert {"command", "versions", "git_revision", "seed"} <= file.attrs.keys()
