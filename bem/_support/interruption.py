"""Ctrl-C ends a command with one line at any instant, and a caller's signal handler may raise while a kernel runs.

Python calls signal handlers in the main thread, between two of its instructions: not while compiled code runs, but in
Python that compiled code calls, where an exception is lost or ends the process. A command therefore leaves Ctrl-C to a
thread of its own, and a kernel leaves the main thread free. A command's first act is an import of this module, so its
own imports are few.
"""

import _thread
import atexit
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn, TypeVar

_Result = TypeVar("_Result")
INTERRUPTED = 130
_PATIENCE = 0.5  # seconds, for a file or a kernel's step to be completed

whole = threading.RLock()
"""Held where an interruption would leave half of something, such as a file."""
undo: list[Callable[[], object]] = []
"""What an interrupted command does before it ends: removes unfinished files, interrupts other processes."""
_standard_error = 2
_kept = "what is complete is kept, and the same command starts again"


def say_what_is_kept(text: str) -> None:
    """State what an interruption of this command keeps and how to continue."""
    global _kept
    _kept = text


def end_on_interrupt(name: str) -> None:
    """From now on let Ctrl-C end this process within a second, with one line that begins with `name`, and status 130.

    The signal stays blocked in all other threads, and in processes started from now on, which therefore print nothing.
    In a process that ignores the signal, such as one in the background of a shell, nothing changes.
    """
    global _standard_error
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        with suppress(OSError):  # a copy, because Keras starts with standard error held back
            _standard_error = os.dup(2)
        signal.signal(signal.SIGINT, lambda *_: end(name))  # should a library unblock the signal
        threading.Thread(target=lambda: signal.sigwait({signal.SIGINT}) and end(name), daemon=True).start()


@contextmanager
def deaf_processes() -> Iterator[None]:
    """Keep Ctrl-C from processes that begin here: a terminal sends it to all, but the main one alone answers."""
    from multiprocessing import resource_tracker

    if _end_processes not in undo:
        undo.append(_end_processes)
    former = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        resource_tracker.ensure_running()  # which unblocks the signal
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        with whole:
            yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, former)


def end(name: str) -> NoReturn:
    """End an interrupted command now. Whatever must outlast this is on the disk, as it must outlast a power cut."""
    line = f"{name}: interrupted; {_kept}\n"
    with suppress(RuntimeError):  # no thread begins at the end of a process
        tidying = threading.Thread(target=_tidy, daemon=True)
        tidying.start()
        tidying.join(_PATIENCE)
    with suppress(OSError):
        # On a terminal, a progress bar may have hidden the cursor.
        os.write(_standard_error, (f"\x1b[?25h\n{line}" if os.isatty(_standard_error) else line).encode())
    os._exit(INTERRUPTED)


def _tidy() -> None:
    whole.acquire()
    if _standard_error != 2:  # complaints of libraries whose work ends here
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    for action in tuple(undo):
        with suppress(Exception):
            action()


def _end_processes() -> None:
    from multiprocessing import active_children, util

    for process in active_children():
        os.kill(process.pid, signal.SIGKILL)
    # Otherwise the process that keeps semaphores and shared memory warns of them.
    util._run_finalizers(0)  # type: ignore[attr-defined]
    atexit._run_exitfuncs()


def interruptible(function: Callable[..., _Result], *arguments: Any) -> _Result:
    """Call a function with kernels, and handle signals meanwhile; a handler that raises makes it return early.

    The function runs in another thread, where Python calls no handlers.

    Args:
        function: Its last parameter is an array of one byte, which it looks at now and then: if not zero, it returns.
        arguments: The other ones.

    Raises:
        BaseException: what the function or a signal handler raised.
    """
    import numpy as np

    stop = np.zeros(1, np.uint8)
    if threading.get_ident() != threading.main_thread().ident:
        return function(*arguments, stop)
    outcome: list[tuple[Any, BaseException | None]] = []
    ended = threading.Lock()
    ended.acquire()

    def work() -> None:
        sys.settrace(threading.gettrace())
        try:
            outcome.append((function(*arguments, stop), None))
        except BaseException as error:
            outcome.append((None, error))
        finally:
            ended.release()

    try:
        # `Thread.start` and `Future.result` are Python, in which a handler that raises would leave half of something.
        _thread.start_new_thread(work, ())
        # Again and again, because a signal that arrives in the instant before a wait does not end it.
        while not ended.acquire(timeout=_PATIENCE):
            pass
    except BaseException:
        stop[0] = 1
        ended.acquire(timeout=_PATIENCE)
        raise
    result, error = outcome[0]
    if error is not None:
        raise error
    return result
