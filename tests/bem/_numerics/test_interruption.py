"""A kernel stops when Ctrl-C is pressed, and the signal is handled once the kernel has returned."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import bem
from bem._numerics import interruption
from bem._numerics.interruption import asked_to_stop, interruptible
from bem.solver import simulation
from bem.solver.stepping.time_stepping import INTERRUPTED, march

HANG = 600.0  # seconds after which a program that should end is taken to hang


@pytest.fixture
def handler():
    """Set the handler of a signal for the length of a test."""
    former = {}

    def install(number, handle):
        former.setdefault(number, signal.signal(number, handle))

    yield install
    for number, handle in former.items():
        signal.signal(number, handle)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_handled_once_the_function_has_returned(number, handler):
    handler(number, signal.default_int_handler)
    done = []

    def function(word, signals):
        assert not asked_to_stop(signals)
        signal.raise_signal(number)
        time.sleep(0.0)  # a raising handler would be called here
        done.append((word, asked_to_stop(signals)))

    with pytest.raises(KeyboardInterrupt):
        interruptible(function, "all")
    assert done == [("all", True)]
    assert signal.getsignal(number) is signal.default_int_handler
    assert signal.set_wakeup_fd(-1) == -1
    # What arrived is not held against the next one.
    assert interruptible(lambda word, signals: (word, asked_to_stop(signals)), "all") == ("all", False)


def test_a_handler_that_does_not_raise_lets_the_work_be_done_in_full(handler):
    seen = []
    handler(signal.SIGTERM, lambda number, _: seen.append(number))

    def function(signals):
        signal.raise_signal(signal.SIGTERM)
        return "part" if asked_to_stop(signals) else "whole"

    assert interruptible(function) == "whole"
    assert seen == [signal.SIGTERM] * 2


def test_other_signals_stop_nothing(handler):
    seen, stopped = [], []
    handler(signal.SIGUSR1, lambda number, _: seen.append(number))
    handler(signal.SIGINT, signal.default_int_handler)

    def function(signals):
        for number in (signal.SIGUSR1, signal.SIGUSR1, signal.SIGINT):
            signal.raise_signal(number)
            stopped.append(asked_to_stop(signals))

    with pytest.raises(KeyboardInterrupt):
        interruptible(function)
    assert stopped == [False, False, True]
    assert seen == [signal.SIGUSR1] * 2


def test_an_event_loop_hears_of_the_signals_that_arrived(handler):
    handler(signal.SIGUSR1, lambda *_: None)
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    former = signal.set_wakeup_fd(writing)
    try:
        interruptible(lambda _: signal.raise_signal(signal.SIGUSR1))
        assert os.read(reading, 9) == bytes([signal.SIGUSR1])
        assert signal.set_wakeup_fd(former) == writing
    finally:
        signal.set_wakeup_fd(former)
        os.close(reading)
        os.close(writing)


def test_without_a_place_for_files_and_in_other_threads_a_signal_waits(handler, monkeypatch):
    handler(signal.SIGINT, signal.default_int_handler)
    interruption._signal_file.cache_clear()
    monkeypatch.setattr("tempfile.mkstemp", lambda: (_ for _ in ()).throw(OSError("no room")))

    def function(signals):
        signal.raise_signal(signal.SIGINT)
        assert not asked_to_stop(signals)

    with pytest.raises(KeyboardInterrupt):
        interruptible(function)
    interruption._signal_file.cache_clear()
    found = []
    thread = threading.Thread(target=lambda: found.append(interruptible(lambda signals: signals.copy())))
    thread.start()
    thread.join()
    assert not np.any(found[0])


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


def test_simulations_in_a_row_are_interrupted_without_a_crash():
    for wait in (0.05, 0.1, 0.17):
        with subprocess.Popen(
            [sys.executable, "-c", SIMULATIONS], stdout=subprocess.PIPE, stderr=subprocess.PIPE
        ) as run:
            assert run.stdout.readline() == b"begun\n"
            time.sleep(wait)
            run.send_signal(signal.SIGINT)
            try:
                said = run.communicate(timeout=HANG)[1]
            finally:
                run.kill()
        assert run.returncode == -signal.SIGINT
        assert b"KeyboardInterrupt" in said


def test_a_long_simulation_ends_with_the_step_in_which_it_is_interrupted(handler, monkeypatch):
    begun, outcomes = threading.Event(), []

    def watched(*arguments):
        begun.set()
        result = march(*arguments)
        outcomes.append(result.outcome)
        return result

    def press():
        assert begun.wait(HANG)
        os.kill(os.getpid(), signal.SIGINT)

    simulation.load_kernels()
    monkeypatch.setattr(simulation, "march", watched)
    handler(signal.SIGINT, signal.default_int_handler)
    # Left alone, it ends at the most steps that are allowed.
    times = np.arange(50_000.0)
    path = bem.PiecewiseLinearProtocol(times, 20.0 * (times % 2.0) - 5.0)
    thread = threading.Thread(target=press)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        bem.simulate(bem.Scene(3.0), path)
    thread.join()
    assert outcomes == [INTERRUPTED]


def test_a_simulation_that_was_interrupted_in_vain_gives_the_same_numbers(handler):
    scene = bem.Scene(1.0)
    path = bem.LoadingProtocol(peak_indentation=20.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
    expected = bem.simulate(scene, path)
    seen = []
    handler(signal.SIGINT, lambda number, _: seen.append(number))
    ended = threading.Event()

    def press():
        while not ended.wait(1e-3):
            os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    try:
        # On a busy machine a simulation of a few milliseconds can end before the other thread runs at all.
        for _ in range(1000):
            before = len(seen)
            found = bem.simulate(scene, path)
            if len(seen) > before:
                break
    finally:
        ended.set()
        thread.join()
    assert len(seen) > before
    assert found.status == "completed"
    np.testing.assert_array_equal(found.force, expected.force)
