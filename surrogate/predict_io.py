"""Files around a prediction: protocols or histories in, trajectories out, each whole or not at all.

Input, CSV with a header or JSON:

- protocols: `tabor, peak_indentation, loading_rate, dwell_time, unloading_rate`, one a row, or a JSON list of objects;
- one history: `time, indentation`, and where wanted `edge` (one at both ends of the dwell); as JSON an object of lists.

Output: CSV in long form, `trajectory, time, indentation, force`, or JSON, a list of objects with scalars and arrays.
"""

from __future__ import annotations

import csv
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from surrogate.files import whole_file

PROTOCOL_COLUMNS = ("tabor", "peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
HISTORY_COLUMNS = ("time", "indentation")
EDGE = "edge"
WANTED = f"the columns {', '.join(PROTOCOL_COLUMNS)} of protocols, or {', '.join(HISTORY_COLUMNS)} of a history"


@dataclass(frozen=True)
class Table:
    """Columns of numbers of equal length, by name."""

    columns: dict[str, np.ndarray]

    @property
    def is_history(self) -> bool:
        """Whether the rows are points of one history, not protocols."""
        return "time" in self.columns


def read_table(path: Path) -> Table:
    """Read protocols or a history from a CSV or JSON file.

    Raises:
        FileNotFoundError: no such file.
        ValueError: another suffix, a malformed file, wrong columns, or what is not a finite number; the message says
            where.
    """
    if path.suffix not in (".csv", ".json"):
        raise ValueError(f"Expected an input file called .csv or .json. Received: {path}")
    if not path.is_file():
        raise FileNotFoundError(f"Expected an input file. Received: {path}, which does not exist")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"Expected text in UTF-8. Received: {path}") from error
    raw = _csv_columns(text, path) if path.suffix == ".csv" else _json_columns(text, path)
    _check_columns(set(raw), path)
    if not all(raw.values()):
        raise ValueError(f"Expected at least one row of numbers. Received: {path}, which has none")
    return Table({name: _numbers(name, values, path) for name, values in raw.items()})


def write_trajectories(path: Path, trajectories: list[Any], checks: list[dict[str, float]] | None = None) -> None:
    """Write trajectories as CSV or JSON, by the suffix.

    Args:
        path: The file, replaced if it exists.
        trajectories: What to write.
        checks: Errors against the solver, one dictionary per trajectory; JSON only.

    Raises:
        ValueError: another suffix, or a place that cannot be written.
    """
    require_output(path, (".csv", ".json"))
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        if path.suffix == ".csv":
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["trajectory", "time", "indentation", "force"])
            for number, found in enumerate(trajectories):
                rows = zip(found.time, found.indentation, found.force, strict=True)
                writer.writerows([number, *(f"{value:.10g}" for value in row)] for row in rows)
        else:
            file.write(to_json(trajectories, checks) + "\n")


def to_json(trajectories: list[Any], checks: list[dict[str, float]] | None = None) -> str:
    """Return scalars and arrays as a JSON list; what is absent is null."""
    content = []
    for number, found in enumerate(trajectories):
        entry = found.summary() | {name: getattr(found, name).tolist() for name in ("time", "indentation", "force")}
        content.append(entry | ({"check": checks[number]} if checks else {}))
    return json.dumps(_without_nan(content))


def require_output(path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Refuse a place that cannot be written before anything is computed.

    Raises:
        ValueError: another suffix than those, or no such directory.
    """
    if path is None:
        return
    if path.suffix not in suffixes:
        raise ValueError(f"Expected an output file called {' or '.join(suffixes)}. Received: {path}")
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise ValueError(f"Expected an output file in a directory that exists. Received: {path}")


def _csv_columns(text: str, path: Path) -> dict[str, list[Any]]:
    try:
        rows = [row for row in csv.reader(text.splitlines(), strict=True) if row]
    except csv.Error as error:
        raise ValueError(f"Expected comma-separated numbers under a header. Received: {path} ({error})") from error
    if not rows:
        raise ValueError(f"Expected comma-separated numbers under a header. Received: {path}, which is empty")
    header = [name.strip() for name in rows[0]]
    if len(set(header)) != len(header):
        raise ValueError(f"Expected every column once. Received: {', '.join(header)} in {path}")
    for number, row in enumerate(rows[1:], start=1):
        if len(row) != len(header):
            raise ValueError(
                f"Expected {len(header)} values in every row. Received: {len(row)} in row {number} of {path}"
            )
    return {name: [row[index] for row in rows[1:]] for index, name in enumerate(header)}


def _json_columns(text: str, path: Path) -> dict[str, list[Any]]:
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"Expected JSON. Received: {path} ({error})") from error
    if isinstance(content, list) and content and all(isinstance(entry, dict) for entry in content):
        if any(set(entry) != set(content[0]) for entry in content):
            raise ValueError(f"Expected the same names in every object of the list. Received: {path}")
        return {name: [entry[name] for entry in content] for name in content[0]}
    if isinstance(content, dict):
        columns = {name: values if isinstance(values, list) else [values] for name, values in content.items()}
        if len({len(values) for values in columns.values()}) > 1:
            raise ValueError(f"Expected lists of equal length. Received: other ones in {path}")
        return columns
    raise ValueError(f"Expected a JSON list of protocols, or an object of lists. Received: {path}")


def _check_columns(names: set[str], path: Path) -> None:
    if names in ({*PROTOCOL_COLUMNS}, {*HISTORY_COLUMNS}, {*HISTORY_COLUMNS, EDGE}):
        return
    raise ValueError(f"Expected {WANTED} (and {EDGE}, if known). Received: {', '.join(sorted(names))} in {path}")


def _numbers(name: str, values: list[Any], path: Path) -> np.ndarray:
    numbers = np.empty(len(values))
    for index, value in enumerate(values):
        try:
            numbers[index] = float(value) if not isinstance(value, bool) else math.nan
        except (TypeError, ValueError):
            numbers[index] = math.nan
        if not math.isfinite(numbers[index]):
            raise ValueError(f"Expected finite numbers. Received: {value!r} as {name} in row {index + 1} of {path}")
    return numbers


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
