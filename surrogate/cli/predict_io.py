"""What `surrogate predict` is asked, its predictions, and the files of both. Units as in `bem.problem.protocol`.

Input, as CSV with a header or as a JSON list of objects, a protocol each: `tabor, peak_indentation, loading_rate,
dwell_time, unloading_rate` and, for the pretrained models, `modulus_ratio`.

Output: of protocols, CSV with a row of each: the input, the scalars, of a pretrained model the ends of its intervals,
`pull_off_lower` to `hysteresis_upper`, and errors against the solver in columns `check_...`. Of steps, CSV with the
columns `trajectory, time, indentation, force`, of a pretrained model `force_lower` and `force_upper`, which are empty
outside its training, and, after a check with the solver, `solver_force`, which is empty after the end of an
unfinished simulation; or JSON, a list of objects with scalars and arrays. Numbers have full precision.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.command_line import FIRST_PROTOCOL, FIRST_TABOR
from bem._support.text_files import csv_rows, parse_json, plain, read_text
from bem._support.wording import shortened, shown
from bem.dataset.designs import QUANTITIES
from bem.problem.materials import StandardLinearSolid
from bem.problem.protocol import LoadingProtocol
from bem.problem.scene import Scene
from surrogate.cli.comparison import Answer
from surrogate.trajectory import INTERVALS
from surrogate.validity import ExtrapolationWarning

TRAJECTORY, MODULUS_RATIO = "trajectory", "modulus_ratio"
BAND = ("force_lower", "force_upper")

# Python's `float` also accepts texts such as 1_0, which no other program means as a number.
NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


@dataclass(frozen=True)
class Table:
    """Protocols, of a file or of options.

    Args:
        path: The file; that of a protocol from options has no name.
        columns: Arrays of shape `(rows,)` by name.
        lines: Line number of each row in a CSV file.
    """

    path: Path
    columns: dict[str, np.ndarray]
    lines: Sequence[int] = ()

    def where(self, row: int) -> str:
        """Return the position of a row, counted from zero, as text for a message."""
        line = f" (line {self.lines[row]})" if self.lines else ""
        return f"in row {row + 1}{line} of {self.path}"

    def protocols(self) -> list[LoadingProtocol]:
        """Return the protocols in the rows.

        Raises:
            ValueError: one is not valid; the message says where, if this is a file.
        """
        protocols = []
        for number, row in enumerate(zip(*(self.columns[name].tolist() for name in QUANTITIES), strict=True)):
            try:
                tabor = Scene(row[0]).tabor
                protocols.append(LoadingProtocol(**dict(zip(QUANTITIES[1:], row[1:], strict=True))))
                protocols[-1].history(tabor)
            except ValueError as error:
                # The sentence ends with what was received.
                raise ValueError(f"{error} {self.where(number)}" if self.path.name else str(error)) from error
        return protocols


def read_table(path: Path) -> Table:
    """Read protocols from a CSV or JSON file.

    Raises:
        FileNotFoundError: the file does not exist.
        ValueError: the suffix, the format or a column name is wrong, or a cell is not a finite number; the message says
            where.
    """
    if path.suffix not in (".csv", ".json"):
        raise ValueError(f"--in must be a file called .csv or .json; received {path}")
    if not path.is_file():
        where = "is a directory" if path.is_dir() else "does not exist"
        raise FileNotFoundError(f"--in must be a file; received {path}, which {where}")
    form = "comma-separated numbers under a header" if path.suffix == ".csv" else "a JSON list of protocols"
    try:
        text = read_text(path)
        header, rows, lines = _csv_rows(text) if path.suffix == ".csv" else _json_rows(text)
    except (ValueError, OSError) as error:
        raise ValueError(f"--in must hold {form}; received {path} ({error})") from error
    table = Table(path, {}, lines)
    if sorted({*header} - {MODULUS_RATIO}) != sorted(QUANTITIES) or len({*header}) < len(header):
        names = shortened(", ".join(header))
        raise ValueError(f"columns must be {', '.join(QUANTITIES)}, each once; received {names} in {path}")
    numbers = np.array([[_number(cell) for cell in row] for row in rows])
    for row, column in np.argwhere(~np.isfinite(numbers)):
        received = f"{shown(rows[row][column])} {table.where(row)}"
        raise ValueError(f"{header[column]} must be a finite number; received {received}")
    return replace(table, columns=dict(zip(header, numbers.T, strict=True)))


def protocols_asked(source: Path | None, options: Sequence[float | None]) -> Table:
    """Return the protocols of a file or of the options; without either, the paper's sample protocol (1).

    Raises:
        ValueError: both are given, or a protocol is not complete.
    """
    specified = {name: value for name, value in zip(QUANTITIES, options, strict=True) if value is not None}
    flags = {name: f"--{name.replace('_', '-')}" for name in QUANTITIES}
    if source is None:
        first = {} if specified.keys() - {"tabor"} else FIRST_PROTOCOL
        protocol = {"tabor": FIRST_TABOR} | first | specified
        if missing := [flags[name] for name in QUANTITIES if name not in protocol]:
            raise ValueError(f"a protocol must be complete, or in --in FILE; received no {', '.join(missing)}")
        return Table(Path(), {name: np.array([value]) for name, value in protocol.items()})
    if specified:
        both = ", ".join([f"--in {source}", *(flags[name] for name in specified)])
        raise ValueError(f"protocols must come from --in FILE or from options, not both; received {both}")
    return read_table(source)


def of_protocols(model: Any, table: Table, solid: Any, coverage: float | None) -> list[Answer]:
    """Predict protocols, on one solid or modulus ratio, unless the table has a column of such ratios."""
    protocols, tabor = table.protocols(), table.columns["tabor"]
    scenes = [_scene(*pair) for pair in zip(tabor, table.columns.get(MODULUS_RATIO, [solid] * len(tabor)), strict=True)]
    options: dict[str, Any] = {} if coverage is None else {"coverage": coverage}
    own = model.modulus_ratio
    model_scenes = scenes if own is None else [_scene(mu, own) for mu in tabor]
    # The command says it for each trajectory.
    with warnings.catch_warnings(action="ignore", category=ExtrapolationWarning):
        trajectories = model.predict(model_scenes, protocols, **options)
    return [Answer(*fields) for fields in zip(scenes, protocols, trajectories, strict=True)]


def _scene(tabor: float, solid: Any) -> Scene:
    """The scene of a solid, or of the standard linear solid of a modulus ratio."""
    ratio = isinstance(solid, int | float | np.floating)
    return Scene(float(tabor), StandardLinearSolid(modulus_ratio=float(solid)) if ratio else solid)


def write_answers(path: Path, answers: Sequence[Answer], columns: dict[str, np.ndarray] | None) -> None:
    """Write predictions as JSON, or as CSV: a row of each with `columns` of its protocol, step by step without them."""
    if path.suffix == ".json":
        path.write_text(to_json(answers) + "\n", encoding="utf-8")
    elif columns is None:
        _write_steps(path, answers)
    else:
        _write_protocols(path, columns, answers)


def _write_steps(path: Path, answers: Sequence[Answer]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        arrays = [_arrays(answer) for answer in answers]
        writer.writerow([TRAJECTORY, *arrays[0]])
        for number, columns in enumerate(arrays):
            rows = zip(*(column.tolist() for column in columns.values()), strict=True)
            writer.writerows([number, *(repr(value) if math.isfinite(value) else "" for value in row)] for row in rows)


def _write_protocols(path: Path, columns: dict[str, np.ndarray], answers: Sequence[Answer]) -> None:
    """Write what was given of protocols, the scalars of their trajectories, and the errors; empty where not finite."""
    rows = []
    for number, answer in enumerate(answers):
        predicted = answer.predicted
        row = {TRAJECTORY: number, **{name: values[number] for name, values in columns.items()}, **predicted.summary()}
        row["extrapolated"] = "; ".join(predicted.extrapolated)
        if predicted.pull_off_interval is not None:
            for name in INTERVALS:  # empty outside the training
                ends = (name.replace("interval", end) for end in ("lower", "upper"))
                row |= zip(ends, row.pop(name, (None, None)), strict=True)
        rows.append(plain(row | {f"check_{name}": value for name, value in (answer.check or {}).items()}))
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def to_json(answers: Sequence[Answer]) -> str:
    """Return scalars and arrays of trajectories as a JSON list; what is not finite becomes null."""
    entries = [
        answer.predicted.summary() | _arrays(answer) | ({"check": answer.check} if answer.check else {})
        for answer in answers
    ]
    return json.dumps(plain(entries))


def _arrays(answer: Answer) -> dict[str, np.ndarray]:
    """Return the arrays of a trajectory by name: its steps, its band if it has one, and the solver's force if asked."""
    band = BAND if getattr(answer.predicted, BAND[0], None) is not None else ()
    arrays = {name: getattr(answer.predicted, name) for name in ("time", "indentation", "force", *band)}
    return arrays if answer.solver_force is None else arrays | {"solver_force": answer.solver_force}


