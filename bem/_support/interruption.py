"""Ctrl-C ends a command with one line and status 130.

Kernels return to Python after some 50 ms of work (`bem.methods.records.SLICE`), where it calls signal handlers, and
what a command writes is renamed into its place when it is complete. A command's first act is an import of this module,
so its own imports are few.
"""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

INTERRUPTED = 130
_standard_error = 2
_kept = "what is complete is kept, and the same command starts again"


def say_what_is_kept(text: str) -> None:
    """State what an interruption of this command keeps and how to continue."""
    global _kept
    _kept = text


def end_on_interrupt(name: str) -> None:
    """From now on let Ctrl-C end this process with one line that begins with `name`, and status 130.

    In a process that ignores the signal, such as one in the background of a shell, nothing changes.
    """
    global _standard_error
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        with suppress(OSError):  # a copy, because Keras starts with standard error held back
            _standard_error = os.dup(2)
        signal.signal(signal.SIGINT, lambda *_: end(name))


def end(name: str) -> NoReturn:
    """End an interrupted command, by an exception that no library takes for its own."""
    with suppress(OSError):
        os.write(_standard_error, f"{name}: interrupted; {_kept}\n".encode())
    raise SystemExit(INTERRUPTED)


@contextmanager
def interrupted_afterwards() -> Iterator[None]:
    """Let Ctrl-C wait until renames that belong together are done."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) is None:
        yield  # signal handlers run elsewhere
        return
    signals: list[Any] = []
    former = signal.signal(signal.SIGINT, lambda *arguments: signals.append(arguments))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, former)
    if signals and callable(former):
        former(*signals[0])


@contextmanager
def without_interrupts() -> Iterator[None]:
    """Keep Ctrl-C from processes that begin here: a terminal sends it to all, but the main one alone answers."""
    from multiprocessing import resource_tracker

    former = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        resource_tracker.ensure_running()  # which unblocks the signal
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, former)
