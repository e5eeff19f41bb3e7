"""Checks of what is read from a file of trajectories: that nothing is missing, and that its parts are consistent.

docs/dataset.md describes the groups of the file with their shapes, units and attributes.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from bem._support.wording import shown
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import STEPS_VERSION
from bem.dataset.records import COMPLETED, FAILED, SCALARS, Columns, Layout, layout_of, measured_layout

ATTRIBUTES = {
    "campaign": dict,
    "versions": dict | list,
    "host": str | list,
    "accuracy": str | float | int,
    "wall_seconds": float | int,
    "core_seconds": float | int,
    "workers": int,
}
"""Root attributes that every reader needs, and their types."""

IDENTITY = ("design", "ranges", "modulus_ratio", "seed", "count", "accuracy", "counts", "native", "shard", "solver")
"""What the attribute `campaign` of a data set holds."""

POSITIVE = ("tabor", "loading_rate", "unloading_rate")
"""Quantities of a protocol that are above zero."""


class InconsistentError(ValueError):
    """The parts of a file do not fit together; the message says what is wrong with the file."""


def check_attributes(attributes: Mapping[str, Any], identity: tuple[str, ...] = IDENTITY) -> None:
    """Check the root attributes of a file, and that `campaign` holds the names of an `identity`.

    Raises:
        InconsistentError: naming the attribute.
    """
    for name, kind in ATTRIBUTES.items():
        if name not in attributes:
            raise InconsistentError(f"without the attribute {name!r}")
        if not isinstance(attributes[name], kind):
            raise InconsistentError(f"whose attribute {name!r} is {shown(attributes[name])}")
    campaign = attributes["campaign"]
    for name in identity:
        if name not in campaign:
            raise InconsistentError(f"whose attribute 'campaign' lacks {name!r}")
        if name in attributes and attributes[name] != campaign[name]:
            here, there = shown(attributes[name]), shown(campaign[name])
            raise InconsistentError(f"whose attribute {name!r} is {here}, and {there} in 'campaign'")


def check_columns(columns: Columns, layout: Layout, count: int) -> None:
    """Check the arrays of a file of a campaign of `count` trajectories.

    Raises:
        InconsistentError: naming the array.
    """
    for name, kinds, shape in _expected(columns, layout):
        if name not in columns:
            raise InconsistentError(f"without /{name}")
        values = columns[name]
        if values.dtype.kind not in kinds or values.shape != shape:
            found = f"{values.dtype} of shape {values.shape} instead of shape {shape}"
            raise InconsistentError(f"whose /{name} is {found}")
    if fault := next(_faults(columns, count), ""):
        raise InconsistentError(fault)


def check_dataset(columns: Columns, identity: Mapping[str, Any], counts: tuple[int, ...]) -> None:
    """Check the arrays of a data set of this campaign; native histories only where they were read.

    Raises:
        InconsistentError: naming the array.
    """
    if len(counts) != 3 or list(counts) != list(identity["counts"]):
        raise InconsistentError(
            f"whose measurement points are {shown(list(counts))} instead of {shown(identity['counts'])}"
        )
    if identity.get("steps", "uniform") not in ("uniform", "physical"):
        raise InconsistentError(f"whose measurement steps are {shown(identity['steps'])}")
    if "steps" in identity and identity.get("steps_version", 1) != STEPS_VERSION:
        version = shown(identity.get("steps_version", 1))
        raise InconsistentError(
            f"whose physical steps are of version {version} instead of {STEPS_VERSION}; simulate it again"
        )
    drawn = [*QUANTITIES, *(["modulus_ratio"] if isinstance(identity["modulus_ratio"], list) else [])]
    layout = measured_layout(sum(counts), native=any(name.startswith("native/") for name in columns))
    protocols = layout_of({f"protocols/{name}": np.float64 for name in drawn})
    check_columns(columns, {**layout, **protocols}, identity["count"])
    for name in QUANTITIES:
        values = columns[f"protocols/{name}"]
        if not np.all(np.isfinite(values)):
            raise InconsistentError(f"whose /protocols/{name} is not finite")
        if name in POSITIVE and np.any(values <= 0.0):
            raise InconsistentError(f"whose /protocols/{name} is not above zero")
    ratios = columns.get("protocols/modulus_ratio", np.ones(1))
    if not np.all((ratios > 0.0) & (ratios <= 1.0)):
        raise InconsistentError("whose /protocols/modulus_ratio is not above 0 and at most 1")
    if np.any(columns["protocols/dwell_time"] < 0.0):
        raise InconsistentError("whose /protocols/dwell_time is below zero")
    completed = columns["status"] == COMPLETED
    for name in ("fms/force", *(f"scalars/{name}" for name in SCALARS)):
        if not np.all(np.isfinite(columns[name][completed])):
            raise InconsistentError(f"whose /{name} is not finite in every completed trajectory")


def _expected(columns: Columns, layout: Layout) -> Iterator[tuple[str, str, tuple[int, ...]]]:
    """Name, allowed kinds of dtype and shape of each array; those that fix the shapes of others come first."""
    size, jumps = (len(columns[name]) if name in columns else 0 for name in ("index", "jumps/trajectory"))
    yield "index", "iu", (size,)
    groups = {path.partition("/")[0] for path in layout}
    if "jumps" in groups:
        yield "jumps/trajectory", "iu", (jumps,)
    if "native" in groups:
        yield "native/offsets", "iu", (size + 1,)
    instants = int(columns["native/offsets"][-1]) if "native" in groups else 0
    for path, kind in layout.items():
        rows = {"jumps": jumps, "native": instants}.get(path.partition("/")[0], size)
        yield path, {"O": "O", "f": "iuf"}.get(kind.base.kind, "iu"), (rows, *kind.shape)


def _faults(columns: Columns, count: int) -> Iterator[str]:
    index = columns["index"]
    if len(index) == 0:
        yield "without trajectories"
    if index[0] < 0 or index[-1] >= count or not _increasing(index, strictly=True):
        yield f"whose /index does not increase from 0 to less than {shown(count)}"
    if not np.all(np.isin(columns["status"], (COMPLETED, FAILED))):
        yield "whose /status is neither completed nor failed"
    owners = columns.get("jumps/trajectory", index)
    if not _increasing(owners) or not np.all(np.isin(owners, index)):
        yield "whose /jumps/trajectory is not in the order of /index"
    offsets = columns.get("native/offsets", np.zeros(1, dtype=np.int64))
    if offsets[0] != 0 or not _increasing(offsets):
        yield "whose /native/offsets do not increase from 0"
    for name, values in columns.items():
        if name.startswith(("jumps/", "native/")) and not np.all(np.isfinite(values)):
            yield f"whose /{name} is not finite"


def _increasing(values: np.ndarray, *, strictly: bool = False) -> bool:
    steps = np.diff(values.astype(np.int64))
    return bool(np.all(steps > 0) if strictly else np.all(steps >= 0))
