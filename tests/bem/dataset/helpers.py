"""Campaigns of the stand-in solver: started in processes of their own, watched, and compared."""

import errno
import functools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bem.cli.app import app
from bem.dataset.executors import CampaignError, Executor
from bem.dataset.journal import MARK
from bem.dataset.run import run_campaign
from bem.dataset.sealed_file import arrays, open_dataset
from tests.bem.dataset import stand_in
from tests.data_files import editing
from tests.processes import ROOT

HANG = 600.0  # seconds after which a process that should end is taken to hang, however busy the machine is


def run_here(*arguments, **options):
    """Compute a campaign in this process, which starts no workers."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bem.dataset.run.LocalExecutor", Here)
        return run_campaign(*arguments, **options)


def command(*arguments, solver=None):
    """Run `bem` in this process, and its campaigns too where a stand-in for the solver is given."""
    former = signal.getsignal(signal.SIGTERM)
    try:
        with pytest.MonkeyPatch.context() as patch:
            if solver is not None:
                run = functools.partial(run_here, solver=solver)
                patch.setattr("bem.dataset.run.run_campaign", run)
            return CliRunner().invoke(app, [str(argument) for argument in arguments])
    finally:
        signal.signal(signal.SIGTERM, former)  # a campaign takes it for itself


def assert_same_numbers(*paths):
    tables = []
    for path in paths:
        with open_dataset(path) as file:
            tables.append({name: item[...] for name, item in arrays(file) if name != "scalars/solver_seconds"})
    np.testing.assert_equal(*tables)


def journals(out):
    return sorted(out.parent.glob(f"{out.name}.*.parts"))


def parts(out):
    """The batches in all journals, each as it was written."""
    return [entry for path in journals(out) for entry in path.read_bytes().split(MARK)[1:-1]]


def wait_for(condition):
    limit = time.monotonic() + HANG
    while not condition():
        assert time.monotonic() < limit
        time.sleep(0.005)


def start_command(*arguments, **options):
    code = (
        "import signal, sys\n"
        # Tests that run in the background inherit an ignored SIGINT.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import bem._support.interruption\n"
        "bem._support.interruption.end_on_interrupt('bem')\n"
        "import bem.dataset.run as run, functools\n"
        "from tests.bem.dataset.helpers import app, stand_in\n"
        "run.run_campaign = functools.partial(run.run_campaign, solver=stand_in.slow)\n"
        f"sys.argv = {['bem', *map(str, arguments)]!r}\n"
        "app()\n"
    )
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, **streams, **options)


def altered(undisturbed, tmp_path, change):
    path = tmp_path / "altered.h5"
    path.write_bytes(undisturbed.read_bytes())
    with editing(path) as file:
        change(file)
    return path


def put(name, value, rows=...):
    return lambda file: file[name].__setitem__(rows, value)


def replaced(name, transform):
    def change(file):
        former = file[name][...]
        del file[name]
        file[name] = transform(former)

    return change


def stop_after(number):
    """What is called with the trajectories that are done, and interrupts the campaign after some of them."""

    def progress(done, _):
        if done > number:
            raise InterruptedError

    return progress


def interrupted(plan, out, number=40):
    """The journal of a campaign of which some trajectories are done, more than this number."""
    with pytest.raises(InterruptedError):
        run_here(plan, out, solver=stand_in.solve, progress=stop_after(number))
    assert not out.exists()
    return journals(out)[0]


def begun(plan, out):
    """The journals of a campaign all of whose parts are there, but not the file: the disk was full at the very end."""

    def refuse(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "replace", refuse)
        with pytest.raises(CampaignError, match=r"No space left on device.*the same command continues"):
            run_here(plan, out, solver=stand_in.solve, replace=True)
    assert not out.exists()
    assert not list(out.parent.glob("*.writing"))
    return journals(out)


class Here(Executor):
    """A pool that works in this process."""

    workers = 1

    def __init__(self, *_):
        pass

    def __exit__(self, *_):
        pass

    def run(self, batches, task):
        while batches:
            batch = batches.popleft()
            yield batch, task(batch)
