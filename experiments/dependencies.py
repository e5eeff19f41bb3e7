"""The files on which a result depends, for make: the modules that were imported and the files that were read.

The rule is written as `gcc -MD -MP` does it for a compiled file. It names the files that the run used, so that no list
is kept by hand. Each named file also has a rule without commands: if the file is removed, make runs the target again
instead of failing. Only files under the working directory or under one of the given folders are named; those of the
Python environment are not.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

CODE = {".py", ".pyc", ".nbi", ".nbc", ".so"}
"""Suffixes of files that Python reads to import a module or to load a compiled kernel; `Recorder` lists the modules."""
SUMS = "MANIFEST.json"
"""The manifest; it changes whenever any file is published, and is therefore not a dependency."""


def beside(target: Path) -> Path:
    """Path of the file that holds the rule of a target."""
    return target.parent / ".depends" / f"{target.stem}.d"


class Recorder:
    """Records each file and folder that is read from now on. One per process: an audit hook cannot be removed."""

    def __init__(self) -> None:
        self.started = time.time()
        self.read: set[str] = set()
        self.written: set[str] = set()
        sys.addaudithook(self._hear)

    def add(self, *paths: Path) -> None:
        """Add files that a library reads without Python's `open`, such as HDF5."""
        self.read.update(os.fspath(path) for path in paths if path.exists())

    def write(self, target: Path, *roots: Path) -> None:
        """Write the rule of a target. The file gets the start time of the run, so that the target is newer.

        Args:
            target: The file that was made.
            roots: Folders whose files are recorded, besides the working directory.
        """
        places = [Path.cwd(), *map(_absolute, roots)]
        modules = {getattr(module, "__file__", None) for module in list(sys.modules.values())} - {None}
        used = {_absolute(path) for path in (self.read - self.written) | modules}
        # Writing a file atomically also opens its folder; a file that the run wrote itself is not an input.
        used -= {_absolute(target), *(_absolute(path).parent for path in (target, *self.written))}
        names = sorted({shown for path in used if (shown := _shown(path, places))})
        rule = " \\\n ".join([f"{target}:", *names])
        place = beside(target)
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text("\n".join([rule, *(f"{name}:" for name in names)]) + "\n", encoding="utf-8")
        os.utime(place, (self.started, self.started))

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event not in ("open", "os.scandir", "os.listdir") or not isinstance(arguments[0], str | bytes | os.PathLike):
            return
        path = os.fsdecode(arguments[0])
        if Path(path).suffix in CODE:
            return
        if event == "open" and arguments[2] & (os.O_WRONLY | os.O_RDWR):
            self.written.add(path)
        else:
            self.read.add(path)


def _absolute(path: str | Path) -> Path:
    """An absolute path; symbolic links are kept, since make compares names."""
    return Path(os.path.normpath(Path.cwd() / path))


def _shown(whole: Path, places: list[Path]) -> str | None:
    """A path as make writes it, relative if below the working directory; `None` if it is not recorded."""
    if not any(whole.is_relative_to(root) for root in places) or not whole.exists():
        return None
    if whole.is_relative_to(Path(sys.prefix)) or whole.is_relative_to(Path(sys.base_prefix)):
        return None
    inner = whole.relative_to(places[0]) if whole.is_relative_to(places[0]) else whole
    if whole.name == SUMS or any(
        part in ("__pycache__", "site-packages") or part.startswith(".") for part in inner.parts
    ):
        return None
    # Python lists the folder of a package whenever it looks for a module in it.
    if not inner.parts or (whole.is_dir() and any(whole.glob("*.py"))):
        return None
    return str(inner).replace(" ", "\\ ")
