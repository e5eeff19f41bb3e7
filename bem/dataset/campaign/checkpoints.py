"""What a running campaign has done so far: parts beside the file it will become, so that nothing done is lost.

`FILE.h5.parts/` holds a lock and, for each campaign under way there, a folder named by the digest of what it computes:
`campaign.json` (in words) and one HDF5 file for every few seconds of work, named by the digest of its contents: a part
that was cut short or altered does not match its name and is computed again. Files of any other name are nobody's
business here: they are neither removed nor written over.
"""

import fcntl
import hashlib
import json
import os
import re
import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TextIO

import h5py

from bem._support.outputs import UNFINISHED, write_whole
from bem._support.wording import shown
from bem.dataset.file import read_tree, write_tree
from bem.dataset.records import FAILED, Record, Settings, tabulate, untabulate

SECONDS_BETWEEN_PARTS = 2.0
_FOLDER = re.compile(r"campaign-[0-9a-f]{16}")
_OWN = re.compile(rf"campaign\.json|part-[0-9a-f]{{24}}\.h5|\.[0-9a-f]+{re.escape(UNFINISHED)}")


class CampaignError(RuntimeError):
    """A campaign could not go on; what it has saved is kept, and the same command continues."""


def differences(wanted: Mapping[str, Any], found: Mapping[str, Any]) -> str:
    """In words, where two descriptions of a campaign differ; empty when they do not."""
    names = [name for name in {**wanted, **found} if wanted.get(name) != found.get(name)]
    if names == ["solver"]:
        return "it was made by another version of the solver"
    return ", ".join(f"{name} {shown(found.get(name))} there and {shown(wanted.get(name))} here" for name in names)


