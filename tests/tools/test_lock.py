import importlib.util
import re
import shutil
import tomllib

import pytest

from tests.processes import ROOT

SPEC = importlib.util.spec_from_file_location("lock", ROOT / "tools" / "lock.py")
lock = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(lock)
TEXT = (ROOT / "requirements.lock").read_text(encoding="utf-8")


@pytest.fixture
def settings():
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_the_locks_match_and_what_is_installed_by_hand_is_not_in_them(settings):
    assert lock.main("check") == 0
    settings["project"]["optional-dependencies"]["peers"].append("no-such-package==1")
    assert lock.problems(settings, TEXT) == []


def test_the_small_lock_holds_the_same_versions_below_python_3_13(settings):
    small = (ROOT / "requirements-small.lock").read_text(encoding="utf-8")
    below, full = (
        set(re.findall(r"^([\w.-]+==\S+) (?!; python_full_version >= '3.13')", one, re.MULTILINE))
        for one in (small, TEXT)
    )
    assert below <= full
    assert "keras" not in small
    assert lock.problems(settings, small)[0].endswith("is not in the lock")
    assert lock.problems(settings, small.replace("xarray==", "other=="), ("tables",)) == ["xarray is not in the lock"]


def test_what_does_not_match_is_noticed(settings):
    assert lock.problems(settings, re.sub(r"^numpy==[^ ]+", "numpy==1.26.4", TEXT, flags=re.MULTILINE)) == [
        "numpy<3,>=2.0 is required, 1.26.4 is locked"
    ]
    assert lock.problems(settings, TEXT + "\nextra==1.0\n") == ["extra==1.0 has no hash"]
    assert lock.problems(settings, TEXT + "\n--index-url https://example.org\n") == ["the lock names a package index"]
    settings["project"]["dependencies"].append("no-such-package>=1")
    found = lock.problems(settings, TEXT)
    assert found[0].startswith("the dependencies in pyproject.toml changed")
    assert found[1] == "no-such-package is not in the lock"


def test_resolving_asks_uv_for_three_files_and_stamps_the_two_that_are_checked(tmp_path, monkeypatch):
    """A stand-in for uv, which notes what it is asked and leaves the files as they are."""
    for name in ("pyproject.toml", *lock.LOCKS):
        shutil.copy(ROOT / name, tmp_path)
    monkeypatch.setattr(lock, "ROOT", tmp_path)
    monkeypatch.setattr(lock.sys, "executable", str(tmp_path / "python"))
    with pytest.raises(FileNotFoundError, match=r"uv not found at .*; run `make setup` first"):
        lock.main("resolve")
    (tmp_path / "uv").touch()
    (tmp_path / "requirements.lock").write_text(TEXT.partition("\n")[2], encoding="utf-8")
    asked = {}

    def noted(words, **how):
        asked[words[words.index("--output-file") + 1]] = " ".join(map(str, words)), how["input"]

    monkeypatch.setattr(lock.subprocess, "run", noted)
    assert lock.main("resolve") == 0
    assert (tmp_path / "requirements.lock").read_text(encoding="utf-8") == TEXT
    assert list(asked) == ["requirements.lock", "requirements-small.lock", "requirements-newest.txt"]
    assert "--extra lab" in asked["requirements.lock"][0]
    assert asked["requirements-small.lock"][1].startswith("setuptools>=77\nnumpy>=2.1")
    constraints = (tmp_path / "results/versions.txt").read_text(encoding="utf-8").splitlines()
    assert len(constraints) == len(re.findall(r"^[a-z].*==", TEXT, re.MULTILINE))
    assert all('python_full_version < "3.13"' in line and not line.endswith("\\") for line in constraints)
