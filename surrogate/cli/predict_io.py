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
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.text_files import csv_rows, parse_json, plain, read_text
from bem._support.wording import shortened, shown
from bem.dataset.designs import QUANTITIES
from bem.problem.materials import StandardLinearSolid
from bem.problem.protocol import LoadingProtocol
from bem.problem.scene import Scene
from surrogate.cli.comparison import Answer
from surrogate.trajectory import INTERVALS
from surrogate.validity import ExtrapolationWarning

if TYPE_CHECKING:
    from surrogate.model import Surrogate

TRAJECTORY, MODULUS_RATIO = "trajectory", "modulus_ratio"
BAND = ("force_lower", "force_upper")

# Python's `float` also accepts texts such as 1_0, which no other program means as a number.
NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


@dataclass(frozen=True)
class Table:
    """Content of an input file: columns of equal length, by name.

    Args:
        path: The file; that of a protocol from options has no name.
        columns: Arrays of numbers of shape `(rows,)`, or lists of unconverted cells while the file is read.
        lines: Line number of each row in a CSV file.
    """

    path: Path
    columns: dict[str, Any]
    lines: tuple[int, ...] = ()

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

    def require(self, expected: str, wrong: np.ndarray, received: Callable[[int], str]) -> None:
        """Raise a `ValueError` about the first row that is wrong, if one is."""
        if (bad := np.flatnonzero(wrong)).size:
            raise ValueError(f"{expected}; received {received(bad[0])} {self.where(bad[0])}")


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
    try:
        text = read_text(path)
    except (ValueError, OSError) as error:
        raise ValueError(f"--in must be text in UTF-8 that can be read; received {path} ({error})") from error
    read = _csv_table(text, path) if path.suffix == ".csv" else _json_table(text, path)
    if set(read.columns) - {MODULUS_RATIO} != {*QUANTITIES}:
        names = shortened(", ".join(sorted(read.columns)))
        raise ValueError(f"columns must be {', '.join(QUANTITIES)}; received {names} in {path}")
    if not all(read.columns.values()):
        raise ValueError(f"--in must hold a row of numbers; received {path}, which has none")
    columns = {}
    for name, cells in read.columns.items():
        columns[name] = values = np.array([_number(cell) for cell in cells])
        read.require(f"{name} must be finite numbers", ~np.isfinite(values), lambda row: shown(cells[row]))  # noqa: B023
    return replace(read, columns=columns)


def asked(source: Path | None, options: Sequence[float | None]) -> Table:
    """Return the protocols of a file or of the options.

    Raises:
        ValueError: both or neither are given.
    """
    specified = {name: value for name, value in zip(QUANTITIES, options, strict=True) if value is not None}
    flags = {name: f"--{name.replace('_', '-')}" for name in QUANTITIES}
    if source is None:
        if missing := [flags[name] for name in QUANTITIES if name not in specified]:
            raise ValueError(f"a protocol must be complete, or in --in FILE; received no {', '.join(missing)}")
        return Table(Path(), {name: np.array([value]) for name, value in specified.items()})
    if specified:
        both = ", ".join([f"--in {source}", *(flags[name] for name in specified)])
        raise ValueError(f"protocols must come from --in FILE or from options, not both; received {both}")
    return read_table(source)


def of_protocols(model: Surrogate, table: Table, ratio: float, coverage: float | None) -> list[Answer]:
    """Predict protocols, on solids of one modulus ratio, unless the table has a column of them."""
    protocols, tabor = table.protocols(), table.columns["tabor"]
    scenes = [_scene(*pair) for pair in zip(tabor, table.columns.get(MODULUS_RATIO, [ratio] * len(tabor)), strict=True)]
    model_scenes = scenes if model.modulus_ratio is None else [_scene(mu, model.modulus_ratio) for mu in tabor]
    # The command says it for each trajectory.
    with warnings.catch_warnings(action="ignore", category=ExtrapolationWarning):
        trajectories = model.predict(model_scenes, protocols, coverage=0.9 if coverage is None else coverage)
    return [Answer(*fields) for fields in zip(scenes, protocols, trajectories, strict=True)]


def _scene(tabor: float, modulus_ratio: float) -> Scene:
    return Scene(float(tabor), StandardLinearSolid(modulus_ratio=float(modulus_ratio)))


def write_trajectories(path: Path, answers: Sequence[Answer]) -> None:
    """Write trajectories step by step, with the solver's force, as CSV, or with scalars and errors too, as JSON."""
    with path.open("w", newline="", encoding="utf-8") as file:
        if path.suffix == ".json":
            file.write(to_json(answers) + "\n")
            return
        writer = csv.writer(file, lineterminator="\n")
        arrays = [_arrays(answer) for answer in answers]
        writer.writerow([TRAJECTORY, *arrays[0]])
        for number, columns in enumerate(arrays):
            rows = zip(*(column.tolist() for column in columns.values()), strict=True)
            writer.writerows([number, *(repr(value) if math.isfinite(value) else "" for value in row)] for row in rows)


def write_protocols(path: Path, columns: dict[str, np.ndarray], answers: Sequence[Answer]) -> None:
    """Write as CSV, a row of each, what was given of protocols, the scalars of their trajectories, and the errors.

    What is not finite is left empty.
    """
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


def _csv_table(text: str, path: Path) -> Table:
    expected = "--in must hold comma-separated numbers under a header"
    try:
        parsed = csv_rows(io.StringIO(text, newline=""), strict=True)
    except ValueError as error:
        raise ValueError(f"{expected}; received {path} ({error})") from error
    numbered = [(line, row) for line, row in parsed if any(cell.strip() for cell in row)]
    if not numbered:
        raise ValueError(f"{expected}; received {path}, which is empty")
    lines, (first, *rows) = zip(*numbered, strict=True)
    header = [name.strip() for name in first]
    if any(NUMBER.fullmatch(name) for name in header):
        raise ValueError(f"the header must name the columns; received numbers in the first row of {path}")
    if len(set(header)) != len(header):
        raise ValueError(f"every column must stand once; received {shortened(', '.join(header))} in {path}")
    table = Table(path, {name: [row[at] for row in rows if at < len(row)] for at, name in enumerate(header)}, lines[1:])
    lengths = np.array([len(row) for row in rows])
    table.require(f"every row must have {len(header)} values", lengths != len(header), lambda row: str(lengths[row]))
    return table


def _json_table(text: str, path: Path) -> Table:
    try:
        entries = parse_json(text, object_pairs_hook=_distinct)
    except ValueError as error:
        raise ValueError(f"--in must be JSON; received {path} ({error})") from error
    if isinstance(entries, list) and entries and all(isinstance(entry, dict) for entry in entries):
        differing = np.array([set(entry) != set(entries[0]) for entry in entries])
        Table(path, {}).require("every object of the list must have the same names", differing, lambda _: "others")
        return Table(path, {name: [entry[name] for entry in entries] for name in entries[0]})
    raise ValueError(f"--in must be a JSON list of protocols; received {path}")


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members: dict[str, Any] = {}
    for name, value in pairs:
        if name in members:
            raise ValueError(f"{shown(name)} twice in one object")
        members[name] = value
    return members


def _number(cell: Any) -> float:
    """Return a cell as a number; NaN if it is none, infinity if it is too large."""
    if isinstance(cell, str):
        return float(cell) if NUMBER.fullmatch(cell.strip()) else math.nan
    try:
        return float(cell) if isinstance(cell, int | float) and not isinstance(cell, bool) else math.nan
    except OverflowError:
        return math.inf
