"""Ctrl-C ends a command in one line within a second, and a signal handler that raises ends a simulation."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import bem
from bem.methods import paper_method, records
from bem.methods.boundary_elements import history
from bem.methods.elastic_curve import branch as elastic_branch
from bem.methods.without_adhesion import viscoelastic_history
from tests.processes import ROOT

HANG = 600.0  # seconds after which a program that should end is taken to hang
SOFT, SLICED = bem.StandardLinearSolid(0.1), (history, elastic_branch, viscoelastic_history, paper_method)
CYCLE = bem.LoadingProtocol(peak_indentation=5.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
TWICE = bem.PiecewiseLinearProtocol([0.0, 1.0, 2.0, 3.0], [-1.0, 2.0, -1.0, 2.0])
WAYS = {
    "boundary elements": lambda: bem.simulate(bem.Scene(1.0, SOFT), CYCLE).force,
    "elastic curve": lambda: bem.simulate(bem.Scene(1.03, bem.Elastic()), CYCLE).force,
    "no adhesion": lambda: bem.simulate(bem.Scene(1.0, SOFT, bem.HardContact(), spring=1.0), TWICE).force,
    "paper": lambda: bem.simulate_paper_method(bem.Scene(1.0, SOFT), CYCLE, nodes=20, steps=5).force,
    "steps": lambda: bem.Contact(bem.Scene(1.0, SOFT)).advance(0.5, indentation=1.0),
}


@pytest.mark.parametrize("way", WAYS)
def test_slices_of_work_change_no_number(way, monkeypatch):
    uncut, slices = WAYS[way](), []
    elastic_branch.branch_of.cache_clear()
    monkeypatch.setattr(records, "SLICE", 1)
    for module in SLICED:
        monkeypatch.setattr(module, "next_slice", lambda work: slices.append(work) or records.next_slice(work))
    np.testing.assert_array_equal(WAYS[way](), uncut)
    assert len(slices) > 2


@pytest.mark.parametrize("way", WAYS)
def test_a_handler_is_called_between_slices(way, monkeypatch):
    class AlarmError(Exception):
        pass

    def ring(*_):
        raise AlarmError

    elastic_branch.branch_of.cache_clear()
    for module in SLICED:
        monkeypatch.setattr(module, "next_slice", lambda work: os.kill(os.getpid(), signal.SIGALRM) or work)
    former = signal.signal(signal.SIGALRM, ring)
    try:
        with pytest.raises(AlarmError):
            WAYS[way]()
    finally:
        signal.signal(signal.SIGALRM, former)


RAMPS = "--loading-rate 1 --unloading-rate 1"
STARTS_AGAIN = "what is complete is kept, and the same command starts again"
COMMANDS = {
    f"-m bem simulate --tabor 3 --peak-indentation 4000 {RAMPS} --accuracy reference --csv OUT/o.csv": "bem",
    f"-m surrogate predict M1-concat --tabor 1 --peak-indentation 10 --dwell-time 1 {RAMPS}": "surrogate",
    "-m paper_figures figure-5 a.json --out OUT/a.pdf": "python -m paper_figures",
}


def begin(options, out):
    """Start a command in a session of its own, which Ctrl-C reaches as a whole."""
    # Tests that run in the background inherit an ignored SIGINT, and would pass it on.
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    command = [sys.executable, *options.replace("OUT", str(out)).split()]
    process = subprocess.Popen(command, cwd=ROOT, start_new_session=True, **streams)
    signal.signal(signal.SIGINT, former)
    return process


@pytest.mark.parametrize("options", COMMANDS)
def test_ctrl_c_ends_a_command_in_one_line(options, tmp_path):
    process = begin(options, tmp_path)
    until = time.monotonic() + HANG
    while process.poll() is None and "numpy" not in Path(f"/proc/{process.pid}/maps").read_text():
        assert time.monotonic() < until
        time.sleep(1e-2)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=HANG)
    lines = [line for line in errors.splitlines() if "compiling the solver" not in line]
    assert process.returncode == 130, errors
    assert lines == [f"{COMMANDS[options]}: interrupted; {STARTS_AGAIN}"]
    assert list(tmp_path.rglob(".*")) == []
