"""Ctrl-C ends every command in one line, and a signal handler that raises ends a simulation, not the process."""

import _thread
import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import bem
from bem._support.interruption import interruptible
from bem.solver import simulation
from bem.solver.time_stepping import INTERRUPTED, march
from tests.processes import ROOT, python

HANG = 600.0  # seconds after which a program that should end is taken to hang
LATEST = 5.0  # seconds to react: one, on a machine that other tests keep busy


@pytest.fixture
def handler():
    """Sets the handler of a signal for the length of a test."""
    former = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)}
    yield signal.signal
    for number, handle in former.items():
        signal.signal(number, handle)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGALRM])
def test_a_handler_that_raises_stops_the_function(number, handler):
    handler(number, signal.default_int_handler)
    ended = []

    def function(word, stop):
        os.kill(os.getpid(), number)
        while not stop[0]:
            time.sleep(1e-3)
        ended.append(word)

    with pytest.raises(KeyboardInterrupt):
        interruptible(function, "all")
    assert ended == ["all"]


def test_a_signal_in_the_instant_before_the_wait_is_heard(handler):
    """`interrupt_main` notes a signal without waking who waits, as one that arrives just before does."""
    heard = []

    def function(stop):
        _thread.interrupt_main()
        until = time.monotonic() + LATEST
        while not stop[0] and time.monotonic() < until:
            time.sleep(1e-3)
        heard.append(stop[0])

    handler(signal.SIGINT, signal.default_int_handler)
    with pytest.raises(KeyboardInterrupt):
        interruptible(function)
    assert heard == [1]


