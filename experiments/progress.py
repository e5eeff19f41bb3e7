"""Progress of long studies, in lines on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator
from datetime import timedelta
from typing import TypeVar

SAID_EVERY = 20.0  # seconds between two lines
Item = TypeVar("Item")


def progress(items: Iterable[Item], label: str, total: int | None = None) -> Iterator[Item]:
    """Yield the items one by one, and say on standard error how many are done and how long the rest will take.

    The time of the first is left out of the estimate, because programs start and kernels are compiled in it.

    Args:
        items: The items, each of which is expected to take the same time.
        label: Name of the items in the messages.
        total: Number of items, required if `items` has no length.
    """
    count = len(items) if total is None else total  # type: ignore[arg-type]
    started = said = first = time.perf_counter()
    for done, item in enumerate(items, start=1):
        yield item
        now = time.perf_counter()
        first = now if done == 1 else first
        if now - said > SAID_EVERY or (done == count and now - started > SAID_EVERY):
            rest = (now - first) * (count - done) / (done - 1) if done > 1 else None
            left = "" if rest is None else f", {timedelta(seconds=round(rest))} left"
            print(f"{label}: {done} of {count}{left}", file=sys.stderr, flush=True)
            said = now
