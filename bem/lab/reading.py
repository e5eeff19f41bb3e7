"""Read measured force curves: CSV files whose columns name their units, and AFM formats.

A column is a name and a unit: `force (nN)`, `force [nN]`, `force/nN` or `force_nN`. Known names are time, indentation
or depth, displacement or position (of the stage, positive towards the sample), height (of the stage, positive away from
it), force or load, contact_radius, and segment. Approach and retract may be two files; then the second begins where the
first ends.
"""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bem._support.validation import FloatArray, finite_number
from bem._support.wording import shown
from bem.lab.afm_files import read_afm
from bem.lab.curve import ForceCurve, ForceSign, require_sign
from bem.lab.units import Quantity, factor, to_si

TEXT_FILES = (".csv", ".txt", ".tsv", ".dat")

_ALIASES = {
    "time": ("time", "t"),
    "indentation": ("indentation", "depth"),
    "displacement": ("displacement", "position", "stage"),
    "height": ("height", "piezo"),
    "force": ("force", "load"),
    "contact_radius": ("contact_radius", "contact radius"),
}
_DIMENSION = {"time": "time", "force": "force"}
_NUMBER = re.compile(r"\s*[-+]?\.?\d")
_COLUMN = re.compile(r"\s*([A-Za-z][A-Za-z _]*?)\s*(?:\(([^)]*)\)|\[([^\]]*)\]|/\s*(\S+)|_([^\s_]+))?\s*")


def read(
    path: str | Path | Sequence[str | Path],
    *,
    stiffness: Quantity | None = None,
    force_sign: ForceSign = "tension",
    columns: Mapping[str, str] | None = None,
    speed: Quantity | None = None,
) -> ForceCurve:
    """Read a force curve.

    Args:
        path: A CSV file, an AFM file, or approach and retract as two CSV files.
        stiffness: Of cantilever or machine, in N/m. It turns the stage's displacement into indentation: displacement
            minus compression over stiffness. Required where the file has no indentation.
        force_sign: Which force the file counts as positive.
        columns: What a column that is named otherwise holds, for example `{"F_n (mN)": "force (mN)"}`.
        speed: Of the stage, in m/s, for files without time.

    Returns:
        The curve in SI, in the file's sign.

    Raises:
        ValueError: a column is missing, a unit does not fit, a number cannot be read, or the force grows the wrong way.
        FileNotFoundError: there is no such file.
    """
    require_sign(force_sign)
    spring = (
        None if stiffness is None else finite_number("stiffness", to_si("stiffness", stiffness, "stiffness"), above=0.0)
    )
    paths = [Path(path)] if isinstance(path, str | Path) else [Path(part) for part in path]
    if len(paths) == 1 and paths[0].suffix.lower() not in TEXT_FILES:
        quantities, spring, sign = read_afm(paths[0], spring)
        curve = _curve(quantities, spring, sign, None, str(paths[0]))
        return _checked(curve.with_sign(force_sign), str(paths[0]))
    if len({part.resolve() for part in paths}) < len(paths):
        raise ValueError(f"the files of one curve must be different; received {' and '.join(map(str, paths))}")
    parts = [_quantities(part, columns or {}) for part in paths]
    names = set(parts[0])
    for part, name in zip(parts, paths, strict=True):
        if set(part) != names:
            raise ValueError(f"the files of one curve must have the same columns; received {name} with {_listed(part)}")
    joined = {name: np.concatenate([part[name] for part in parts]) for name in names if name != "time"}
    if "time" in names:
        joined["time"] = _one_time([part["time"] for part in parts])
    rate = None if speed is None else finite_number("speed", to_si("speed", speed, "speed"), above=0.0)
    where = " and ".join(map(str, paths))
    return _checked(_curve(joined, spring, force_sign, rate, where), where)


def _curve(
    quantities: dict[str, FloatArray], stiffness: float | None, force_sign: ForceSign, speed: float | None, where: str
) -> ForceCurve:
    if "force" not in quantities:
        raise ValueError(f"Expected a column force, such as 'force (nN)'; received {where} with {_listed(quantities)}")
    if "height" in quantities and "displacement" not in quantities:
        quantities["displacement"] = -quantities["height"]
    if "indentation" in quantities:
        if stiffness is not None and "displacement" not in quantities:
            raise ValueError(f"stiffness turns a displacement into an indentation; received {where}, which has none")
        depth = path = quantities["indentation"]
    elif "displacement" not in quantities:
        raise ValueError(
            f"Expected a column indentation, or displacement and a stiffness; received {where} with "
            f"{_listed(quantities)}"
        )
    elif stiffness is None:
        raise ValueError(
            f"Expected the stiffness (N/m) that turns displacement into indentation; received {where} without"
        )
    else:
        path = quantities["displacement"]
        compression = quantities["force"] if force_sign == "compression" else -quantities["force"]
        depth = path - compression / stiffness
    if "time" not in quantities:
        if speed is None:
            raise ValueError(f"Expected a column time, such as 'time (s)', or a speed; received {where} without")
        quantities["time"] = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path)))]) / speed
    return ForceCurve(
        time=quantities["time"],
        indentation=depth,
        force=quantities["force"],
        contact_radius=quantities.get("contact_radius"),
        force_sign=force_sign,
        stage=quantities.get("displacement"),
    )


