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

WITHIN = {
    **dict.fromkeys(("tabor", "loading_rate", "unloading_rate"), (lambda values: values > 0.0, "above zero")),
    "dwell_time": (lambda values: values >= 0.0, "zero or above"),
    "modulus_ratio": (lambda values: (values > 0.0) & (values <= 1.0), "above 0 and at most 1"),
}
"""What a quantity of a protocol must be besides finite, and how that is called."""


class InconsistentError(ValueError):
    """The parts of a file do not fit together; the message says what is wrong with the file."""


def require(faults: Iterator[str]) -> None:
    """Refuse a file for the first of its faults.

    Raises:
        InconsistentError: naming the attribute or the array.
    """
    if fault := next(faults, ""):
        raise InconsistentError(fault)


def faults_of_attributes(attributes: Mapping[str, Any], identity: tuple[str, ...] = IDENTITY) -> Iterator[str]:
    """Check the root attributes of a file, and that `campaign` holds the names of an `identity`."""
    for name, kind in ATTRIBUTES.items():
        if name not in attributes:
            yield f"without the attribute {name!r}"
        if not isinstance(attributes[name], kind):
            yield f"whose attribute {name!r} is {shown(attributes[name])}"
    campaign = attributes["campaign"]
    for name in identity:
        if name not in campaign:
            yield f"whose attribute 'campaign' lacks {name!r}"
        if name in attributes and attributes[name] != campaign[name]:
            yield f"whose attribute {name!r} is {shown(attributes[name])}, and {shown(campaign[name])} in 'campaign'"


def faults_of_columns(columns: Columns, layout: Layout, count: int) -> Iterator[str]:
    """Check the arrays of a file of a campaign of `count` trajectories."""
    for name, kinds, shape in _expected(columns, layout):
        if name not in columns:
            yield f"without /{name}"
        values = columns[name]
        if values.dtype.kind not in kinds or values.shape != shape:
            yield f"whose /{name} is {values.dtype} of shape {values.shape} instead of shape {shape}"
    index = columns["index"]
    if len(index) == 0:
        yield "without trajectories"
    if index[0] < 0 or index[-1] >= count or not np.all(np.diff(index.astype(np.int64)) > 0):
        yield f"whose /index does not increase from 0 to less than {shown(count)}"
    if not np.all(np.isin(columns["status"], (COMPLETED, FAILED))):
        yield "whose /status is neither completed nor failed"
    owners = columns.get("jumps/trajectory", index)
    if np.any(np.diff(owners.astype(np.int64)) < 0) or not np.all(np.isin(owners, index)):
        yield "whose /jumps/trajectory is not in the order of /index"
    offsets = columns.get("native/offsets", np.zeros(1)).astype(np.int64)
    if offsets[0] != 0 or np.any(np.diff(offsets) < 0):
        yield "whose /native/offsets do not increase from 0"
    for name, values in columns.items():
        if name.startswith(("jumps/", "native/")) and not np.all(np.isfinite(values)):
            yield f"whose /{name} is not finite"


def faults_of_dataset(columns: Columns, identity: Mapping[str, Any], counts: tuple[int, ...]) -> Iterator[str]:
    """Check the arrays of a data set of this campaign; native histories only where they were read."""
    if len(counts) != 3 or list(counts) != list(identity["counts"]):
        yield f"whose measurement points are {shown(list(counts))} instead of {shown(identity['counts'])}"
    if identity.get("steps", "uniform") not in ("uniform", "physical"):
        yield f"whose measurement steps are {shown(identity['steps'])}"
    version = identity.get("steps_version", 1)
    if "steps" in identity and version != STEPS_VERSION:
        yield f"whose physical steps are of version {shown(version)} instead of {STEPS_VERSION}; simulate it again"
    drawn = [*QUANTITIES, *(["modulus_ratio"] if isinstance(identity["modulus_ratio"], list) else [])]
    layout = measured_layout(sum(counts), native=any(name.startswith("native/") for name in columns))
    protocols = layout_of({f"protocols/{name}": np.float64 for name in drawn})
    yield from faults_of_columns(columns, {**layout, **protocols}, identity["count"])
    for name in drawn:
        values = columns[f"protocols/{name}"]
        if not np.all(np.isfinite(values)):
            yield f"whose /protocols/{name} is not finite"
        holds, words = WITHIN.get(name, (np.isfinite, ""))
        if not np.all(holds(values)):
            yield f"whose /protocols/{name} is not {words}"
    completed = columns["status"] == COMPLETED
    for name in ("fms/force", *(f"scalars/{name}" for name in SCALARS)):
        if not np.all(np.isfinite(columns[name][completed])):
            yield f"whose /{name} is not finite in every completed trajectory"


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
