"""Input and output files of `surrogate predict`. Units as in `bem.protocol`.

Input, as CSV with a header or as JSON:

- protocols: the columns `tabor, peak_indentation, loading_rate, dwell_time, unloading_rate` and, for the pretrained
  models, `modulus_ratio`, one protocol per row; as JSON, a list of objects.
- one history: the columns `time, indentation` and, if known, `edge` (one at the first and the last point of the dwell)
  and `tabor` (the same in every row); as JSON, an object of lists, in which `tabor` may be a number. The columns
  `force`, `force_lower`, `force_upper`, `solver_force`, `modulus_ratio`, `phase` and `trajectory`, which this command
  and the demonstrator write, are ignored, but the file must hold one trajectory only.

Output: CSV with the columns `trajectory, time, indentation, force`, of a pretrained model `force_lower` and
`force_upper`, which are empty outside its training, and, after a check with the solver, `solver_force`, which is empty
after the end of an unfinished simulation; or JSON, a list of objects with scalars and arrays. Numbers have full
precision.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.outputs import require_suffix
from bem._support.plain_json import plain
from bem._support.wording import shortened, shown
from bem.dataset.designs import QUANTITIES

HISTORY_COLUMNS = ("time", "indentation")
EDGE, TABOR, TRAJECTORY = "edge", "tabor", "trajectory"
MODULUS_RATIO = "modulus_ratio"
BAND = ("force_lower", "force_upper")
READ_OVER = ("force", *BAND, "solver_force", MODULUS_RATIO, "phase", TRAJECTORY)
WANTED = f"the columns {', '.join(QUANTITIES)} of protocols, or {', '.join(HISTORY_COLUMNS)} of a history"

# Python's `float` also accepts texts such as 1_0, which no other program means as a number.
NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


@dataclass(frozen=True)
class Table:
    """Content of an input file: columns of equal length, by name.

    Args:
        path: The file.
        columns: Arrays of numbers of shape `(rows,)`, or lists of unconverted cells while the file is read.
        lines: Line number of each row in a CSV file.
        tabor: The Tabor parameter of a history, if the file has it.
    """

    path: Path
    columns: dict[str, Any]
    lines: tuple[int, ...] = ()
    tabor: float | None = None

    @property
    def is_history(self) -> bool:
        """Whether the rows are the points of one history instead of protocols."""
        return "time" in self.columns

    def numbers(self, name: str) -> np.ndarray:
        """Return a column as finite numbers, shape `(rows,)`.

        Raises:
            ValueError: a cell is not a finite number; the message says where.
        """
        numbers = np.array([_number(cell) for cell in self.columns[name]])
        if (bad := np.flatnonzero(~np.isfinite(numbers))).size:
            cell = shown(self.columns[name][bad[0]])
            raise ValueError(f"Expected finite numbers. Received: {cell} as {name} {self.where(bad[0])}")
        return numbers

    def where(self, row: int) -> str:
        """Return the position of a row, counted from zero, as text for a message."""
        line = f" (line {self.lines[row]})" if self.lines else ""
        return f"in row {row + 1}{line} of {self.path}"


def read_table(path: Path) -> Table:
    """Read protocols or a history from a CSV or JSON file.

    Raises:
        FileNotFoundError: the file does not exist.
        ValueError: the suffix, the format or a column name is wrong, or a cell is not a finite number; the message says
            where.
    """
    if path.suffix not in (".csv", ".json"):
        raise ValueError(f"Expected an input file called .csv or .json. Received: {path}")
    if not path.is_file():
        where = "is a directory" if path.is_dir() else "does not exist"
        raise FileNotFoundError(f"Expected an input file. Received: {path}, which {where}")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"Expected text in UTF-8. Received: {path}") from error
    except OSError as error:
        raise ValueError(f"Expected an input file that can be read. Received: {path} ({error.strerror})") from error
    read = Table(path, *_csv_columns(text, path)) if path.suffix == ".csv" else Table(path, _json_columns(text, path))
    names = set(read.columns)
    if names - {MODULUS_RATIO} != {*QUANTITIES} and not {*HISTORY_COLUMNS} <= names <= {
        *HISTORY_COLUMNS,
        EDGE,
        TABOR,
        *READ_OVER,
    }:
        found = shortened(", ".join(sorted(names)))
        raise ValueError(f"Expected {WANTED} (and {EDGE} and {TABOR}, if known). Received: {found} in {path}")
    if not all(read.columns.values()):
        raise ValueError(f"Expected at least one row of numbers. Received: {path}, which has none")
    if not read.is_history:
        return replace(read, columns={name: read.numbers(name) for name in read.columns})
    columns = {name: read.numbers(name) for name in read.columns if name not in READ_OVER}
    if len(set(map(str, read.columns.get(TRAJECTORY, ())))) > 1:
        raise ValueError(f"Expected the history of one trajectory. Received: several in {path}")
    if EDGE in columns and (bad := np.flatnonzero(~np.isin(columns[EDGE], (0.0, 1.0)))).size:
        mark = f"{columns[EDGE][bad[0]]:g} {read.where(bad[0])}"
        raise ValueError(f"Expected edge marks of zero or one. Received: {mark}")
    tabor = columns.pop(TABOR, None)
    if tabor is not None and (bad := np.flatnonzero(tabor != tabor[0])).size:
        other = f"{float(tabor[bad[0]])!r} {read.where(bad[0])}"
        raise ValueError(f"Expected the same Tabor parameter in every row. Received: {other}")
    return replace(read, columns=columns, tabor=None if tabor is None else float(tabor[0]))


def write_trajectories(
    path: Path,
    trajectories: Sequence[Any],
    checks: Sequence[dict[str, Any]] | None = None,
    solver_forces: Sequence[np.ndarray] | None = None,
) -> None:
    """Write trajectories as CSV or JSON, according to the suffix.

    Args:
        path: The file, which is replaced if it exists.
        trajectories: The trajectories.
        checks: Errors against the solver, one dictionary per trajectory; only JSON holds them.
        solver_forces: The solver's force at the same steps, one array per trajectory.

    Raises:
        ValueError: the suffix is neither `.csv` nor `.json`.
    """
    require_suffix(path, (".csv", ".json"))
    with path.open("w", newline="", encoding="utf-8") as file:
        if path.suffix == ".json":
            file.write(to_json(trajectories, checks, solver_forces) + "\n")
            return
        writer = csv.writer(file, lineterminator="\n")
        names = ["time", "indentation", "force", *_band(trajectories)]
        writer.writerow(["trajectory", *names, *(["solver_force"] if solver_forces else [])])
        for number, found in enumerate(trajectories):
            columns = [getattr(found, name) for name in names] + ([solver_forces[number]] if solver_forces else [])
            rows = zip(*(column.tolist() for column in columns), strict=True)
            writer.writerows([number, *(repr(value) if math.isfinite(value) else "" for value in row)] for row in rows)


def to_json(
    trajectories: Sequence[Any],
    checks: Sequence[dict[str, Any]] | None = None,
    solver_forces: Sequence[np.ndarray] | None = None,
) -> str:
    """Return scalars and arrays of trajectories as a JSON list; what is not finite becomes null.

    Arguments as `write_trajectories`.
    """
    content = []
    for number, found in enumerate(trajectories):
        names = ("time", "indentation", "force", *_band(trajectories))
        entry = found.summary() | {name: getattr(found, name) for name in names}
        if solver_forces:
            entry["solver_force"] = solver_forces[number]
        content.append(entry | ({"check": checks[number]} if checks else {}))
    return json.dumps(plain(content))


def _band(trajectories: Sequence[Any]) -> tuple[str, ...]:
    """Return the names of the arrays of the band, if the trajectories have one."""
    return BAND if all(getattr(found, BAND[0], None) is not None for found in trajectories) else ()


def _csv_columns(text: str, path: Path) -> tuple[dict[str, list[Any]], tuple[int, ...]]:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        numbered = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise ValueError(f"Expected comma-separated numbers under a header. Received: {path} ({error})") from error
    if not numbered:
        raise ValueError(f"Expected comma-separated numbers under a header. Received: {path}, which is empty")
    lines, rows = zip(*numbered, strict=True)
    header = [name.strip() for name in rows[0]]
    if any(NUMBER.fullmatch(name) for name in header):
        raise ValueError(f"Expected a header that names the columns. Received: numbers in the first row of {path}")
    if len(set(header)) != len(header):
        raise ValueError(f"Expected every column once. Received: {shortened(', '.join(header))} in {path}")
    for number, row in enumerate(rows[1:]):
        if len(row) != len(header):
            where = Table(path, {}, lines[1:]).where(number)
            raise ValueError(f"Expected {len(header)} values in every row. Received: {len(row)} {where}")
    return {name: [row[index] for row in rows[1:]] for index, name in enumerate(header)}, lines[1:]


def _json_columns(text: str, path: Path) -> dict[str, list[Any]]:
    try:
        content = json.loads(text, object_pairs_hook=_distinct)
    except (ValueError, RecursionError) as error:
        words = "nested too deeply" if isinstance(error, RecursionError) else error
        raise ValueError(f"Expected JSON. Received: {path} ({words})") from error
    if isinstance(content, list) and content and all(isinstance(entry, dict) for entry in content):
        for number, entry in enumerate(content):
            if set(entry) != set(content[0]):
                where = Table(path, {}).where(number)
                raise ValueError(f"Expected the same names in every object of the list. Received: others {where}")
        return {name: [entry[name] for entry in content] for name in content[0]}
    if isinstance(content, dict):
        rows = max((len(values) for values in content.values() if isinstance(values, list)), default=1)
        # A history has one Tabor parameter, which need not be repeated at every point.
        alike = (TABOR, TRAJECTORY) if "time" in content else ()
        columns = {
            name: values if isinstance(values, list) else [values] * (rows if name in alike else 1)
            for name, values in content.items()
        }
        if len({len(values) for values in columns.values()}) > 1:
            raise ValueError(f"Expected lists of equal length. Received: unequal lengths in {path}")
        return columns
    raise ValueError(f"Expected a JSON list of protocols, or an object of lists. Received: {path}")


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content: dict[str, Any] = {}
    for name, value in pairs:
        if name in content:
            raise ValueError(f"{shown(name)} twice in one object")
        content[name] = value
    return content


def _number(cell: Any) -> float:
    """Return a cell as a number; NaN if it is none, infinity if it is too large."""
    if isinstance(cell, str):
        return float(cell) if NUMBER.fullmatch(cell.strip()) else math.nan
    try:
        return float(cell) if isinstance(cell, int | float) and not isinstance(cell, bool) else math.nan
    except OverflowError:
        return math.inf
