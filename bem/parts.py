"""What a running campaign has done so far: parts beside the file it will become, so that nothing done is lost.

`FILE.h5.parts/` holds `campaign.json` (what is being computed), a lock, and one HDF5 file for every few seconds of
work, named by the digest of its contents: a part that was cut short or altered does not match its name and is
computed again.
"""

import fcntl
import hashlib
import json
import os
import shutil
import time
from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TextIO

import h5py

from bem.dataset_file import TEMPORARY, move_into_place, read_tree, write_tree
from bem.records import Record, Settings, tabulate, untabulate

SECONDS_BETWEEN_PARTS = 2.0


class CampaignError(RuntimeError):
    """A campaign could not go on; what it has saved is kept, and the same command continues."""


def differences(wanted: Mapping[str, Any], found: Mapping[str, Any]) -> str:
    """In words, where two descriptions of a campaign differ; empty when they do not."""
    names = [name for name in {**wanted, **found} if wanted.get(name) != found.get(name)]
    if names == ["solver"]:
        return "it was made by another version of the solver"
    return ", ".join(f"{name} {found.get(name)!r} there and {wanted.get(name)!r} here" for name in names)


class PartStore:
    """The parts of one campaign, locked while in use.

    Args:
        out: the data set file to come.
        identity: what is computed; parts of anything else are refused.
        settings: how it is computed.
        replace: discard the parts of another campaign instead of refusing.

    Raises:
        ValueError: parts of another campaign are there.
        CampaignError: another process is at it, or the place cannot be written.
    """

    def __init__(self, out: Path, identity: Mapping[str, Any], settings: Settings, *, replace: bool = False) -> None:
        self.out = out
        self.folder = out.with_name(out.name + ".parts")
        self.identity = json.loads(json.dumps(identity))
        self.settings = settings
        self.replace = replace
        self.damaged = 0
        self._buffer: list[Record] = []
        self._seconds = {"wall_seconds": 0.0, "core_seconds": 0.0}
        self._pending_core = 0.0
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
            if not isinstance(error, CampaignError):
                self.flush()
        finally:
            self._release()

    def _acquire(self) -> None:
        while True:
            self.folder.mkdir(parents=True, exist_ok=True)
            path = self.folder / "lock"
            self._lock = path.open("w", encoding="utf-8")
            try:
                fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                self._release()
                raise CampaignError(f"another campaign is writing {str(self.out)!r}; wait for it or end it") from None
            # The folder may have been removed by the campaign that just finished.
            if path.exists() and os.fstat(self._lock.fileno()).st_ino == path.stat().st_ino:
                return
            self._release()

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.close()
            self._lock = None

    def _claim(self) -> None:
        path = self.folder / "campaign.json"
        found = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None
        if found is not None and found != self.identity:
            if not self.replace:
                raise ValueError(
                    f"out must name a new file or the same campaign; received {str(self.out)!r}, where another one is "
                    f"under way: {differences(self.identity, found)}"
                )
            for part in self.folder.glob("part-*.h5"):
                part.unlink()
            found = None
        if found is None:
            temporary = path.with_name(path.name + TEMPORARY)
            temporary.write_text(json.dumps(self.identity, indent=1) + "\n", encoding="utf-8")
            move_into_place(temporary, path)

    def load(self) -> dict[int, Record]:
        """All records of undamaged parts by index; damaged parts are removed and counted in `damaged`."""
        records: dict[int, Record] = {}
        for path in sorted(self.folder.glob("part-*.h5")):
            content = path.read_bytes()
            if path.stem != _name(content):
                path.unlink()
                self.damaged += 1
                continue
            with h5py.File(BytesIO(content), "r") as file:
                records |= {record.index: record for record in untabulate(read_tree(file))}
                for name in self._seconds:
                    self._seconds[name] += float(file.attrs[name])
        for stray in self.folder.glob(f"*{TEMPORARY}"):
            stray.unlink()
        return records

    @property
    def seconds(self) -> dict[str, float]:
        """Wall and core seconds of all work saved so far."""
        return dict(self._seconds)

    def add(self, records: Iterable[Record], core_seconds: float) -> None:
        """Take results; they are on the disk a few seconds later at most, or after `flush`."""
        self._buffer.extend(records)
        self._pending_core += core_seconds
        if time.perf_counter() - self._last_part > SECONDS_BETWEEN_PARTS:
            self.flush()

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
        write_tree(memory, tabulate(self._buffer, self.settings), seconds)
        content = memory.getvalue()
        path = self.folder / f"{_name(content)}.h5"
        temporary = path.with_name(path.name + TEMPORARY)
        try:
            temporary.write_bytes(content)
            move_into_place(temporary, path)
        except OSError as error:
            temporary.unlink(missing_ok=True)
            raise CampaignError(
                f"cannot write {str(path)!r} ({error.strerror or error}); what was saved before is kept, and the same "
                "command continues"
            ) from error
        self._buffer.clear()
        self._pending_core = 0.0
        self._clock = self._last_part = now
        for name, value in seconds.items():
            self._seconds[name] += value

    def remove(self) -> None:
        """Remove all parts, once the data set is in place."""
        shutil.rmtree(self.folder, ignore_errors=True)


def _name(content: bytes) -> str:
    return f"part-{hashlib.sha256(content).hexdigest()[:24]}"
