"""Ctrl-C while a compiled kernel runs.

Python handles a signal only after a kernel has returned. The handler of the operating system runs at once, however, and
writes the number of the signal to the file that `signal.set_wakeup_fd` names. Here a kernel sees this file as an array;
it looks there now and then, and returns early.
"""

import functools
import mmap
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from bem._numerics.jit import kernel_part

_Result = TypeVar("_Result")
_INTERRUPT, _TERMINATE = int(signal.SIGINT), int(signal.SIGTERM)
_SIZE = 64  # signals that a file keeps; they may be others, which stop nothing
_NO_SIGNALS = np.zeros(_SIZE, np.uint8)


@kernel_part
def asked_to_stop(signals: np.ndarray) -> bool:
    """Whether Ctrl-C, or the request of a batch system to end, is among the signals that have arrived."""
    for number in signals:
        if number in (_INTERRUPT, _TERMINATE):
            return True
        if number == 0:
            break
    return False


def interruptible(function: Callable[..., _Result], *arguments: Any) -> _Result:
    """Call a kernel that returns early when it is asked to stop; the signal is handled as soon as it has returned.

    Not before: a kernel makes the named tuple that it returns by calling Python. A signal handler that raises at that
    moment, as that of Ctrl-C does, would end the process with a segmentation fault, because Numba does not look for
    errors there. Handlers run in the main thread only, so that calls from others need no protection.

    Args:
        function: The kernel. Its last parameter is an array of bytes, for `asked_to_stop`.
        arguments: The other ones.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed meanwhile.
    """
    if threading.current_thread() is not threading.main_thread():
        return function(*arguments, _NO_SIGNALS)

    def noting(*given: Any) -> _Result:
        with _noted_signals() as signals:
            return function(*given, signals)

    result, stopped = _handling_signals(noting, *arguments)
    # A handler that does not raise wants the work to go on, and what the kernel returned may be a part of it.
    return _handling_signals(function, *arguments, _NO_SIGNALS)[0] if stopped else result


def _handling_signals(function: Callable[..., _Result], *arguments: Any) -> tuple[_Result, bool]:
    """Call a function and then the handlers of what arrived meanwhile; return its result and whether anything did."""
    arrived: list[tuple[int, Any]] = []
    handlers = {number: signal.getsignal(number) for number in (_INTERRUPT, _TERMINATE)}
    handling = {number: handler for number, handler in handlers.items() if callable(handler)}
    for number in handling:
        signal.signal(number, lambda *what: arrived.append(what))
    try:
        result = function(*arguments)
    finally:
        for number, handler in handling.items():
            signal.signal(number, handler)
    for number, frame in arrived:
        handling[number](number, frame)
    return result, bool(arrived)


@contextmanager
def _noted_signals() -> Iterator[np.ndarray]:
    """Give the numbers of the signals that arrive from now on, as bytes, zero where there is none yet."""
    file, signals = _signal_file(os.getpid())
    if file < 0:
        yield signals
        return
    os.lseek(file, 0, os.SEEK_SET)
    signals[:] = 0
    former = signal.set_wakeup_fd(file)
    try:
        yield signals
    finally:
        signal.set_wakeup_fd(former)
        if former >= 0 and signals[0] != 0:  # an event loop waits for them
            with suppress(OSError):
                os.write(former, signals[signals != 0].tobytes())


@functools.cache
def _signal_file(_process: int) -> tuple[int, np.ndarray]:
    """A file for signals and its content as an array, one for each process; no file where none can be made."""
    try:
        file, name = tempfile.mkstemp()
        Path(name).unlink()
        os.ftruncate(file, _SIZE)
        os.set_blocking(file, False)  # `set_wakeup_fd` takes no other
        return file, np.frombuffer(mmap.mmap(file, _SIZE), np.uint8)
    except OSError:
        return -1, _NO_SIGNALS
