"""Compiled kernels on disk: a folder that nobody else can write to, and files of which a damaged one counts as missing.

A file holds a pickle and machine code, which can run any program when they are read. Numba by itself reads whatever
lies in its folder, and looks only at the source file of a kernel: after a change it would still use stale copies of the
kernels that this one calls. Here a file belongs to all sources with kernels or with the tuples that they take.
"""

import functools
import hashlib
import multiprocessing
import os
import pickle
import stat
import sys
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba import config
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, UserProvidedCacheLocator

_SUM = hashlib.sha256().digest_size


def enable_caching(function: Callable) -> Callable:
    """Return a compiled function that looks for its code on disk, and keeps it there, where that is possible."""
    directory, before = config.CACHE_DIR or cache_directory(), config.CACHE_DIR
    if directory and not config.DISABLE_JIT:
        config.CACHE_DIR = directory
        with suppress(RuntimeError):  # Numba cannot write there
            function._cache = _KernelCache(function.py_func)  # type: ignore[attr-defined]
        config.CACHE_DIR = before
    return function


@functools.cache
def cache_directory() -> str | None:
    """Return the folder of kernels compiled from exactly these sources, or `None` where they cannot be kept.

    It lies beside them or, where a user may not write there, in the user's own cache folder. If that is not safe
    either, one sentence on standard error says why.
    """
    name = f"kernels-{_sources()[:16]}"
    beside = Path(__file__).parents[1] / "__pycache__" / name
    with suppress(OSError):
        beside.mkdir(parents=True, exist_ok=True)
        if os.access(beside, os.W_OK):
            return str(beside)
    try:
        return str(_private_folder(name))
    except (OSError, RuntimeError) as error:  # of a home that is unknown or a link that leads to itself
        if multiprocessing.parent_process() is None:
            print(f"bem: the solver is compiled at every start: {error}", file=sys.stderr)
        return None


@functools.cache
def _sources() -> str:
    """SHA-256 sum of all sources that compiled code depends on."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parents[1].rglob("*.py")):
        text = source.read_bytes()
        if any(word in text for word in (b"@kernel", b"NamedTuple", b"@dataclass", b"from numba")):
            digest.update(text)
    return digest.hexdigest()


def _private_folder(name: str) -> Path:
    """Return a folder in the user's cache folder, which is made if it is missing.

    Raises:
        OSError: it cannot be made, or another user than root could write there or put another folder in its place.
    """
    caches = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache").resolve()
    folder = caches / "contact-trajectories" / name
    above_home = Path(os.environ.get("HOME") or "/").resolve().parents  # the administrator's choice
    for path in (*reversed(folder.parents), folder):
        path.mkdir(mode=0o700, exist_ok=True)
        if path in above_home or not hasattr(os, "geteuid"):  # as on Windows
            continue
        status = path.lstat()
        # Where this bit is set, as in /tmp, nobody can replace what belongs to another user.
        sticky = status.st_mode & stat.S_ISVTX and path != folder
        if status.st_uid not in (0, os.geteuid()) or (status.st_mode & 0o022 and not sticky):
            raise PermissionError(
                f"only you may write to the cache folder; received {path} of user {status.st_uid} with mode "
                f"{stat.S_IMODE(status.st_mode):o} (XDG_CACHE_HOME names another folder)"
            )
    return folder


class _KernelFiles(IndexDataCacheFile):
    """The files of one kernel, one for each signature and processor: a SHA-256 sum and a pickle.

    The sum is of the pickle and of all that identifies it: a file that is cut, altered or stale is not unpickled. Two
    processes that write at once write the same, which Numba's own index does not ensure.
    """

    def load(self, key: tuple) -> Any:
        """Return what `save` kept, or `None`."""
        try:
            stored = Path(self._path(key)).read_bytes()
        except OSError:
            return None
        total, data = stored[:_SUM], stored[_SUM:]
        return pickle.loads(data) if total == self._sum(key, data) else None

    def save(self, key: tuple, data: Any) -> None:
        """Keep compiled code; on a full disk nothing is kept, and the next start compiles again."""
        pickled = self._dump(data)
        with suppress(OSError), self._open_for_write(self._path(key)) as file:
            file.write(self._sum(key, pickled) + pickled)

    def _path(self, key: tuple) -> str:
        return self._data_path(self._data_name(zlib.crc32(repr(key).encode())))

    def _sum(self, key: tuple, data: bytes) -> bytes:
        identity = repr((key, self._source_stamp, self._version, _sources()))
        return hashlib.sha256(identity.encode() + data).digest()


class _KernelLocation(CompileResultCacheImpl):
    _locator_classes = (UserProvidedCacheLocator,)  # that is `config.CACHE_DIR`; Numba would look in other places too


class _KernelCache(FunctionCache):
    _impl_class = _KernelLocation

    def __init__(self, py_func: Callable) -> None:
        super().__init__(py_func)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _KernelFiles(self.cache_path, self._impl.filename_base, stamp)

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(OSError):  # the folder is gone
            super().save_overload(sig, data)

    def _index_key(self, sig: Any, codegen: Any) -> tuple:
        """All that identifies compiled code of these sources; the byte code is another one under `python -OO`."""
        signature, processor, (_, closure) = super()._index_key(sig, codegen)
        return signature, processor, closure
