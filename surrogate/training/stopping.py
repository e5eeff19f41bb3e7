"""Requests to stop a training after its current epoch, by a signal or a file."""

from __future__ import annotations

import signal
from collections.abc import Callable
from pathlib import Path
from types import FrameType

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