def _csv_rows(text: str) -> tuple[list[str], list[list[str]], list[int]]:
    """Return the header, the rows and the numbers of their lines."""
    numbered = [
        (line, row) for line, row in csv_rows(io.StringIO(text, newline=""), strict=True) if any(map(str.strip, row))
    ]
    if len(numbered) < 2:
        raise ValueError("no row of numbers")
    lines, (header, *rows) = zip(*numbered, strict=True)
    for line, row in numbered:
        if len(row) != len(header):
            raise ValueError(f"{len(row)} values in line {line}, {len(header)} in the header")
    return [name.strip() for name in header], rows, list(lines[1:])


def _json_rows(text: str) -> tuple[list[str], list[list[Any]], list[int]]:
    """Return the names and the rows of a list of objects."""
    entries = parse_json(text)
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise ValueError("another value")
    header = list(entries[0])
    for number, entry in enumerate(entries, 1):
        if entry.keys() != entries[0].keys():
            raise ValueError(f"other names in object {number} than in the first")
    return header, [[entry[name] for name in header] for entry in entries], []


def _number(cell: Any) -> float:
    """Return a cell as a number; NaN if it is none, infinity if it is too large."""
    if isinstance(cell, str):
        return float(cell) if NUMBER.fullmatch(cell.strip()) else math.nan
    try:
        return float(cell) if isinstance(cell, int | float) and not isinstance(cell, bool) else math.nan
    except OverflowError:
        return math.inf
