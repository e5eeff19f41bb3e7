"""What measurements share: seconds with their spread, percentiles, and values that JSON can hold.

Seconds are wall seconds of one thread. A first call, which loads compiled kernels, is never counted.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

MEASUREMENTS = Path("published/measurements")
"""Where measurements go that take long or belong to one machine."""


def spread(values: Sequence[float] | np.ndarray) -> dict[str, float]:
    """Median, quartiles, 95th percentile, largest and mean of finite values; NaN throughout when there are none."""
    array = np.asarray(values, dtype=np.float64)
    array = array[np.isfinite(array)]
    names = {"median": 50.0, "low": 25.0, "high": 75.0, "p95": 95.0, "largest": 100.0}
    if array.size == 0:
        return {"count": 0, "mean": np.nan, **dict.fromkeys(names, np.nan)}
    found = {name: float(np.percentile(array, percent)) for name, percent in names.items()}
    return {"count": int(array.size), "mean": float(array.mean()), **found}


def timed(function: Callable[[], Any], repeats: int) -> list[float]:
    """Seconds of each of `repeats` calls, after one that is not counted."""
    function()
    seconds = []
    for _ in range(repeats):
        started = time.perf_counter()
        function()
        seconds.append(time.perf_counter() - started)
    return seconds


def plain(value: Any) -> Any:
    """The same value in what JSON holds: NaN and infinity as None, arrays as lists."""
    if isinstance(value, Mapping):
        return {str(key): plain(part) for key, part in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def exponent(x: Sequence[float], y: Sequence[float]) -> tuple[float, float]:
    """Slope of log y over log x by least squares, and its standard error."""
    a, b = np.log(np.asarray(x, dtype=np.float64)), np.log(np.asarray(y, dtype=np.float64))
    centred = a - a.mean()
    slope = float(centred @ b / (centred @ centred))
    residual = b - b.mean() - slope * centred
    error = np.sqrt(residual @ residual / max(a.size - 2, 1) / (centred @ centred))
    return slope, float(error)
