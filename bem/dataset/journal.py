"""The finished batches of a running campaign, in a journal beside the future data set: an interruption loses none.

`FILE.h5.DIGEST.parts`, named by the digest of what the campaign computes, is a list of entries: a description of the
campaign, then the batches. An entry is the digest of journal and content, the content and a mark. What follows the last
mark was cut short when its process was killed. An entry that does not match its digest was damaged, and its
trajectories are computed again.
"""

import fcntl
import glob
import hashlib
import json
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any, Self

import numpy as np

from bem._support.wording import shown
from bem.dataset.executors import CampaignError
from bem.dataset.records import Columns

MARK = bytes.fromhex("a7f3c2915be8460d9c1e72d4b03f58a6")
_DIGEST = 32  # bytes


def differences(expected: Mapping[str, Any], stored: Mapping[str, Any]) -> str:
    """Say where two descriptions of a campaign differ; empty when they do not."""
    names = [name for name in {**expected, **stored} if expected.get(name) != stored.get(name)]
    if names == ["solver"]:
        return "it was made by another version of the solver"
    return ", ".join(f"{name} {shown(stored.get(name))} there and {shown(expected.get(name))} here" for name in names)


def _digest(path: Path, payload: bytes) -> bytes:
    return hashlib.sha256(path.suffixes[-2].encode() + payload).digest()


def _entries(path: Path, journal: bytes) -> Iterator[bytes | None]:
    """The contents of the entries of a `journal`, `None` for those that are damaged."""
    for entry in journal.split(MARK)[:-1]:
        payload = entry[_DIGEST:]
        yield payload if entry[:_DIGEST] == _digest(path, payload) else None


class Journal:
    """The batches of one campaign, locked while in use.

    Args:
        out: the future data set file.
        identity: what is computed.
        replace: start although batches of another campaign are there; they are removed once this one is complete.

    Raises:
        ValueError: batches of another campaign are there.
        CampaignError: another process is writing there, or the place cannot be written.
    """

    def __init__(self, out: Path, identity: Mapping[str, Any], *, replace: bool = False) -> None:
        self.out, self.identity, self.replace = out, identity, replace
        digest = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
        self.path = out.with_name(f"{out.name}.{digest[:16]}.parts")
        self.batches: list[Columns] = []
        """What earlier calls saved."""
        self.costs: list[Mapping[str, Any]] = []
        """Seconds, versions and hosts of all batches."""
        self.damaged = 0

    def __enter__(self) -> Self:
        foreign = self._others()
        if foreign and not self.path.exists() and not self.replace:
            theirs = next(_entries(foreign[0], foreign[0].read_bytes()), None)
            why = differences(self.identity, json.loads(theirs)) if theirs else f"{str(foreign[0])!r} is damaged"
            raise ValueError(
                f"out must name a new file or the same campaign; received {str(self.out)!r}, where another one is "
                f"under way and may be replaced with --replace: {why}"
            )
        try:
            self._lock()
            self._read()
        except OSError as error:
            raise CampaignError(f"cannot write beside {str(self.out)!r} ({error.strerror or error})") from error
        self._clock = time.perf_counter()
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def _others(self) -> list[Path]:
        candidates = self.out.parent.glob(f"{glob.escape(self.out.name)}.{16 * '[0-9a-f]'}.parts")
        return sorted(path for path in candidates if path != self.path)

    def _lock(self) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        opened = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, 0o666)
        self._file = os.fdopen(opened, "r+b", buffering=0)
        with suppress(BlockingIOError):
            fcntl.flock(opened, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if os.fstat(opened).st_nlink:  # else a campaign that just ended has removed it
                return
        self._file.close()
        raise CampaignError(f"another campaign is writing {str(self.out)!r}; wait for it or end it")

    def _read(self) -> None:
        journal = self._file.readall()
        self._file.truncate(journal.rfind(MARK) + len(MARK) if MARK in journal else 0)
        for number, entry in enumerate(_entries(self.path, journal)):
            if entry is None:
                self.damaged += 1
            elif number:
                with np.load(BytesIO(entry)) as file:
                    columns = dict(file)
                self.costs.append(json.loads(str(columns.pop("cost"))))
                self.batches.append(columns)
        if MARK not in journal:
            self._append(json.dumps(self.identity).encode())

    def _append(self, payload: bytes) -> None:
        remaining = _digest(self.path, payload) + payload + MARK
        while remaining:
            remaining = remaining[self._file.write(remaining) :]
        os.fsync(self._file.fileno())

    def add(self, columns: Columns, core_seconds: float, origin: dict[str, Any]) -> None:
        """Save a batch, the seconds that its worker took, and the versions and host of that worker.

        Raises:
            CampaignError: it could not be written.
        """
        now = time.perf_counter()
        self.costs.append({"wall_seconds": now - self._clock, "core_seconds": core_seconds, **origin})
        memory = BytesIO()
        text = {name: values.astype("U") for name, values in columns.items() if values.dtype == object}
        np.savez(memory, cost=np.array(json.dumps(self.costs[-1])), **(columns | text))
        why, kept = "", "what was saved before is kept, and the same command continues"
        try:
            self._append(memory.getvalue())
        except OSError as error:
            why = error.strerror or str(error)
        if not os.fstat(self._file.fileno()).st_nlink:
            why, kept = "it is gone", "somebody removed what was saved, and the same command begins again"
        if why:
            raise CampaignError(f"cannot write {str(self.path)!r} ({why}); {kept}")
        self._clock = now

    def remove(self) -> None:
        """Remove the batches once the data set is complete, and those of the campaigns it replaces."""
        for path in (self.path, *(self._others() if self.replace else ())):
            with suppress(OSError):
                path.unlink()
