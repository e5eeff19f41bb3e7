"""The finished batches of a running campaign, one file each beside the future data set: an interruption loses none.

`FILE.h5.parts/` holds a lock and, for each campaign that is under way there, a folder named by the digest of what it
computes. The folder holds `campaign.json`, a description, and the batches, named by the digest of campaign and
contents. A batch that was cut short, altered or copied from another campaign does not match its name and is computed
again. Files of any other name are neither removed nor overwritten.
"""

import hashlib
import json
import re
import time
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from io import BytesIO
from pathlib import Path
from typing import Any, Self

import numpy as np
from filelock import FileLock, Timeout

from bem._support.outputs import UNFINISHED, write_whole
from bem._support.wording import shown
from bem.dataset.executors import CampaignError
from bem.dataset.records import Columns

_FOLDERS = f"campaign-{16 * '[0-9a-f]'}"
_OWN = re.compile(rf"campaign\.json|part-[0-9a-f]{{24}}\.npz|\.[0-9a-f]+{re.escape(UNFINISHED)}")


def differences(wanted: Mapping[str, Any], found: Mapping[str, Any]) -> str:
    """Say where two descriptions of a campaign differ; empty when they do not."""
    names = [name for name in {**wanted, **found} if wanted.get(name) != found.get(name)]
    if names == ["solver"]:
        return "it was made by another version of the solver"
    return ", ".join(f"{name} {shown(found.get(name))} there and {shown(wanted.get(name))} here" for name in names)


class CampaignCheckpoint:
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
        self.out = out
        self.place = out.with_name(out.name + ".parts")
        self.identity = json.loads(json.dumps(identity))
        digest = hashlib.sha256(json.dumps(self.identity, sort_keys=True).encode()).hexdigest()
        self.folder = self.place / f"campaign-{digest[:16]}"
        self.replace = replace
        self.damaged = 0
        self.seconds = {"wall_seconds": 0.0, "core_seconds": 0.0}
        self.origins: list[dict[str, Any]] = []
        self._lock = FileLock(self.place / "lock", timeout=0)

    def __enter__(self) -> Self:
        try:
            with ExitStack() as stack:
                self._acquire()
                stack.callback(self._lock.release)
                self._claim()
                stack.pop_all()
        except OSError as error:
            raise CampaignError(f"cannot write beside {str(self.out)!r} ({error.strerror or error})") from error
        self._clock = time.perf_counter()
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.release()
        with suppress(OSError):  # where anything is left, the folder stays
            self.place.rmdir()

    def discard(self) -> None:
        """Remove batches that remain although their data set is complete, unless another process is using them."""
        if self.folder.is_dir():
            with suppress(CampaignError), self:
                self.remove()

    def _acquire(self) -> None:
        while True:
            self.place.mkdir(parents=True, exist_ok=True)
            # A campaign that just finished may remove folder and lock in between.
            with suppress(FileNotFoundError):
                try:
                    self._lock.acquire()
                    return
                except Timeout:
                    if (self.place / "lock").exists():
                        busy = f"another campaign is writing {str(self.out)!r}; wait for it or end it"
                        raise CampaignError(busy) from None

    def _claim(self) -> None:
        others = [folder for folder in sorted(self.place.glob(_FOLDERS)) if folder != self.folder]
        if others and not self.folder.is_dir() and not self.replace:
            path = others[0] / "campaign.json"
            try:
                why = differences(self.identity, json.loads(path.read_text(encoding="utf-8")))
            except (OSError, ValueError, TypeError):
                why = f"its description {str(path)!r} is missing or damaged"
            raise ValueError(
                f"out must name a new file or the same campaign; received {str(self.out)!r}, where another one is "
                f"under way and may be replaced with --replace: {why}"
            )
        self.folder.mkdir(exist_ok=True)
        write_whole(self.folder / "campaign.json", json.dumps(self.identity, indent=1) + "\n")

    def load(self) -> list[Columns]:
        """The columns of all undamaged batches; counts the damaged ones, which are removed."""
        batches = []
        for path in sorted(self.folder.glob("part-*.npz")):
            content = path.read_bytes()
            if path.stem != self._name(content):
                path.unlink()
                self.damaged += 1
                continue
            with np.load(BytesIO(content)) as file:
                columns = dict(file)
            self._charge(**json.loads(str(columns.pop("cost"))))
            batches.append(columns)
        for stray in self.folder.glob(f".*{UNFINISHED}"):
            stray.unlink()
        return batches

    def _name(self, content: bytes | memoryview) -> str:
        digest = hashlib.sha256(self.folder.name.encode())
        digest.update(content)
        return f"part-{digest.hexdigest()[:24]}"

    def add(self, columns: Columns, core_seconds: float, origin: dict[str, Any]) -> None:
        """Save a batch, the seconds that its worker took, and the versions and host of that worker.

        Raises:
            CampaignError: it could not be written.
        """
        now = time.perf_counter()
        cost = {"wall_seconds": now - self._clock, "core_seconds": core_seconds, "origin": origin}
        memory = BytesIO()
        text = {name: values.astype("U") for name, values in columns.items() if values.dtype == object}
        np.savez(memory, cost=np.array(json.dumps(cost)), **(columns | text))
        path = self.folder / f"{self._name(memory.getbuffer())}.npz"
        try:
            write_whole(path, memory.getbuffer())
        except OSError as error:
            kept = "what was saved before is kept, and the same command continues"
            if not self.folder.is_dir():
                kept = "somebody removed what was saved, and the same command begins again"
            raise CampaignError(f"cannot write {str(path)!r} ({error.strerror or error}); {kept}") from error
        self._clock = now
        self._charge(**cost)

    def take(self, attributes: Mapping[str, Any]) -> None:
        """Add the cost and the origin of an earlier file to those of the batches saved here."""
        names = ("versions", "host")
        self._charge(attributes["wall_seconds"], attributes["core_seconds"], {name: attributes[name] for name in names})

    def _charge(self, wall_seconds: float, core_seconds: float, origin: dict[str, Any]) -> None:
        self.seconds["wall_seconds"] += wall_seconds
        self.seconds["core_seconds"] += core_seconds
        if origin and origin not in self.origins:
            self.origins.append(origin)

    def remove(self, *, others: bool = False) -> None:
        """Remove the batches once the data set is complete; with `others`, those of the campaigns it replaces too."""
        with suppress(OSError):
            for folder in list(self.place.glob(_FOLDERS if others else self.folder.name)):
                for path in folder.iterdir():
                    if _OWN.fullmatch(path.name):
                        path.unlink()
                with suppress(OSError):
                    folder.rmdir()
            lock = self.place / "lock"
            if list(self.place.iterdir()) == [lock] and lock.stat().st_size == 0:
                lock.unlink()
