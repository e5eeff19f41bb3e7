"""The decorators of all compiled functions, which set their caching and error handling.

`error_model="numpy"` lets a division by zero give an infinity instead of raising inside a kernel; `fastmath` stays off
because a NaN must remain visible. `bem._support.kernel_cache` keeps compiled code on disk.
"""

import functools
import multiprocessing
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numba import config, njit, types
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager

from bem._support.kernel_cache import cache_directory, enable_caching

_OPTIONS = {"error_model": "numpy", "nogil": True, "fastmath": {"contract"}}


@contextmanager
def compilation(of: Sequence[str], number: int, seconds: float) -> Iterator[None]:
    """Announce on standard error what is compiled here, unless it is in the cache, and how long it will take.

    On a terminal the line counts the seconds.

    Args:
        of: Names of all that is compiled one after the other.
        number: Of those before this one.
        seconds: Of one core, that this one takes.
    """
    name, mark, done = of[number], _mark(of[number]), threading.Event()
    if multiprocessing.parent_process() is not None or config.DISABLE_JIT or (mark and mark.exists()):
        yield
        return
    line = f"bem: compiling the solver for this processor, once: {name} ({number + 1} of {len(of)})"
    clock, processor = time.monotonic(), time.process_time()

    def count() -> None:
        while not done.wait(1.0):
            passed, spent = time.monotonic() - clock, time.process_time() - processor
            left = max(seconds - spent, 1.0) * passed / max(spent, 0.1)  # the more, the busier the processor
            print(f"\r{line}, {passed:.0f} s, about {left:.0f} s left  ", end="", file=sys.stderr, flush=True)

    print(f"{line}, about {seconds:.0f} s", end="\n" if not sys.stderr.isatty() else "", file=sys.stderr, flush=True)
    if sys.stderr.isatty():
        threading.Thread(target=count, daemon=True).start()
    try:
        yield
    finally:
        done.set()
        if sys.stderr.isatty():
            print(f"\r{line}, {time.monotonic() - clock:.0f} s" + 20 * " ", file=sys.stderr)
    with suppress(OSError):
        if mark:  # else it is compiled each time
            mark.touch()


def _mark(name: str) -> Path | None:
    directory = config.CACHE_DIR or cache_directory()
    return Path(directory) / f".{name.replace(' ', '-')}" if directory else None


def uncompiled(function: Callable) -> Callable:
    """Return the function that a kernel was compiled from: for a few calls, loading the kernel takes longer."""
    return getattr(function, "py_func", function)


class _Compiler(CompilerBase):
    as_part = False

    def define_pipelines(self) -> list[PassManager]:
        """The passes of `bem._support.kernel_parts`, or Numba's own where those do not work."""
        if not _parts_work():
            return [DefaultPassBuilder.define_nopython_pipeline(self.state)]
        from bem._support import kernel_parts

        return [(kernel_parts.part_pipeline if self.as_part else kernel_parts.whole_pipeline)(self.state)]


class _PartCompiler(_Compiler):
    as_part = True


class _Kernel:
    """A compiled function: Python calls one form of it, other kernels are compiled with the other one."""

    def __init__(self, function: Callable, *, cache: bool = True) -> None:
        functools.update_wrapper(self, function)
        self.py_func = function
        compiled = njit(no_cfunc_wrapper=True, pipeline_class=_Compiler, **_OPTIONS)(function)
        self._whole = enable_caching(compiled) if cache else compiled
        alone = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        self._part = njit(pipeline_class=_PartCompiler, **alone, **_OPTIONS)(function)
        self._part.get_call_template = self._call_template
        self._numba_type_ = types.Dispatcher(self._part)

    def _call_template(self, args: tuple, kws: dict) -> Any:
        """How another kernel calls this one: compiled once for a type, not anew for each constant argument."""
        named = {name: types.unliteral(argument) for name, argument in dict(kws).items()}
        return type(self._part).get_call_template(self._part, tuple(map(types.unliteral, args)), named)

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self._whole(*args, **kwargs)


_trying = threading.local()


@functools.cache
def _try_parts() -> bool:
    """Whether a small kernel with a part, which has a part itself, is compiled and gives what Python gives."""

    def tail(values: np.ndarray, first: int = 1) -> np.ndarray:
        return values[first:]

    def twice_second(values: np.ndarray) -> float:
        return tail_part(values, 0)[1] + tail_part(values)[0]

    def total(values: np.ndarray) -> float:
        return second_part(values)

    tail_part, second_part = _Kernel(tail, cache=False), _Kernel(twice_second, cache=False)
    _trying.now = True
    try:
        return _Kernel(total, cache=False)(np.array([1.0, 2.0])) == 4.0
    except Exception:  # whatever another version of Numba makes of it
        return False
    finally:
        _trying.now = False


def _parts_work() -> bool:
    return getattr(_trying, "now", False) or _try_parts()


def kernel(function: Callable) -> Callable:
    """Compile a function with Numba, cached on disk where Python calls it."""
    return function if config.DISABLE_JIT else _Kernel(function)
