"""A compilation is announced until all kernels are in the cache; an interruption waits until a kernel has returned."""

import os
import signal
import subprocess
import sys
import time

import pytest
from numba import config

from bem._support.jit import announce_compilation, note_compilation, uninterrupted


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


# A program started in the background of a shell ignores Ctrl-C unless told otherwise.
SIMULATIONS = """
import signal
import bem
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = bem.Scene(3.0)
path = bem.LoadingProtocol(peak_indentation=20.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
bem.simulate(scene, path)
print("begun", flush=True)
while True:
    bem.simulate(scene, path)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_handled_once_the_function_has_returned(number):
    done = []

    def function(word):
        os.kill(os.getpid(), number)
        time.sleep(0.0)  # a raising handler would be called here
        done.append(word)

    before = signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            uninterrupted(function, "all")
        assert done == ["all"]
        assert signal.getsignal(number) is signal.default_int_handler
        assert uninterrupted(lambda word: word, "all") == "all"
    finally:
        signal.signal(number, before)


def test_simulations_in_a_row_are_interrupted_without_a_crash():
    for wait in (0.05, 0.1, 0.17):
        with subprocess.Popen(
            [sys.executable, "-c", SIMULATIONS], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        ) as run:
            assert run.stdout.readline() == b"begun\n"
            time.sleep(wait)
            run.send_signal(signal.SIGINT)
            try:
                said = run.communicate(timeout=60)[1]
            finally:
                run.kill()
        assert run.returncode == -signal.SIGINT
        assert b"KeyboardInterrupt" in said
