"""A compilation is announced until all kernels are in the cache."""

import pytest
from numba import config

from bem._support.jit import announce_compilation, note_compilation


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(config, "DISABLE_JIT", False)
    return tmp_path


def test_a_cache_with_some_kernels_is_announced_and_a_complete_one_is_not(cache, capsys):
    (cache / "some.kernel.nbc").touch()
    announce_compilation()
    assert "compiling the solver" in capsys.readouterr().err
    note_compilation()
    announce_compilation()
    assert capsys.readouterr().err == ""


def test_a_cache_that_cannot_be_written_does_not_stop_a_simulation(cache, monkeypatch, capsys):
    monkeypatch.setattr(config, "CACHE_DIR", str(cache / "none"))
    note_compilation()
    announce_compilation()
    assert "compiling the solver" in capsys.readouterr().err