class PartStore:
    """The parts of one campaign, locked while in use.

    Args:
        out: the data set file to come.
        identity: what is computed.
        settings: how it is computed.
        replace: begin beside the parts of another campaign, which go once this one is complete, instead of refusing.

    Raises:
        ValueError: parts of another campaign are there, or files that no campaign wrote.
        CampaignError: another process is at it, or the place cannot be written.
    """

    def __init__(self, out: Path, identity: Mapping[str, Any], settings: Settings, *, replace: bool = False) -> None:
        self.out = out
        self.place = out.with_name(out.name + ".parts")
        self.identity = json.loads(json.dumps(identity))
        digest = hashlib.sha256(json.dumps(self.identity, sort_keys=True).encode()).hexdigest()
        self.folder = self.place / f"campaign-{digest[:16]}"
        self.settings = settings
        self.replace = replace
        self.damaged = 0
        self.origins: list[dict[str, Any]] = []
        self._buffer: list[Record] = []
        self._seconds = {"wall_seconds": 0.0, "core_seconds": 0.0}
        self._pending_core = 0.0
        self._unwritable = False
        self._lock: TextIO | None = None

    def __enter__(self) -> Self:
        try:
            self._acquire()
            try:
                self._claim()
            except BaseException:
                self._release()
                raise
        except OSError as error:
            raise CampaignError(f"cannot write beside {str(self.out)!r} ({error.strerror or error})") from error
        self._clock = self._last_part = time.perf_counter()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if not self._unwritable:
                self.flush()
        finally:
            self._release()

    def discard(self) -> None:
        """Remove parts that outlived the data set made of them, unless somebody is at them."""
        if not self.folder.is_dir():
            return
        with suppress(CampaignError, OSError):
            self._acquire()
            try:
                self.remove()
            finally:
                self._release()

    def _acquire(self) -> None:
        while True:
            self.place.mkdir(parents=True, exist_ok=True)
            path = self.place / "lock"
            try:
                self._refuse_strangers()
                self._lock = path.open("a", encoding="utf-8")
            except FileNotFoundError:  # the campaign that just finished removed the folder
                continue
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                self._release()
                raise CampaignError(f"another campaign is writing {str(self.out)!r}; wait for it or end it") from None
            if path.exists() and os.fstat(self._lock.fileno()).st_ino == path.stat().st_ino:
                return
            self._release()

    def _refuse_strangers(self) -> None:
        for path in sorted(self.place.iterdir()):
            ours = path.stat().st_size == 0 if path.name == "lock" else _FOLDER.fullmatch(path.name) and path.is_dir()
            # A file server keeps a removed file that is still open under such a name.
            if not ours and not path.name.startswith(".nfs"):
                raise ValueError(
                    f"out must leave the folder {self.place.name!r} beside it to the campaign; received "
                    f"{str(self.out)!r}, where that folder holds {path.name!r}, which no campaign wrote"
                )

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def _claim(self) -> None:
        others = [folder for folder in self._folders() if folder != self.folder]
        if others and not self.folder.is_dir() and not self.replace:
            raise ValueError(
                f"out must name a new file or the same campaign; received {str(self.out)!r}, where another one is "
                f"under way and may be replaced with --replace: {self._described(others[0])}"
            )
        self.folder.mkdir(exist_ok=True)
        path = self.folder / "campaign.json"
        # The folder's name says whose it is, so that a damaged description can be written again.
        if _read_json(path) != self.identity:
            write_whole(path, (json.dumps(self.identity, indent=1) + "\n").encode())

    def _folders(self) -> list[Path]:
        return [path for path in sorted(self.place.iterdir()) if _FOLDER.fullmatch(path.name)]

    def _described(self, folder: Path) -> str:
        found = _read_json(folder / "campaign.json")
        if not isinstance(found, dict):
            return f"its description {str(folder / 'campaign.json')!r} is missing or damaged"
        return differences(self.identity, found)

    def load(self) -> dict[int, Record]:
        """All records of undamaged parts by index, completed ones before failed ones; counts damaged parts."""
        records: dict[int, Record] = {}
        for path in sorted(self.folder.glob("part-*.h5")):
            content = path.read_bytes()
            if path.stem != _name(content):
                path.unlink()
                self.damaged += 1
                continue
            with h5py.File(BytesIO(content), "r") as file:
                for record in untabulate(read_tree(file)):
                    if record.index not in records or records[record.index].status == FAILED:
                        records[record.index] = record
                for name in self._seconds:
                    self._seconds[name] += float(file.attrs[name])
                self._note(json.loads(file.attrs["origins"])["all"])
        for stray in self.folder.glob(f".*{UNFINISHED}"):
            stray.unlink()
        return records

    @property
    def seconds(self) -> dict[str, float]:
        """Wall and core seconds of all work saved so far."""
        return dict(self._seconds)

    def add(self, records: Iterable[Record], core_seconds: float, origin: dict[str, Any] | None = None) -> None:
        """Take results and where they come from; they are on the disk seconds later at most, or after `flush`."""
        self._buffer.extend(records)
        self._pending_core += core_seconds
        self._note([origin] if origin else [])
        if time.perf_counter() - self._last_part > SECONDS_BETWEEN_PARTS:
            self.flush()

    def _note(self, origins: Iterable[dict[str, Any]]) -> None:
        self.origins += [origin for origin in origins if origin not in self.origins]

    def flush(self) -> None:
        """Write what is held in memory as a part.

        Raises:
            CampaignError: the part could not be written.
        """
        if not self._buffer:
            return
        now = time.perf_counter()
        seconds = {"wall_seconds": now - self._clock, "core_seconds": self._pending_core}
        memory = BytesIO()
        write_tree(memory, tabulate(self._buffer, self.settings), {**seconds, "origins": {"all": self.origins}})
        content = memory.getvalue()
        path = self.folder / f"{_name(content)}.h5"
        try:
            write_whole(path, content)
        except OSError as error:
            self._unwritable = True
            raise CampaignError(
                f"cannot write {str(path)!r} ({error.strerror or error}); what was saved before is kept, and the same "
                "command continues"
            ) from error
        self._buffer.clear()
        self._pending_core = 0.0
        self._clock = self._last_part = now
        for name, value in seconds.items():
            self._seconds[name] += value

    def remove(self, *, others: bool = False) -> None:
        """Remove the parts, once the data set is in place, and those of other campaigns where it replaces theirs."""
        with suppress(OSError):
            for folder in self._folders():
                if others or folder == self.folder:
                    _remove_own(folder)
            if [path.name for path in self.place.iterdir()] == ["lock"]:
                (self.place / "lock").unlink()
                self.place.rmdir()


def _remove_own(folder: Path) -> None:
    for path in folder.iterdir():
        if _OWN.fullmatch(path.name):
            path.unlink()
    with suppress(OSError):
        folder.rmdir()


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def _name(content: bytes) -> str:
    return f"part-{hashlib.sha256(content).hexdigest()[:24]}"
