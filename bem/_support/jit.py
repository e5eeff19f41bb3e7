"""The decorators of all compiled functions, which set their caching and error handling.

`error_model="numpy"` lets a division by zero give an infinity instead of raising inside a kernel; `fastmath` stays off
because a NaN must remain visible.

Compiled code is kept on disk under a digest of all sources with kernels or the tuples they take: Numba by itself looks
only at the file of a kernel, so after a change it would still use stale copies of the kernels that this one calls.
"""

import functools
import hashlib
import multiprocessing
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from numba import config, njit

_OPTIONS = {"error_model": "numpy", "nogil": True, "fastmath": {"contract"}}
_MARK = ".complete"  # in a cache that holds all kernels; without it, a compilation was interrupted
COMPILING_SECONDS = 80  # of one core: `bem compile` with an empty cache took 77 and 79; `make setup` does it beforehand


@functools.cache
def cache_directory() -> str:
    """Where compiled kernels of exactly these sources are kept: beside them, or where a user may write."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for source in sorted(package.rglob("*.py")):
        text = source.read_bytes()
        if b"@kernel" in text or b"NamedTuple" in text:
            digest.update(text)
    name = f"kernels-{digest.hexdigest()[:16]}"
    if os.access(package, os.W_OK):
        return str(package / "__pycache__" / name)
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    beside = Path(home) if os.access(home, os.W_OK) else Path(tempfile.gettempdir())
    return str(beside / "contact-trajectories" / name)


def announce_compilation() -> None:
    """Print a line on standard error when not all kernels are in the cache, and some will be compiled."""
    in_main_process = multiprocessing.parent_process() is None
    if in_main_process and not config.DISABLE_JIT and not _mark().exists():
        print(f"bem: compiling the solver for this processor, once; about {COMPILING_SECONDS} s ...", file=sys.stderr)


def note_compilation() -> None:
    """Note in the cache that it holds all kernels; where it cannot be written, they are compiled each time."""
    if not config.DISABLE_JIT and not _mark().exists():
        with suppress(OSError):
            _mark().touch()


def _mark() -> Path:
    return Path(config.CACHE_DIR or cache_directory()) / _MARK


def in_python(function: Callable) -> Callable:
    """Return the function that a kernel was compiled from: for a few calls, loading the kernel takes longer."""
    return getattr(function, "py_func", function)


def kernel(function: Callable) -> Callable:
    """Compile a function with Numba, cached on disk."""
    before = config.CACHE_DIR
    if not before:  # else the user has chosen a place
        config.CACHE_DIR = cache_directory()
    try:
        return njit(cache=True, **_OPTIONS)(function)
    finally:
        config.CACHE_DIR = before


def kernel_part(function: Callable) -> Callable:
    """Insert a function into the kernel that calls it; use this for parts of a kernel that have one caller.

    Numba compiles each kernel again inside every kernel that calls it, so compilation time grows with call depth.
    """
    return njit(inline="always", **_OPTIONS)(function)
