"""Checks of what is read from a file of trajectories: that nothing is missing, and that its parts are consistent.

docs/dataset.md describes the groups of the file with their shapes, units and attributes.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from bem._support.wording import shown
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import STEPS_VERSION
from bem.dataset.records import COMPLETED, FAILED, SCALARS, Columns, Layout, measured_layout
from bem.dataset.sealed_file import DamagedFileError

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

_RATES = ("protocols/tabor", "protocols/loading_rate", "protocols/unloading_rate")
RULES = {
    "status": (lambda values: np.isin(values, (COMPLETED, FAILED)), "neither completed nor failed"),
    **dict.fromkeys(("jumps", "native", "protocols"), (np.isfinite, "not finite")),
    **dict.fromkeys(_RATES, (lambda values: values > 0.0, "not above zero")),
    "protocols/dwell_time": (lambda values: values >= 0.0, "not zero or above"),
    "protocols/modulus_ratio": (lambda values: (values > 0.0) & (values <= 1.0), "not above 0 and at most 1"),
}
"""What holds for all values of an array or a group, and what they are where it does not."""


def refuse(wrong: Any, fault: str) -> None:
    """Refuse a file that is `wrong`, an array of truth values or one, for a fault, which follows its name."""
    if np.any(wrong):
        raise DamagedFileError(fault)


def check_attributes(attributes: Mapping[str, Any], identity: tuple[str, ...] = IDENTITY) -> None:
    """Check the root attributes of a file, and that `campaign` holds the names of an `identity`.

    Raises:
        DamagedFileError: as all functions here, naming the attribute or the array.
    """
    for name, kind in ATTRIBUTES.items():
        refuse(name not in attributes, f"without the attribute {name!r}")
        refuse(not isinstance(attributes[name], kind), f"whose attribute {name!r} is {shown(attributes[name])}")
    campaign = attributes["campaign"]
    for name in identity:
        refuse(name not in campaign, f"whose attribute 'campaign' lacks {name!r}")
        stated, wanted = attributes.get(name, campaign[name]), campaign[name]
        refuse(stated != wanted, f"whose attribute {name!r} is {shown(stated)}, and {shown(wanted)} in 'campaign'")


def check_columns(columns: Columns, layout: Layout, count: int) -> None:
    """Check the arrays of a file of a campaign of `count` trajectories."""
    size, jumps, instants = len(columns.get("index", ())), len(columns.get("jumps/trajectory", ())), 0
    groups = {path.partition("/")[0] for path in layout}
    refuse("index" not in columns, "without /index")
    if "jumps" in groups:
        _check_array(columns, "jumps/trajectory", "iu", (jumps,))
    if "native" in groups:
        _check_array(columns, "native/offsets", "iu", (size + 1,))
        instants = int(columns["native/offsets"][-1])
    for path, kind in layout.items():
        rows = {"jumps": jumps, "native": instants}.get(path.partition("/")[0], size)
        _check_array(columns, path, {"O": "O", "f": "iuf"}.get(kind.base.kind, "iu"), (rows, *kind.shape))
    index = columns["index"].astype(np.int64)
    refuse(size == 0, "without trajectories")
    outside = index[0] < 0 or index[-1] >= count
    refuse(outside or np.any(np.diff(index) <= 0), f"whose /index does not increase from 0 to less than {shown(count)}")
    owners = columns.get("jumps/trajectory", index).astype(np.int64)
    foreign = np.any(np.diff(owners) < 0) or not np.all(np.isin(owners, index))
    refuse(foreign, "whose /jumps/trajectory is not in the order of /index")
    offsets = columns.get("native/offsets", np.zeros(1)).astype(np.int64)
    refuse(offsets[0] != 0 or np.any(np.diff(offsets) < 0), "whose /native/offsets do not increase from 0")
    for name in columns:
        for holds, words in (RULES[place] for place in (name.partition("/")[0], name) if place in RULES):
            refuse(~holds(columns[name]), f"whose /{name} is {words}")


def _check_array(columns: Columns, name: str, kinds: str, shape: tuple[int, ...]) -> None:
    """Check kind of dtype and shape of an array."""
    refuse(name not in columns, f"without /{name}")
    values = columns[name]
    wrong = values.dtype.kind not in kinds or values.shape != shape
    refuse(wrong, f"whose /{name} is {values.dtype} of shape {values.shape} instead of shape {shape}")


def check_dataset(columns: Columns, identity: Mapping[str, Any], counts: tuple[int, ...]) -> None:
    """Check the arrays of a data set of this campaign; native histories only where they were read."""
    wanted, version = identity["counts"], identity.get("steps_version", 1)
    wrong = len(counts) != 3 or list(counts) != list(wanted)
    refuse(wrong, f"whose measurement points are {shown(list(counts))} instead of {shown(wanted)}")
    steps = identity.get("steps", "uniform")
    refuse(steps not in ("uniform", "physical"), f"whose measurement steps are {shown(steps)}")
    older = "steps" in identity and version != STEPS_VERSION
    refuse(older, f"whose physical steps are of version {shown(version)} instead of {STEPS_VERSION}; simulate it again")
    drawn = [*QUANTITIES, *(["modulus_ratio"] if isinstance(identity["modulus_ratio"], list) else [])]
    layout = measured_layout(sum(counts), native=any(name.startswith("native/") for name in columns))
    protocols = {f"protocols/{name}": np.dtype(np.float64) for name in drawn}
    check_columns(columns, {**layout, **protocols}, identity["count"])
    completed = columns["status"] == COMPLETED
    for name in ("fms/force", *(f"scalars/{name}" for name in SCALARS)):
        refuse(~np.isfinite(columns[name][completed]), f"whose /{name} is not finite in every completed trajectory")
