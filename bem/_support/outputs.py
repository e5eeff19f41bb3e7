"""Output files of a command: reserved before the work, and after it all complete or all unchanged.

A place that cannot be written is refused before anything is computed, and every error names the path the user gave. A
name that becomes the name of a file or a folder must be plain, so that it cannot lead to another folder.
"""

from __future__ import annotations

import os
import re
import secrets
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any

from bem._support.interruption import interrupted_afterwards
from bem._support.wording import shown

IMAGES, FILMS = (".png", ".pdf", ".svg"), (".gif", ".mp4")
LONGEST_NAME = 64
_PLAIN_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")


class Outputs:
    """Output files of one command, as a context around its work.

    On entering, each file's part is created beside it; `write` gives the part to write to; on leaving without an
    error, all parts that were written take their places. Otherwise what was there before stays.

    Args:
        paths: The files, `None` for those not wanted. A device or a pipe is written directly.

    Raises:
        ValueError: a path twice, '-', a directory, or a place that cannot be written.
    """

    def __init__(self, *paths: Path | None) -> None:
        self.paths = [Path(path) for path in paths if path is not None]
        if Path("-") in self.paths:
            raise ValueError("the output file must have a name, since standard output is for the summary; received -")
        if len(set(map(Path.absolute, self.paths))) < len(self.paths):
            raise ValueError(f"the output files must be different; received {', '.join(map(str, self.paths))}")
        self._parts: dict[Path, tuple[Path, Path]] = {}  # target and part of each
        self._written: set[Path] = set()

    def __enter__(self) -> Outputs:
        try:
            for path in self.paths:
                self._reserve(path)
        except BaseException:
            self._discard()
            raise
        return self

    def __exit__(self, error: type[BaseException] | None, _: BaseException | None, __: TracebackType | None) -> None:
        try:
            if error is None:
                with interrupted_afterwards():
                    self._settle()
        finally:
            self._discard()

    @contextmanager
    def write(self, path: Path) -> Iterator[Path]:
        """Give the path to write to in place of `path`; its suffix is the same.

        Raises:
            ValueError: the operating system refused, as a full disk does.
        """
        path = Path(path)
        with _refusals(path):
            yield self._parts[path][1] if path in self._parts else path
        self._written.add(path)

    @property
    def sentence(self) -> str:
        """Which files were written, for the user; empty where none was."""
        names = [str(path) for path in self._parts if path in self._written]
        return f"Written: {', '.join(names)}" if names else ""

    def _reserve(self, path: Path) -> None:
        with _refusals(path):
            if path.is_dir() or not path.absolute().parent.is_dir():
                itself = ", which is a directory itself" if path.is_dir() else ""
                raise ValueError(f"the output file must lie in a directory that exists; received {path}{itself}")
            if path.exists() and not path.is_file():
                return
            # A link stays one; its target is replaced. A link that leads to itself is refused by the system.
            target = Path(os.path.realpath(path))
            if target.is_symlink():
                target.stat()
            # Short, so that only the name the user chose can be too long.
            temporary = target.with_name(f".{secrets.token_hex(4)}.part{target.suffix}")
            with suppress(FileNotFoundError):
                target.lstat()  # the error of the operating system for a name that it does not accept
            self._parts[path] = target, temporary
            temporary.touch(exist_ok=False)

    def _settle(self) -> None:
        formers: list[Path] = []
        with ExitStack() as undone:
            for path in filter(self._written.__contains__, self._parts):
                target, temporary = self._parts[path]
                with _refusals(path):
                    # Renamed, so that it can come back; a single file is replaced at once.
                    if replaces := len(self._written) > 1 and target.exists():
                        formers.append(target.replace(temporary.with_name(f"{temporary.name}.former")))
                        undone.callback(formers[-1].replace, target)
                    temporary.replace(target)
                    if not replaces:
                        undone.callback(target.unlink)
            undone.pop_all()
        for former in formers:
            former.unlink(missing_ok=True)

    def _discard(self) -> None:
        for _, temporary in self._parts.values():
            temporary.unlink(missing_ok=True)


def default_picture(name: str, *requested: Any) -> Path | None:
    """A new file in this folder for the picture of a command that was asked for no output, if a terminal shows it.

    Args:
        name: Its name without suffix; where a file has that name, a number is added.
        requested: The outputs that the user asked for.
    """
    if any(requested) or not sys.stdout.isatty() or not os.access(".", os.W_OK):
        return None
    names = (f"{name}{'' if number == 1 else f'-{number}'}.png" for number in count(1))
    return next(Path(file) for file in names if not os.path.lexists(file))


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Give a path to write to beside `path`; what is there afterwards takes its place, unless something failed.

    Raises:
        ValueError: `path` is a directory, lies in none, or cannot be written.
    """
    path = Path(path)
    with Outputs(path) as outputs, outputs.write(path) as temporary:
        yield temporary


def write_whole(path: Path, data: str | bytes | memoryview, scratch: Path | None = None) -> None:
    """Write a file beside its place and rename it, so that even a power cut leaves the former one or the new one.

    Text is written in UTF-8, first to `scratch` on the same file system, by default to a new name beside `path`.

    Raises:
        OSError: nothing was written, and what was at `path` is untouched.
    """
    unfinished = scratch or path.with_name(f".{secrets.token_hex(6)}.writing")
    try:
        with unfinished.open("wb") as file:
            file.write(data.encode() if isinstance(data, str) else data)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    # The new name is on the disk once its folder is; not every system opens folders.
    with suppress(OSError):
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def require_output(path: str | Path) -> None:
    """Refuse a place that cannot be written before hours are spent on what should go there.

    Raises:
        ValueError: `path` is a directory, lies in none, or cannot be written.
    """
    with Outputs(Path(path)):
        pass


def require_suffix(path: str | Path | None, suffixes: tuple[str, ...]) -> None:
    """Refuse an output file whose name does not say a format that is known; `None` is no file.

    Raises:
        ValueError: another suffix than those.
    """
    if path is not None and Path(path).suffix not in suffixes:
        raise ValueError(f"the output file must be called {' or '.join(suffixes)}; received {path}")


def plain_name(name: str, noun: str) -> str:
    """Return a name that becomes a file's or a folder's, when it is one: not a path, a hidden file or an option.

    The message calls it `noun`, with an article.

    Raises:
        ValueError: it is empty, longer than 64 characters, or has others than letters, digits, '.', '_' and '-'; or
            begins with '.' or '-'.
    """
    if not isinstance(name, str) or len(name) > LONGEST_NAME or not _PLAIN_NAME.fullmatch(name):
        raise ValueError(
            f"Expected {noun} of at most {LONGEST_NAME} letters, digits, '.', '_' and '-', not beginning with '.' or "
            f"'-'; received {shown(name)}"
        )
    return name


@contextmanager
def _refusals(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ValueError(
            f"the output file must be a place that can be written; received {path} ({error.strerror or error})"
        ) from error
