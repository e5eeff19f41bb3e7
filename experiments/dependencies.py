"""The files on which a result depends, for make: the modules that were imported and the files that were read.

It works as `gcc -MD -MP` does for a compiled file. The rule names what was used, so that nothing is listed by hand. A
rule without commands for each of these makes a removed file cause a new run instead of an error. Only modules and files
under the working directory or one of the given folders are named, without those of the environment.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

CODE = {".py", ".pyc", ".nbi", ".nbc", ".so"}
"""Files that are read whenever a module is imported or a compiled kernel is loaded; the modules themselves count."""
SUMS = "MANIFEST.json"
"""The list of published sums, which changes with whatever else is published."""


def beside(target: Path) -> Path:
    """The file that holds the rule of a target."""
    return target.parent / ".depends" / f"{target.stem}.d"


class Recorder:
    """Hears of every file and folder that is read from now on; one for each process, as Python offers no way back."""

    def __init__(self) -> None:
        self.started = time.time()
        self.read: set[str] = set()
        self.written: set[str] = set()
        sys.addaudithook(self._hear)

    def add(self, *paths: Path) -> None:
        """Count files that libraries read past Python, such as HDF5."""
        self.read.update(os.fspath(path) for path in paths if path.exists())

    def write(self, target: Path, *roots: Path) -> None:
        """Write the rule of a target; it is as old as the run, so that the target is newer.

        Args:
            target: What was made.
            roots: Folders in which files count, besides the one the program runs in.
        """
        places = [Path.cwd(), *map(_absolute, roots)]
        modules = {getattr(module, "__file__", None) for module in list(sys.modules.values())} - {None}
        used = {_absolute(path) for path in (self.read - self.written) | modules}
        # Whole files are written by opening their folder too; what the run changed itself is no input.
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
    """A path from the root on, links kept, since make compares names."""
    return Path(os.path.normpath(Path.cwd() / path))


def _shown(whole: Path, places: list[Path]) -> str | None:
    """A path as make knows it: relative below the working folder; `None` where it does not count."""
    if not any(whole.is_relative_to(root) for root in places) or not whole.exists():
        return None
    if whole.is_relative_to(Path(sys.prefix)) or whole.is_relative_to(Path(sys.base_prefix)):
        return None
    inner = whole.relative_to(places[0]) if whole.is_relative_to(places[0]) else whole
    if whole.name == SUMS or any(
        part in ("__pycache__", "site-packages") or part.startswith(".") for part in inner.parts
    ):
        return None
    # A package's folder is listed whenever a module is looked for in it.
    if not inner.parts or (whole.is_dir() and any(whole.glob("*.py"))):
        return None
    return str(inner).replace(" ", "\\ ")
