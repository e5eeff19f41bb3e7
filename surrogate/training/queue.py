"""Queue of trainings: many models, a few at a time, each in its own process, stopped on request.

The queue keeps no state of its own. The same command starts it again after an interruption: models whose training is
published (`surrogate.training.identity`) are skipped by the caller, and every other training starts or resumes.
"""

from __future__ import annotations

import atexit
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType

from bem._support.outputs import plain_name

STOP_FILE = "STOP"
"""Name of the file in the directory of the runs that stops them after their current epoch."""
STOPPED = 75
"""Exit status of a run that stopped on request and can be resumed (EX_TEMPFAIL)."""


def stop_request(folder: Path) -> Callable[[], bool]:
    """Return a function that tells whether SIGTERM, or a file called `STOP` in a folder, has requested a stop.

    The call installs a handler of the signal. A second signal ends the process at once.
    """
    received = []

    def notice(number: int, _: FrameType | None) -> None:
        received.append(number)
        signal.signal(number, signal.SIG_DFL)

    signal.signal(signal.SIGTERM, notice)
    return lambda: bool(received) or (folder / STOP_FILE).exists()


def run_queue(
    waiting: Sequence[str],
    command: Callable[[str], list[str]],
    *,
    folder: Path,
    jobs: int,
    log: Callable[[str], None],
    poll_seconds: float = 1.0,
) -> dict[str, int]:
    """Run one process per name, `jobs` at a time.

    Args:
        waiting: Names of the models to train, in order, and of the directories of their runs.
        command: Returns the arguments of `python -m surrogate` for a name.
        folder: Directory of the runs. Each process appends its output to `NAME/log.txt` in it.
        jobs: Largest number of processes at a time.
        log: Called with one line of text when a run starts or ends.
        poll_seconds: Interval between two looks at processes and stop requests.

    Returns:
        The exit status of each process that was started, by name; `STOPPED` if it can be resumed.

    Raises:
        ValueError: a name is not plain.
    """
    for name in waiting:
        plain_name(name, "a run's name")
    should_stop = stop_request(folder)
    queue, running, ended = list(waiting), {}, {}
    asked: set[str] = set()
    # After Ctrl-C, for the trainings may belong to the terminal that sends it, or not.
    atexit.register(lambda: [process.send_signal(signal.SIGINT) for process in running.values()])
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
            for name in running.keys() - asked:
                running[name].terminate()
                asked.add(name)
        time.sleep(poll_seconds)
        for name in [name for name, process in running.items() if process.poll() is not None]:
            status = running.pop(name).returncode
            # The signal ends a process that has not installed its handler yet; that run can be resumed, too.
            ended[name] = STOPPED if name in asked and status < 0 else status
            outcome = {0: "done", STOPPED: "stopped, to be resumed"}.get(ended[name])
            log(f"{name}: {outcome or f'failed with status {ended[name]}, see {folder / name}/log.txt'}")
    return ended