def _checked(curve: ForceCurve, where: str) -> ForceCurve:
    """Refuse a curve whose force falls with depth where it is deepest: its sign convention is the other one."""
    deepest = int(np.argmax(curve.indentation))
    low, high = float(np.min(curve.indentation)), float(np.max(curve.indentation))
    deep = curve.indentation[: deepest + 1] > 0.5 * (low + high)
    if high > low and np.count_nonzero(deep) >= 3:
        depth, tension = curve.indentation[: deepest + 1][deep], curve.tension[: deepest + 1][deep]
        depth = depth - depth.mean()
        slope, spread = float(depth @ tension), float(np.linalg.norm(depth) * np.linalg.norm(tension - tension.mean()))
        if slope > 0.8 * spread > 0.0:
            other = "compression" if curve.force_sign == "tension" else "tension"
            raise ValueError(
                f"the tension in {where} grows with depth, which no contact does; the file was read with "
                f"force_sign={curve.force_sign!r} and should be {other!r}"
            )
    return curve


def _listed(quantities: Mapping[str, FloatArray]) -> str:
    """The columns that were found, in words."""
    return ", ".join(sorted(quantities)) or "no column of a known name in its first line"


def _one_time(times: list[FloatArray]) -> FloatArray:
    """The times of several files in a row; a file that begins before the last ended is moved behind it."""
    joined = [times[0]]
    for later in times[1:]:
        end = joined[-1][-1]
        step = float(np.median(np.diff(later))) if later.size > 1 else 0.0
        joined.append(later if later[0] >= end else later - later[0] + end + step)
    return np.concatenate(joined)


def _quantities(path: Path, columns: Mapping[str, str]) -> dict[str, FloatArray]:
    """The known columns of a file, in SI."""
    header, rows = _table(path)
    found: dict[str, FloatArray] = {}
    for number, title in enumerate(header):
        name, unit = _parsed(columns.get(title.strip(), title))
        if name is None:
            continue
        if name in found:
            raise ValueError(f"Expected one column {name}; received several in {path}")
        if not unit:
            raise ValueError(f"a column must name its unit, such as 'force (nN)'; received {shown(title)} in {path}")
        scale = factor(f"column {shown(title)} of {path}", unit, _DIMENSION.get(name, "length"))
        found[name] = scale * _numbers(rows, number, title, path)
    return found


def _table(path: Path) -> tuple[list[str], list[list[str]]]:
    if path.is_dir():
        raise ValueError(f"Expected a text file of columns; received {path}, which is a directory")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"Expected a text file of columns; received {path}, which is not UTF-8 text") from error
    written = [line for line in text.splitlines() if line.strip()]
    lines = [line for line in written if not line.startswith("#")]
    comments = [line.lstrip("# ") for line in itertools.takewhile(lambda line: line.startswith("#"), written)]
    # A header may be a comment, as NumPy writes it; other comments are left out.
    if comments and lines and _NUMBER.match(lines[0]):
        lines.insert(0, comments[-1])
    if len(lines) < 3:
        raise ValueError(f"Expected a header and at least two rows; received {path} with {len(lines)} lines")
    separator = max(",;\t", key=lines[0].count)
    if separator == ";":
        lines = [line.replace(",", ".") for line in lines]
    header, *rows = csv.reader(lines, delimiter=separator)
    return header, rows


def _parsed(title: str) -> tuple[str | None, str]:
    """Name and unit of a column; the name is `None` where it is not known."""
    match = _COLUMN.fullmatch(title)
    if match is None:
        return None, ""
    plain = match[1].strip().lower()
    unit = next((group.strip() for group in match.groups()[1:] if group), "")
    for name, aliases in _ALIASES.items():
        if plain in aliases or plain.replace(" ", "_") in aliases:
            return name, unit
    # `contact_radius` without a unit looks like a name and a unit.
    return ("contact_radius", "") if title.strip().lower() == "contact_radius" else (None, "")


def _numbers(rows: list[list[str]], number: int, title: str, path: Path) -> FloatArray:
    values = np.empty(len(rows))
    for line, row in enumerate(rows):
        try:
            values[line] = float(row[number])
        except (ValueError, IndexError) as error:
            received = shown(row[number]) if number < len(row) else "nothing"
            raise ValueError(
                f"Expected numbers in column {shown(title)} of {path}; received {received} in row {line + 1}"
            ) from error
    if not np.all(np.isfinite(values)):
        raise ValueError(
            f"Expected finite numbers in column {shown(title)} of {path}; received "
            f"{shown(float(values[~np.isfinite(values)][0]))}"
        )
    return values
