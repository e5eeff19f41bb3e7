"""The decorators of all compiled functions, which set their caching and error handling.

`error_model="numpy"` lets a division by zero give an infinity instead of raising inside a kernel; `fastmath` stays off
because a NaN must remain visible. `bem._support.kernel_cache` keeps compiled code on disk.
"""

import multiprocessing
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from numba import config, njit

from bem._support.kernel_cache import cache_directory, enable_caching

_OPTIONS = {"error_model": "numpy", "nogil": True, "fastmath": {"contract"}}
_MARK = ".complete"  # in a cache that holds all kernels; without it, a compilation was interrupted
COMPILING_SECONDS = 80  # of one core: `bem compile` with an empty cache took 77 and 79; `make setup` does it beforehand


def announce_compilation() -> None:
    """Print a line on standard error when not all kernels are in the cache, and some will be compiled."""
    in_main_process = multiprocessing.parent_process() is None
    if in_main_process and not config.DISABLE_JIT and not ((mark := _mark()) and mark.exists()):
        print(f"bem: compiling the solver for this processor, once; about {COMPILING_SECONDS} s ...", file=sys.stderr)


def note_compilation() -> None:
    """Note in the cache that it holds all kernels; where it cannot be written, they are compiled each time."""
    if not config.DISABLE_JIT and (mark := _mark()) and not mark.exists():
        with suppress(OSError):
            mark.touch()


def _mark() -> Path | None:
    directory = config.CACHE_DIR or cache_directory()
    return Path(directory) / _MARK if directory else None


def in_python(function: Callable) -> Callable:
    """Return the function that a kernel was compiled from: for a few calls, loading the kernel takes longer."""
    return getattr(function, "py_func", function)


def kernel(function: Callable) -> Callable:
    """Compile a function with Numba, cached on disk."""
    return enable_caching(njit(**_OPTIONS)(function))


def kernel_part(function: Callable) -> Callable:
    """Insert a function into the kernel that calls it; use this for parts of a kernel that have one caller.

    Numba compiles each kernel again inside every kernel that calls it, so compilation time grows with call depth.
    """
    return njit(inline="always", **_OPTIONS)(function)
