"""Checks of what is read from a data set file: that nothing is missing, and that its parts are consistent.

docs/dataset.md describes the groups of the file with their shapes, units and attributes.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from bem._support.wording import shown
from bem.dataset.designs import QUANTITIES
from bem.dataset.records import COMPLETED, FAILED, JUMP_QUANTITIES, NATIVE_QUANTITIES, SCALARS, Columns

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
"""What the attribute `campaign` holds."""

POSITIVE = ("tabor", "loading_rate", "unloading_rate")
"""Quantities of a protocol that are above zero."""


def attribute_fault(attributes: Mapping[str, Any]) -> str:
    """Say what is wrong with the root attributes of a data set; empty when nothing is."""
    for name, kind in ATTRIBUTES.items():
        if name not in attributes:
            return f"without the attribute {name!r}"
        if not isinstance(attributes[name], kind):
            return f"whose attribute {name!r} is {shown(attributes[name])}"
    campaign = attributes["campaign"]
    absent = [name for name in IDENTITY if name not in campaign]
    if absent:
        return f"whose attribute 'campaign' lacks {absent[0]!r}"
    for name in IDENTITY:
        if name in attributes and attributes[name] != campaign[name]:
            return f"whose attribute {name!r} is {shown(attributes[name])}, and {shown(campaign[name])} in 'campaign'"
    return ""


def column_fault(columns: Columns, identity: Mapping[str, Any], counts: tuple[int, ...]) -> str:
    """Say what is wrong with the arrays of a data set of this campaign; empty when nothing is.

    Native histories are checked only where they were read.
    """
    if len(counts) != 3 or list(counts) != list(identity["counts"]):
        return f"whose measurement points are {shown(list(counts))} instead of {shown(identity['counts'])}"
    if identity.get("steps", "uniform") not in ("uniform", "physical"):
        return f"whose measurement steps are {shown(identity['steps'])}"
    for name, kinds, shape in _expected(columns, sum(counts), identity["modulus_ratio"]):
        if name not in columns:
            return f"without /{name}"
        values = columns[name]
        if values.dtype.kind not in kinds or values.shape != shape:
            return f"whose /{name} is {values.dtype} of shape {values.shape} instead of shape {shape}"
    index, owners = columns["index"], columns["jumps/trajectory"]
    if len(index) == 0:
        return "without trajectories"
    if index[0] < 0 or index[-1] >= identity["count"] or not _increasing(index, strictly=True):
        return f"whose /index does not increase from 0 to less than {shown(identity['count'])}"
    if not np.all(np.isin(columns["status"], (COMPLETED, FAILED))):
        return "whose /status is neither completed nor failed"
    if not _increasing(owners) or not np.all(np.isin(owners, index)):
        return "whose /jumps/trajectory is not in the order of /index"
    offsets = columns.get("native/offsets", np.zeros(1, dtype=np.int64))
    if offsets[0] != 0 or not _increasing(offsets):
        return "whose /native/offsets do not increase from 0"
    return _number_fault(columns)


def _number_fault(columns: Columns) -> str:
    for name in QUANTITIES:
        values = columns[f"protocols/{name}"]
        if not np.all(np.isfinite(values)):
            return f"whose /protocols/{name} is not finite"
        if name in POSITIVE and np.any(values <= 0.0):
            return f"whose /protocols/{name} is not above zero"
    ratios = columns.get("protocols/modulus_ratio", np.ones(1))
    if not np.all((ratios > 0.0) & (ratios <= 1.0)):
        return "whose /protocols/modulus_ratio is not above 0 and at most 1"
    if np.any(columns["protocols/dwell_time"] < 0.0):
        return "whose /protocols/dwell_time is below zero"
    completed = columns["status"] == COMPLETED
    for name in ("fms/force", *(f"scalars/{name}" for name in SCALARS)):
        finite = np.isfinite(columns[name])
        if not np.all(finite.reshape(len(completed), -1).all(axis=1) | ~completed):
            return f"whose /{name} is not finite in every completed trajectory"
    for name in (*(f"jumps/{name}" for name in JUMP_QUANTITIES), *(f"native/{name}" for name in NATIVE_QUANTITIES)):
        if name in columns and not np.all(np.isfinite(columns[name])):
            return f"whose /{name} is not finite"
    return ""


def _expected(columns: Columns, points: int, ratio: Any) -> Iterator[tuple[str, str, tuple[int, ...]]]:
    """Name, allowed kinds of dtype and shape of each array; those that fix the shapes of others come first."""
    whole, real = "iu", "iuf"
    size = len(columns["index"]) if "index" in columns else 0
    yield "index", whole, (size,)
    yield "status", whole, (size,)
    yield "reason", "O", (size,)
    yield "fms/force", real, (size, points)
    yield from ((f"protocols/{name}", real, (size,)) for name in QUANTITIES)
    if isinstance(ratio, list):
        yield "protocols/modulus_ratio", real, (size,)
    yield from ((f"scalars/{name}", real, (size,)) for name in SCALARS)
    jumps = len(columns["jumps/trajectory"]) if "jumps/trajectory" in columns else 0
    yield "jumps/trajectory", whole, (jumps,)
    yield from ((f"jumps/{name}", real, (jumps,)) for name in JUMP_QUANTITIES)
    if any(name.startswith("native/") for name in columns):
        yield "native/offsets", whole, (size + 1,)
        instants = int(columns["native/offsets"][-1])
        yield from ((f"native/{name}", real, (instants,)) for name in NATIVE_QUANTITIES)


def _increasing(values: np.ndarray, *, strictly: bool = False) -> bool:
    steps = np.diff(values.astype(np.int64))
    return bool(np.all(steps > 0) if strictly else np.all(steps >= 0))
