"""Compiled code is read only from where nobody else writes, and what is damaged is compiled again."""

import os
import stat
from pathlib import Path

import pytest
from numba import config

from bem._support import kernel_cache
from bem._support.jit import compilation, kernel
from tests.processes import ROOT, python


def increased(x):
    """A docstring, which `python -OO` leaves out."""
    return x + 1.5


@pytest.fixture
def files(tmp_path, monkeypatch):
    """The files that a compiled function leaves on disk, by path."""
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(config, "DISABLE_JIT", False)
    assert kernel(increased)(2.0) == 3.5
    return {path: path.read_bytes() for path in tmp_path.rglob("*.nb?")}


DAMAGE = {
    "empty": lambda _: b"",
    "cut": lambda code: code[: len(code) // 2],
    "longer": lambda code: code + b"\0",
    "a bit": lambda code: code[:-9] + bytes([code[-9] ^ 1]) + code[-8:],
    "zeros": lambda code: bytes(len(code)),
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_damaged_code_is_compiled_again(damage, files):
    for path, code in files.items():
        path.write_bytes(damage(code))
        assert kernel(increased)(2.0) == 3.5
        assert path.read_bytes() != damage(code)


def test_code_that_cannot_be_read_or_written(files):
    for path in files:
        path.unlink()
        path.mkdir()
        assert kernel(increased)(2.0) == 3.5


def test_each_signature_has_its_code(files):
    assert (kernel(increased)(2), kernel(increased)(2.0)) == (3.5, 3.5)
    now = {path: path.read_bytes() for path in next(iter(files)).parent.glob("*.nbc")}
    assert len(now) == 2
    assert files.items() <= now.items()


def test_optimised_python_uses_the_same_code(tmp_path):
    program = f"from {__name__} import increased, kernel; print(kernel(increased)(2.0))"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    kept = []
    for option in ("-B", "-O", "-OO"):
        run = python(option, "-c", program, env=environment, cwd=ROOT)
        assert run.stdout == "3.5\n", run.stderr
        kept.append({(path, path.stat().st_mtime_ns) for path in tmp_path.rglob("*.nb?")})
    assert kept[0]
    assert kept == 3 * kept[:1]


@pytest.fixture
def caches(tmp_path, monkeypatch):
    """A user's cache folder, not made yet, of one who may not write beside the package."""
    monkeypatch.setattr(os, "access", lambda *_: False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "caches"))
    return tmp_path / "caches"


directory = kernel_cache.cache_directory.__wrapped__


@pytest.mark.parametrize("mode", [None, 0o700, 0o755, 0o1777])
def test_the_folder_of_a_user_is_made(mode, caches, capsys):
    if mode is not None:
        caches.mkdir()
        caches.chmod(mode)
    folder = caches / "contact-trajectories"
    assert directory().startswith(f"{folder}/kernels-")
    assert [stat.S_IMODE(path.stat().st_mode) for path in (folder, *folder.iterdir())] == [0o700, 0o700]
    assert directory()
    assert capsys.readouterr().err == ""


def test_the_usual_folder_is_in_the_home(caches, monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert directory().startswith(f"{caches.parent}/home/.cache/contact-trajectories/kernels-")


@pytest.mark.parametrize("folder", ["", "contact-trajectories", "contact-trajectories/NAME"])
@pytest.mark.parametrize("mode", [0o777, 0o775, 0o1777])
def test_folders_of_many_writers_are_refused(folder, mode, caches, capsys):
    own = directory()
    path = caches / folder.replace("NAME", Path(own).name)
    path.chmod(mode)
    safe = mode == 0o1777 and not folder.endswith("NAME")  # nobody can replace what is in /tmp
    assert directory() == (own if safe else None)
    errors = capsys.readouterr().err
    assert errors.count("\n") == (not safe)
    assert safe or f"received {path} of user {os.geteuid()} with mode {mode:o}" in errors


def test_a_folder_of_another_user_is_refused(caches, monkeypatch, capsys):
    caches.mkdir()
    monkeypatch.setattr(os, "geteuid", lambda: 10**6)
    if caches.stat().st_uid == 0:
        os.chown(caches, 1, 1)
    assert directory() is None
    assert not list(caches.iterdir())
    assert "only you may write to the cache folder" in capsys.readouterr().err


def test_nothing_is_kept_in_unsafe_folders(caches, monkeypatch, tmp_path, capsys):
    caches.write_text("a file")
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setattr(config, "DISABLE_JIT", False)
    monkeypatch.setattr(kernel_cache, "cache_directory", directory)
    monkeypatch.setattr("bem._support.jit.cache_directory", directory)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert kernel(increased)(2.0) == 3.5
    with compilation(["a"], 0, 3.0):
        pass
    errors = capsys.readouterr().err.splitlines()
    assert "the solver is compiled at every start" in errors[0]
    assert "compiling the solver" in errors[-1]
    assert [path.name for path in tmp_path.iterdir()] == ["caches"]
