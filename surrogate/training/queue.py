"""Train many models, a few at a time, each in a process of its own; and how such work is asked to stop.

The queue keeps no state of its own. A published model of the same training (`surrogate.training.identity`) is done;
every other one starts or resumes. An interrupted queue is therefore continued by starting it again.
"""

from __future__ import annotations

import csv
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType

from bem._support.outputs import plain_name

STOP_FILE = "STOP"
STOPPED = 75
"""Exit status of a run that was asked to stop and can be resumed (EX_TEMPFAIL)."""


class StopRequest:
    """Notices SIGTERM, SIGINT and a stop file; ask it by calling it. The same signal again ends the process at once.

    Args:
        folder: A file called `STOP` in this directory asks to stop.
    """

    def __init__(self, folder: Path) -> None:
        self.file = folder / STOP_FILE
        self.signalled = False
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._notice)

    def __call__(self) -> bool:
        """Tell whether a stop has been asked for."""
        return self.signalled or self.file.exists()

    def _notice(self, number: int, _frame: FrameType | None) -> None:
        self.signalled = True
        signal.signal(number, signal.SIG_DFL)


def run_queue(
    waiting: Sequence[str],
    command: Callable[[str], list[str]],
    *,
    folder: Path,
    jobs: int,
    log: Callable[[str], None],
    poll_seconds: float = 1.0,
    status_seconds: float = 300.0,
) -> dict[str, int]:
    """Run one process per name, `jobs` at a time.

    Args:
        waiting: The names to train, in order; plain names, since their directories are called so.
        command: Makes the arguments after `python -m surrogate` that train one name.
        folder: Directory of the runs; each process writes its output to `NAME/log.txt` there.
        jobs: Processes at a time.
        log: Told when a run starts, ends, and how it stands.
        poll_seconds: How often the processes are looked at.
        status_seconds: How often the standing is logged.

    Returns:
        The exit status of every process that was started, by name; `STOPPED` for those to be resumed.

    Raises:
        ValueError: a name is no plain one.
    """
    for name in waiting:
        plain_name(name, "a run's name")
    should_stop = StopRequest(folder)
    queue, running, ended = list(waiting), {}, {}
    last_status = time.monotonic()
    told: set[str] = set()
    while running or (queue and not should_stop()):
        while queue and len(running) < jobs and not should_stop():
            name = queue.pop(0)
            (folder / name).mkdir(parents=True, exist_ok=True)
            with (folder / name / "log.txt").open("a", encoding="utf-8") as output:
                running[name] = subprocess.Popen(
                    [sys.executable, "-m", "surrogate", *command(name)], stdout=output, stderr=subprocess.STDOUT
                )
            log(f"{name}: started, {len(queue)} waiting")
        if should_stop():
            for name in running.keys() - told:
                running[name].terminate()
                told.add(name)
        time.sleep(poll_seconds)
        for name in [name for name, process in running.items() if process.poll() is not None]:
            status = running.pop(name).returncode
            # What is told to stop before it listens is ended by the signal, and resumes as well.
            ended[name] = STOPPED if name in told and status < 0 else status
            outcome = {0: "done", STOPPED: "stopped, to be resumed"}.get(ended[name])
            log(f"{name}: {outcome or f'failed with status {ended[name]}, see {folder / name}/log.txt'}")
        if time.monotonic() - last_status >= status_seconds:
            last_status = time.monotonic()
            for name in running:
                log(f"{name}: {standing(folder / name / 'history.csv')}")
    return ended


def standing(history: Path) -> str:
    """Say in a few words how far a run is, from its history file."""
    if not history.exists():
        return "in its first epoch"
    with history.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        return "in its first epoch"
    return f"epoch {rows[-1]['epoch']}, validation MSE {float(rows[-1]['validation_mse']):.2e}"
