"""What a campaign keeps of each trajectory: a record, and many records as columns of arrays.

A record is a dictionary: the path of an array in the file -> what one trajectory adds to it. A layout says which
arrays a file has. Units as in `bem.problem.protocol`; forces in pi R dgamma, tension positive.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bem._support.validation import FloatArray
from bem.dataset.measurement_steps import measurement_grid

COMPLETED, FAILED = 0, 1
"""Values of `status`."""

RESULTS = ("pull_off_force", "pull_off_time", "hysteresis", "max_compression", "end_force")
_COUNTS = dict.fromkeys(("steps", "rejections", "iterations"), np.int32)
SCALARS = dict.fromkeys((*RESULTS, "solver_seconds"), np.float64) | _COUNTS
SCALARS |= {"nodes": np.float64, "jump_count": np.int32}
JUMP_QUANTITIES = ("time", "indentation", "force_before", "force_after")
SOLIDS = ("solids/strengths", "solids/times")
"""Arrays of the retardation terms of each solid, where a design draws them."""
NATIVE_QUANTITIES = ("time", "indentation", "force", "contact_radius")

Columns = dict[str, NDArray[Any]]
Record = dict[str, Any]
Layout = Mapping[str, np.dtype]
"""The type of each array by its path in the file; of one in `jumps/` or `native/`, a record holds many rows."""


def layout_of(kinds: Mapping[str, Any]) -> Layout:
    """The layout of arrays of these types, and of those that are in every file."""
    every = {"index": np.int64, "status": np.uint8, "reason": object}
    return {path: np.dtype(dtype) for path, dtype in (every | dict(kinds)).items()}


def measured_layout(points: int, *, native: bool) -> Layout:
    """The layout of a data set of `points` measurement steps, with or without the solver's own histories."""
    dtypes = {"fms/force": (np.float32, points)} | {f"scalars/{name}": dtype for name, dtype in SCALARS.items()}
    dtypes |= {f"jumps/{name}": np.float64 for name in JUMP_QUANTITIES}
    return layout_of(dtypes | {f"native/{name}": np.float64 for name in NATIVE_QUANTITIES if native})


def blank(layout: Layout) -> Record:
    """A record without numbers: NaN for a real one, 0 for a whole one, no row of those that are many."""
    values: dict[str, Any] = {"f": np.nan, "O": ""}
    return {
        path: np.empty(0) if _group(path) else np.full(dtype.shape, values.get(dtype.base.kind, 0), dtype.base)[()]
        for path, dtype in layout.items()
    }


def _group(path: str) -> str:
    """The group of an array with many rows a record; empty for an array with one."""
    name = path.partition("/")[0]
    return name if name in ("jumps", "native") else ""


def tabulate(records: Iterable[Record], layout: Layout) -> Columns:
    """Arrays by their path in the file, trajectories in the order of their index.

    `jumps/trajectory` names the trajectory of each jump; the history of row i is `offsets[i]:offsets[i + 1]` of the
    other arrays in `native/`.
    """
    ordered = sorted(records, key=lambda record: record["index"])
    columns: Columns = {}
    for path, dtype in layout.items():
        values = [record[path] for record in ordered]
        if not (group := _group(path)):
            columns[path] = np.array(values, dtype=dtype.base)
            continue
        columns[path] = np.concatenate([np.empty(0), *values]).astype(dtype)
        lengths = [len(rows) for rows in values]
        if group == "jumps":
            columns["jumps/trajectory"] = np.repeat(columns["index"], lengths)
        else:
            columns["native/offsets"] = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    return columns


def untabulate(columns: Columns, layout: Layout) -> list[Record]:
    """The records of such columns, the inverse of `tabulate`."""
    bounds = {"native": columns.get("native/offsets", np.empty(0)).tolist()}
    if "jumps/trajectory" in columns:
        owners = columns["jumps/trajectory"]
        bounds["jumps"] = [*np.searchsorted(owners, columns["index"]).tolist(), len(owners)]

    def rows(path: str) -> list[Any]:
        values = columns[path]
        if group := _group(path):
            return [values[begin:end] for begin, end in pairwise(bounds[group])]
        return values.tolist() if values.ndim == 1 else list(values)

    return [dict(zip(layout, row, strict=True)) for row in zip(*map(rows, layout), strict=True)]


def grid_of(
    steps: str,
    protocols: Mapping[str, Any],
    counts: Sequence[int],
    around: Mapping[str, ArrayLike],
) -> tuple[FloatArray, FloatArray]:
    """Instants and indentations of steps of one of `STEPS`, each (B, N).

    The quantities of `protocols` have the names that `measurement_grid` takes. The solids and the pull-off times in
    `around` are for steps around the pull-off (`bem.dataset.pull_off_steps`).
    """
    if steps == "pull-off":
        # Imported here because it compiles kernels.
        from bem.dataset.pull_off_steps import pull_off_grid

        return pull_off_grid(**protocols, **around, counts=counts)
    return measurement_grid(**protocols, counts=counts)
