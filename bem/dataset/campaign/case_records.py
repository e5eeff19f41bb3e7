"""Cases with their trajectories as arrays of a file, and back."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from bem.dataset.records import RESULTS, Columns
from bem.trajectory import Jump, Statistics, Trajectory

ARRAYS = {"time": float, "indentation": float, "force": float, "contact_radius": float, "unloading": np.uint8}


@dataclass(frozen=True)
class CaseRecord:
    """One case; `trajectory` ends early or is `None` where `status` is `FAILED`; numbers in the order of `RESULTS`."""

    index: int
    status: int
    reason: str
    trajectory: Trajectory | None = None
    scalars: tuple[float, ...] = (np.nan,) * len(RESULTS)


def case_columns(records: Iterable[CaseRecord]) -> Columns:
    """Arrays of some records, in the order of their index; trajectories one after another."""
    ordered = sorted(records, key=lambda record: record.index)
    histories = [record.trajectory for record in ordered]
    columns: Columns = {
        "index": np.array([record.index for record in ordered], dtype=np.int64),
        "status": np.array([record.status for record in ordered], dtype=np.uint8),
        "reason": np.array([record.reason for record in ordered], dtype=object),
        "outcome": np.array([outcome_text(history) for history in histories], dtype=object),
    }
    for name, values in zip(RESULTS, zip(*(record.scalars for record in ordered), strict=True), strict=True):
        columns[f"scalars/{name}"] = np.array(values, dtype=np.float64)
    lengths = [0 if history is None else len(history.time) for history in histories]
    columns["native/offsets"] = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    for name, kind in ARRAYS.items():
        arrays = [getattr(history, name) for history in histories if history is not None]
        columns[f"native/{name}"] = np.concatenate([np.empty(0), *arrays]).astype(kind)
    return columns


def outcome_text(trajectory: Trajectory | None) -> str:
    """What a trajectory holds besides its arrays, as JSON, which has no NaN: such numbers are left out."""
    if trajectory is None:
        return "null"
    names = ("status", "accuracy", "energy_balance", "jumps", "stats")
    found = {name: getattr(trajectory, name) for name in names}
    found |= {"spring": trajectory.spring} if trajectory.spring is not None else {}
    found |= {"by_force": True} if trajectory.by_force else {}
    found["jumps"] = [_numbers(asdict(jump)) for jump in trajectory.jumps]
    found["stats"] = asdict(trajectory.stats)
    return json.dumps(_numbers(found), allow_nan=False, default=lambda number: number.item())


def _numbers(values: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in values.items() if not (isinstance(value, float) and np.isnan(value))}


def records_of(columns: Columns) -> list[CaseRecord]:
    """The records that arrays of `case_columns` hold."""
    offsets = columns["native/offsets"].tolist()
    scalars = zip(*(columns[f"scalars/{name}"].tolist() for name in RESULTS), strict=True)
    rows = zip(columns["index"], columns["status"], columns["reason"], columns["outcome"], scalars, strict=True)
    return [
        CaseRecord(int(index), int(status), str(reason), _trajectory(columns, offsets[row : row + 2], outcome), numbers)
        for row, (index, status, reason, outcome, numbers) in enumerate(rows)
    ]


def _trajectory(columns: Columns, bounds: Sequence[int], outcome: str) -> Trajectory | None:
    found = json.loads(str(outcome))
    if found is None:
        return None
    arrays: dict[str, Any] = {name: columns[f"native/{name}"][slice(*bounds)] for name in ARRAYS}
    arrays["unloading"] = arrays["unloading"].astype(bool)
    found["jumps"] = tuple(Jump(**_with_nan(Jump, jump)) for jump in found["jumps"])
    found["stats"] = Statistics(**_with_nan(Statistics, found["stats"]))
    return Trajectory(**arrays, **found)


def _with_nan(kind: type, found: dict[str, Any]) -> dict[str, Any]:
    return {field.name: found.get(field.name, np.nan) for field in fields(kind)}