def test_other_threads_hear_of_no_signal_and_errors_come_through():
    threads = []
    thread = threading.Thread(target=interruptible, args=(lambda _: threads.append(threading.current_thread()),))
    thread.start()
    thread.join()
    assert threads == [thread]
    with pytest.raises(ZeroDivisionError):
        interruptible(lambda stop: 1 // int(stop[0]))


def test_a_long_simulation_ends_with_the_step_in_which_it_is_interrupted(handler, monkeypatch):
    outcomes = []

    def watched(*arguments):
        os.kill(os.getpid(), signal.SIGINT)
        outcomes.append(march(*arguments).outcome)

    simulation.load_kernels()
    monkeypatch.setattr(simulation, "march", watched)
    handler(signal.SIGINT, signal.default_int_handler)
    # Left alone, it ends at the most steps that are allowed.
    times, scene = np.arange(50_000.0), bem.Scene(3.0, bem.StandardLinearSolid(0.1))
    with pytest.raises(KeyboardInterrupt):
        bem.simulate(scene, bem.PiecewiseLinearProtocol(times, 20.0 * (times % 2.0) - 5.0))
    assert outcomes == [INTERRUPTED]


def test_a_handler_that_does_not_raise_changes_no_number(handler):
    scene = bem.Scene(1.0)
    path = bem.LoadingProtocol(peak_indentation=20.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
    expected, seen = bem.simulate(scene, path), []
    handler(signal.SIGALRM, lambda number, _: seen.append(number))
    signal.setitimer(signal.ITIMER_REAL, 1e-4, 1e-4)
    try:
        while not seen:
            found = bem.simulate(scene, path)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    assert found.status == "completed"
    np.testing.assert_array_equal(found.force, expected.force)


ALARMS = """
import random, signal, sys, time
import bem, bem.lab
from tests.bem.lab.measurement import BEAD, measured
class Alarm(Exception): pass
def ring(*_): raise Alarm
path = bem.LoadingProtocol(peak_indentation=20.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
deep = bem.LoadingProtocol(peak_indentation=2000.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
elastic, scene = bem.Scene(300.0, material=bem.Elastic()), bem.Scene(3.0)
curve = measured()
kinds = [
    (lambda: bem.simulate(scene, path), 0.02),
    (lambda: bem.simulate(elastic, deep, 1e-4), 0.1),
    (lambda: bem.simulate_paper_method(bem.Scene(1.0), path), 0.1),
    (lambda: bem.lab.fit(curve, BEAD, ["contact_point"]), 0.1),
]
bem.simulate_paper_method(scene, path, nodes=10, steps=2)
kinds[-1][0]()  # an import that an alarm cuts short may not be repeated
signal.signal(signal.SIGALRM, ring)
latest = 0.0
for work, longest in kinds * int(sys.argv[1]):
    wait = random.uniform(0.001, longest)
    begin = time.monotonic()
    try:
        signal.setitimer(signal.ITIMER_REAL, wait)
        while True:
            work()
    except Alarm:
        latest = max(latest, time.monotonic() - begin - wait)
print(latest)
"""


def test_a_handler_that_raises_ends_work_at_once_without_a_crash():
    run = python("-W", "ignore", "-c", ALARMS, "5", cwd=ROOT, timeout=HANG)
    assert (run.returncode, run.stderr) == (0, "")
    assert float(run.stdout) < LATEST


CYCLE = "--loading-rate 1 --unloading-rate 1"
DATA = "published/dataset.h5"
STARTS_AGAIN = "what is complete is kept, and the same command starts again"
CONTINUES = "what was done is saved, and the same command continues"
RESUMES = "completed epochs are saved, and the same command continues"
TISSUE = "examples/measured_tissue.csv --radius 5mm --stiffness 5kN/m --force-sign compression"
COMMANDS = {
    f"-m bem simulate --tabor 3 --peak-indentation 4000 {CYCLE} --accuracy reference --csv OUT/o.csv": STARTS_AGAIN,
    f"-m bem simulate --tabor 300 --material elastic --peak-indentation 2000 {CYCLE} --accuracy 1e-4": STARTS_AGAIN,
    f"-m bem fit {TISSUE} --out OUT/fit.json": STARTS_AGAIN,
    "-m bem campaign --out OUT/data.h5 --workers 2": CONTINUES,
    f"-m bem verify {DATA} --sample 12450 --workers 2": STARTS_AGAIN,
    "-m surrogate train M1-concat --recipe paper --runs OUT/runs --models OUT/models": RESUMES,
    "-m surrogate train-all --runs OUT/runs --models OUT/models": RESUMES,
    f"-m surrogate predict M1-concat --tabor 1 --peak-indentation 10 --dwell-time 1 {CYCLE}": STARTS_AGAIN,
    f"-m surrogate evaluate M1-concat --dataset {DATA}": STARTS_AGAIN,
    "-m experiments soak --out OUT/soak.json": STARTS_AGAIN,
    "-m paper_figures figure-features --results OUT": STARTS_AGAIN,
    "tools/fill.py --check README.md": STARTS_AGAIN,
}


def begin(words, out):
    """Start a command; return it once it leaves Ctrl-C to a thread, which it does first."""
    # Tests that run in the background inherit an ignored SIGINT, and would pass it on.
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = subprocess.Popen(
        [sys.executable, *words.replace("OUT", str(out)).split()],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    signal.signal(signal.SIGINT, former)
    status = Path(f"/proc/{process.pid}/status")
    while process.poll() is None:
        blocked = next(line for line in status.read_text().splitlines() if line.startswith("SigBlk"))
        if int(blocked.split()[1], 16) & 1 << (signal.SIGINT - 1):
            break
        time.sleep(1e-3)
    return process


def processor_seconds(process):
    times = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, times)) / os.sysconf("SC_CLK_TCK")


def interrupt(words, out, wait, *, group):
    """Interrupt a command after `wait` seconds; return the seconds until it ended, `None` if it had ended before.

    They are those of its processor, so that it gets as far on a machine that other tests keep busy.
    """
    process, until = begin(words, out), time.monotonic() + 5.0 * wait
    while process.poll() is None and processor_seconds(process) < wait and time.monotonic() < until:
        time.sleep(1e-2)
    sent = time.monotonic()
    if process.poll() is None:
        (os.killpg if group else os.kill)(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=HANG)
    took = time.monotonic() - sent
    lines = [line for line in errors.splitlines() if "compiling the solver" not in line and not line.endswith(" left")]
    if process.returncode == 0 and "Traceback" not in errors:
        return None
    name = Path(words.split()[0]).stem if words.startswith("tools") else words.split()[1]
    name = f"python -m {name}" if name in ("experiments", "paper_figures") else name
    kept = (COMMANDS[words], STARTS_AGAIN)  # the second before it is known which command it is
    assert process.returncode == 130, errors
    assert len(lines) == 1, errors
    assert lines[0] in [f"{name}: interrupted; {what}" for what in kept]
    assert not [path for path in out.rglob(".*") if path.suffix in (".csv", ".json", ".writing")]
    return took


@pytest.mark.parametrize(("number", "wait"), [(0, 2.0), (5, 0.3), (6, 1.0), (9, 0.0), (11, 0.1)])
def test_control_c_ends_a_command_in_one_line(number, wait, tmp_path):
    took = interrupt(list(COMMANDS)[number], tmp_path, wait, group=number % 2 == 1)
    assert took is None or took < LATEST


@pytest.mark.slow
def test_control_c_ends_the_processes_of_a_map_too(tmp_path):
    place, time_of = np.concatenate([np.linspace(-1e-6, 1e-6, 400), np.linspace(1e-6, -1e-6, 400)]), np.arange(800.0)
    table = np.column_stack([time_of, place, -1e-4 * np.maximum(place, 0.0) ** 1.5])
    table[:, 2] += 1e-16 * np.random.default_rng(0).standard_normal(800)
    columns = "time (s),indentation (m),force (N)"
    np.savetxt(tmp_path / "0.csv", table, delimiter=",", header=columns, comments="")
    for number in range(1, 40):
        (tmp_path / f"{number}.csv").symlink_to("0.csv")
    curves = " ".join(f"OUT/{number}.csv" for number in range(40))
    process = begin(f"-m bem fit-map {curves} --radius 5um --jobs 2 --out OUT/map.csv", tmp_path)
    fitted = tmp_path / "map.csv"
    while process.poll() is None and not (fitted.is_file() and fitted.read_text().count("\n") > 2):
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    # Its processes have the pipes, which close when the last one ends.
    _, errors = process.communicate(timeout=60.0)
    assert process.returncode == 130, errors
    assert errors.splitlines()[-1].startswith("bem: interrupted; the curves fitted so far are kept in")


@pytest.mark.slow
def test_control_c_ends_any_command_at_any_instant_in_one_line(tmp_path):
    seconds = []
    for number in range(200):
        (out := tmp_path / str(number)).mkdir()
        words, wait = random.choice(list(COMMANDS)), 10.0 ** random.uniform(-3.0, 1.0)
        took = interrupt(words, out, wait, group=random.random() < 0.5)
        print(f"{wait:7.3f} {took} {words}")
        seconds += [] if took is None else [took]
    assert len(seconds) > 100
    assert np.percentile(seconds, 95) < LATEST
