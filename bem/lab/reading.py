"""Read measured force curves: text files of columns, and the formats of afmformats.

A column is a name and a unit: `force (nN)`, `force [nN]`, `force/nN` or `force_nN`; `bem.lab.exporters` has the names.
Approach and retract may be two files, or paired columns of one; then the second begins where the first ends.
"""

from __future__ import annotations

import codecs
import logging
import re
import stat
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile, is_zipfile

import numpy as np

from bem._support.validation import FloatArray
from bem._support.wording import shown
from bem.lab.exporters import EXPORTERS, FACTS, PARTS
from bem.lab.units import ForceSign, factor

INSTALL = "`pip install '.[lab]'` in a clone of the repository"

_TEXT_FILES = (".csv", ".txt", ".tsv", ".dat", ".asc")
_MOST_TEXT, _MOST_BYTES = 2**26, 2**31  # bytes of text, and of an AFM file, unpacked: most formats are archives
_LONGEST_TITLE = 200  # the time of a search grows with the square of it
_HEADER_LINES = 2000  # before the first row of numbers
_TITLE = re.compile(r"\s*([^()\[\]/]*?)\s*(?:\(([^)]*)\)|\[([^\]]*)\]|/\s*(\S+))?\s*")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_MISSING = {"", "nan", "-nan", "inf", "-inf", "n/a", "#n/a", "na", "null", "none", "-", "--"}
_HEIGHTS = ("height (measured)", "height (piezo)")
_DEEPEST = (0.2, 0.05)  # parts of the path that tell the sign of the force


class InstrumentError(ValueError):
    """A file that afmformats knows lacks something of a force curve."""


@dataclass(frozen=True)
class RawCurve:
    """What a file holds of one curve, in SI, compression positive."""

    quantities: dict[str, FloatArray]
    stiffness: float | None
    """In N/m; `None` where neither file nor user names it."""
    speed: float | None = None
    """In m/s, for a curve without time."""
    position: tuple[float, float] = (np.nan, np.nan)
    """Of the curve in a map, in m; NaN where the file has none."""
    notes: tuple[str, ...] = ()
    """Sentences on how it was read."""

    def columns(self, where: str, speed: float | None = None, force_sign: ForceSign = "compression") -> dict[str, Any]:
        """Of a `ForceCurve`; `speed` (m/s) replaces the file's own, and `where` names it in messages.

        Raises:
            ValueError: a column, the stiffness or the speed is missing, or the force grows the wrong way.
        """
        quantities, compression, spring = self.quantities, self.quantities["force"], self.stiffness
        stage = quantities.get("displacement")
        if stage is None and "height" in quantities:
            stage = -quantities["height"]
        depth = quantities.get("indentation")
        if depth is None and "separation" in quantities:
            depth = -quantities["separation"]
        if stage is None and depth is None:
            raise ValueError(
                f"a force curve must have an indentation, or a displacement and a stiffness; received {where} with "
                f"{_listed(quantities)}"
            )
        if spring is not None:
            stage = depth + compression / spring if stage is None and depth is not None else stage
            depth = None if stage is None else stage - compression / spring
        if depth is None:
            raise ValueError(
                "the spring constant (stiffness, in N/m; --stiffness) must be given, which turns displacement into "
                f"indentation; received {where} without"
            )
        path = depth if stage is None else stage
        time, speed = quantities.get("time"), speed or self.speed
        if time is None:
            if speed is None:
                raise ValueError(
                    f"a force curve must have a column time, such as 'time (s)', or a speed; received {where} without"
                )
            time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path)))]) / speed
        elif time[0] > time[-1]:  # stored from the end on
            order = np.argsort(time, kind="stable")
            time, depth, compression, path = time[order], depth[order], compression[order], path[order]
            stage = None if stage is None else stage[order]
        _check_sign(path, compression, force_sign, where)
        force = compression if force_sign == "compression" else -compression
        notes = (*self.notes, f"Force counted as positive in {force_sign}.")
        radius = quantities.get("contact_radius")
        further = {"contact_radius": radius, "stage": stage, "force_sign": force_sign, "notes": notes}
        return {"time": time, "indentation": depth, "force": force, **further}


def raw_curves(
    paths: Sequence[Path],
    stiffness: float | None,
    force_sign: ForceSign | None,
    columns: Mapping[str, str],
    sensitivity: float | None = None,
) -> tuple[list[RawCurve], ForceSign]:
    """All curves of an AFM file, or the one of text files, and the sign of their forces; see `ForceCurve.read`."""
    if len(paths) == 1 and paths[0].suffix.lower() not in _TEXT_FILES:
        return load_afm(paths[0], stiffness, sensitivity), force_sign or "compression"
    try:
        raw, sign = _joined([_text_curve(path, columns, stiffness, sensitivity) for path in paths], paths)
    except ValueError as error:
        # Instruments write text of their own, which afmformats may know.
        try:
            if len(paths) == 1 and (curves := load_afm(paths[0], stiffness, sensitivity)):
                return curves, force_sign or "compression"
        except InstrumentError as other:
            raise ValueError(f"{error}; as a file of an instrument: {other}") from other
        except ValueError:
            pass
        raise
    if force_sign is not None and force_sign != sign:
        raw.quantities["force"] = -raw.quantities["force"]
    return [raw], force_sign or sign


def load_afm(path: str | Path, stiffness: float | None = None, sensitivity: float | None = None) -> list[RawCurve]:
    """Read all force curves of an AFM file.

    afmformats gives SI units, compression positive, and a height or tip position that grows away from the sample. A
    given spring constant (N/m) or sensitivity (m/V) replaces the file's own, and the force changes with it.

    Raises:
        ValueError: afmformats is not installed, or the file is not one it reads.
        FileNotFoundError: there is no such file.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(2, "No such file or directory", str(path))
    if not path.is_file():
        what = "a directory" if path.is_dir() else "not a regular file"
        raise ValueError(f"path must be a text or an AFM file; received {path}, which is {what}")
    try:
        import afmformats
    except ImportError as error:
        raise ValueError(
            f"files such as {path} need afmformats, from {INSTALL}; received a file that is no CSV"
        ) from error
    # The library logs whole tracebacks, which Python prints to the terminal where nobody handles them.
    logging.getLogger("afmformats").addHandler(logging.NullHandler())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with ZipFile(path) if is_zipfile(path) else nullcontext() as archive:
                size = sum(part.file_size for part in archive.infolist()) if archive else path.stat().st_size
            if size > _MOST_BYTES:
                raise ValueError(f"{size} bytes, more than {_MOST_BYTES}")
            values = {"spring constant": stiffness, "sensitivity": sensitivity}
            given = {name: value for name, value in values.items() if value is not None}
            try:
                curves = afmformats.load_data(path, meta_override=dict(given))
            except NotImplementedError:  # some of its readers take none
                curves = afmformats.load_data(path)
            return [_converted(curve, given, path) for curve in curves]
    except InstrumentError:
        raise
    # Its own errors are no `Exception`, and each of its readers raises others.
    except afmformats.errors.MissingMetaDataError as error:
        raise InstrumentError(
            f"Expected an AFM file with its metadata, or --stiffness in N/m and --sensitivity in m/V; received {path} "
            f"({shown(str(error))})"
        ) from error
    except (Exception, afmformats.errors.AFMFileFormatError) as error:
        raise ValueError(
            f"Expected a CSV or an AFM file that afmformats reads; received {path} ({shown(str(error))})"
        ) from error


def _converted(curve: Any, given: Mapping[str, float], path: Path) -> RawCurve:
    names = ("force", "time", *_HEIGHTS, "tip position")
    found = {name: np.asarray(curve[name], dtype=np.float64) for name in names if name in curve.columns}
    if "force" not in found:
        raise InstrumentError(f"Expected an AFM file with force; received {path} with {sorted(found)}")
    spring, speed = (float(curve.metadata.get(name) or np.nan) for name in ("spring constant", "speed approach"))
    spring = given.get("spring constant", spring)
    for name, value in given.items():
        found["force"] = found["force"] * (value / float(curve.metadata.get(name) or value))
    quantities: dict[str, FloatArray] = {name: found[name] for name in ("force", "time") if name in found}
    heights = [found[name] for name in _HEIGHTS if name in found]
    if heights and np.isfinite(spring):
        quantities["height"] = heights[0]
    elif "tip position" in found:
        quantities["indentation"] = -found["tip position"]
    else:
        raise InstrumentError(
            f"Expected an AFM file with height and spring constant, or tip position; received {path}; stiffness gives "
            "the spring constant"
        )
    x, y = (float(curve.metadata.get(f"position {axis}", np.nan)) for axis in "xy")
    spring_used, speed_known = spring if "height" in quantities else None, speed if np.isfinite(speed) else None
    return RawCurve(quantities, spring_used, speed_known, (x, y), ("Read by afmformats; compression positive.",))


def _check_sign(path: FloatArray, compression: FloatArray, force_sign: ForceSign, where: str) -> None:
    """Refuse a curve whose tension grows with depth where it is deepest: its sign convention is the other one.

    `path` is the displacement if there is one, since an indentation computed from it follows the force. Both parts of
    the path must agree: a contact that snaps in within one of them has tension that grows there.
    """
    if not np.ptp(path) > 0.0:
        raise ValueError(f"a force curve must move; received {where}, whose path stays at {path[0]:.4g} m")
    approach = np.arange(path.size) <= np.argmax(path)
    agree = []
    for share in _DEEPEST:
        deep = approach & (path > path.max() - share * np.ptp(path))
        depth, tension = path[deep] - path[deep].mean(), compression[deep].mean() - compression[deep]
        together = depth @ tension > 0.8 * np.linalg.norm(depth) * np.linalg.norm(tension) > 0.0
        agree.append(together and np.count_nonzero(deep) >= 3)
    if all(agree):
        other = "compression" if force_sign == "tension" else "tension"
        raise ValueError(
            f"the tension in {where} grows with depth, which no contact does; the file was read with "
            f"force_sign={force_sign!r} and should be {other!r}"
        )


def _listed(quantities: Mapping[str, FloatArray]) -> str:
    """The columns that were read, in words."""
    return ", ".join(sorted(quantities)) or "no column of a known name"


def _joined(parts: Sequence[tuple[RawCurve, ForceSign]], paths: Sequence[Path]) -> tuple[RawCurve, ForceSign]:
    """The curve of text files in a row; times that begin before the last file ended are moved behind it."""
    (first, sign), quantities = parts[0], [dict(part.quantities) for part, _ in parts]
    for before, part, path in zip(quantities, quantities[1:], paths[1:], strict=False):
        if set(part) != set(before):
            raise ValueError(f"the files of one curve must have the same columns; received {path} with {_listed(part)}")
        _follow(before, part)
    whole = {name: np.concatenate([part[name] for part in quantities]) for name in quantities[0]}
    return replace(first, quantities=whole), sign


def _follow(before: dict[str, FloatArray], part: dict[str, FloatArray]) -> None:
    """Move the times of a part behind those of the part before it."""
    if "time" in part and part["time"][0] < (end := before["time"][-1]):
        time = part["time"]
        part["time"] = time - time[0] + end + (float(np.median(np.diff(time))) if time.size > 1 else 0.0)


def _text_curve(
    path: Path, renamed: Mapping[str, str], stiffness: float | None, sensitivity: float | None
) -> tuple[RawCurve, ForceSign]:
    """The curve of a text file, and the sign in which its force was written."""
    titles, units, rows, facts, dropped = _table(path)
    exporter, parts = _named([renamed.get(title.strip(), title) for title in titles], units, rows, path)
    spring, volts = (_fact(facts, name) for name in ("stiffness", "sensitivity"))
    for part in parts:
        if "deflection_in_volts" in part:
            if (per_volt := sensitivity or volts) is None:
                raise ValueError(f"sensitivity (m/V; --sensitivity) must be given for volts; received {path} without")
            part["deflection"] = part.pop("deflection_in_volts") * per_volt
        elif sensitivity is not None:
            raise ValueError(f"sensitivity turns volts into a force; received {path}, which has no volts")
        if "force" not in part and "tension" not in part:
            if "deflection" not in part or (constant := stiffness or spring) is None:
                needed = "a column force, such as 'force (nN)', or a deflection and the spring constant (--stiffness)"
                raise ValueError(f"a force curve must have {needed}; received {path} with {_listed(part)}")
            part["force"] = part["deflection"] * constant
        elif stiffness and spring:
            name = "force" if "force" in part else "tension"
            part[name] = part[name] * (stiffness / spring)
        part.pop("deflection", None)
    sign: ForceSign = "tension" if "tension" in parts[0] else "compression"
    for part in parts:
        if sign == "tension":
            part["force"] = -part.pop("tension")
    if "z" in parts[0]:
        towards = _grows(parts[0]["z"], parts[0]["force"])
        for part in parts:
            part["displacement"] = part.pop("z") * (1.0 if towards else -1.0)
    if len(parts) > 1:
        place = next(
            (name for name in ("displacement", "height", "indentation", "separation") if name in parts[0]), None
        )
        if place and "time" not in parts[1] and _away(parts, place):
            parts[1] = {name: values[::-1] for name, values in parts[1].items()}
        _follow(*parts[:2])
    quantities = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    if quantities["force"].size < 2:
        raise ValueError(f"a file must have a header and at least two rows of numbers; received {path}")
    notes = [f"Columns of {exporter}: {_listed(quantities)}."]
    notes += [f"{dropped} rows without numbers were left out."] if dropped else []
    used = stiffness or (spring if "displacement" in quantities or "height" in quantities else None)
    return RawCurve(quantities, used, notes=tuple(notes)), sign


def _grows(place: FloatArray, compression: FloatArray) -> bool:
    """Whether the larger half of the forces lies at the larger places."""
    strong = np.abs(compression - np.median(compression)) > 0.5 * np.abs(compression - np.median(compression)).max()
    return bool(place[strong].mean() > place.mean())


def _away(parts: Sequence[Mapping[str, FloatArray]], place: str) -> bool:
    """Whether a retraction is stored from its far end on: that end is nearer to the start of the approach."""
    turn, begin, end = parts[0][place][-1], parts[1][place][0], parts[1][place][-1]
    return bool(abs(begin - turn) > abs(end - turn))


def _fact(facts: Mapping[str, str], name: str) -> float | None:
    """A number of the lines before the table; `None` where there is none."""
    for title in FACTS[name]:
        match = _NUMBER.match(facts.get(title.lower(), "").replace(",", "."))
        if match and float(match[0]) > 0.0:
            return float(match[0]) * (1e-9 if "nm/v" in title.lower() else 1.0)
    return None


def _named(
    titles: Sequence[str], units: Sequence[str], rows: FloatArray, path: Path
) -> tuple[str, list[dict[str, FloatArray]]]:
    """The exporter that knows most titles, and the columns in SI, of one part or of approach and retraction."""
    parsed = [_parsed(title) for title in titles]
    known = {exporter: [name in table for name, _, _ in parsed].count(True) for exporter, table in EXPORTERS.items()}
    exporter = max(EXPORTERS, key=lambda each: (known[each], each == "generic"))
    table = EXPORTERS["generic"] | EXPORTERS[exporter]
    parts: dict[str, dict[str, FloatArray]] = {}
    for number, (name, unit, part) in enumerate(parsed):
        quantity, usual = table.get(name, ("", ""))
        unit = unit or (units[number] if number < len(units) else "") or usual
        columns = parts.setdefault(part, {}) if quantity else {}
        if not quantity or (quantity in columns and exporter != "generic"):
            continue
        title = f"column {shown(titles[number])} of {path}"
        if quantity in columns:
            raise ValueError(f"a file must have one column {quantity}; received several in {path}")
        if not unit:
            raise ValueError(f"a column must name its unit, such as 'force (nN)'; received {title}")
        if quantity in ("deflection", "force") and unit == "V":
            columns["deflection_in_volts"] = rows[:, number]
            continue
        dimension = {"time": "time", "force": "force", "tension": "force"}.get(quantity, "length")
        columns[quantity] = factor(title, unit, dimension) * rows[:, number]
    ordered = [parts[part] for part in ("", *PARTS) if part in parts]
    if not any(ordered):
        raise ValueError(
            f"a force curve must have a column force, such as 'force (nN)'; received {path} with no column of a known "
            "name"
        )
    if len(ordered) > 1 and "" in parts:  # columns that both parts share, such as a place
        ordered = [parts[""] | part for part in ordered[1:]]
    # Paired columns of unequal length are filled up with nothing.
    finite = [np.all([np.isfinite(values) for values in part.values()], axis=0) for part in ordered]
    return exporter, [
        {name: values[keep] for name, values in part.items()} for part, keep in zip(ordered, finite, strict=True)
    ]


def _parsed(title: str) -> tuple[str, str, str]:
    """Name of a column, in lower case with underscores, its unit, and the part of a pair that it belongs to."""
    match = _TITLE.fullmatch(title.strip().strip('"')) if len(title) <= _LONGEST_TITLE else None
    if match is None:
        return "", "", ""
    name, unit = match[1].lower(), next((group.strip() for group in match.groups()[1:] if group), "")
    name, part = re.sub(r"[\s_\-.]+", "_", name).strip("_"), ""
    for which, words in PARTS.items():
        for word in words:
            if re.search(rf"(?:^|_){word}(?:_|$)", name):
                name, part = re.sub(rf"(?:^|_){word}(?=_|$)", "", name).strip("_"), which
    if not any(name in table for table in EXPORTERS.values()) and not unit:
        # The unit is the last piece of the title, or the last before a word such as Ex.
        pieces = [
            piece for piece in re.split(r"[\s_]+", match[1].strip()) if piece.lower() not in sum(PARTS.values(), ())
        ]
        name, unit = "_".join(pieces[:-1]).lower(), pieces[-1] if pieces else ""
    return name, unit, part


def _table(path: Path) -> tuple[list[str], list[str], FloatArray, dict[str, str], int]:
    """Titles, units of a line of their own, numbers (n, m) with NaN for nothing, facts, and rows that were left out."""
    lines = _decoded(path).splitlines()
    separator, start = _first_row(lines)
    if start is None:
        raise ValueError(f"a file must have a header and at least two rows of numbers; received {path}")
    count, titles, units, facts = len(_cells(lines[start], separator)), [""], [""], {}
    for line in lines[:start]:
        text = line.lstrip("# \t")
        key, _, value = text.partition(":") if line.startswith("#") else text.partition(separator or "\t")
        facts[key.strip().lower()] = value.strip().strip('"')
        if key.strip().lower() == "units":
            units = value.split()
        elif key.strip().lower() in ("columns", "fancynames"):
            titles = value.split() if '"' not in value or len(titles) > 1 else re.findall(r'"([^"]*)"', value)
        elif len(cells := _cells(text, separator)) == count and not all(map(_is_number, cells)):
            titles = cells
    rows, dropped = [], 0
    for number, line in enumerate(lines[start:], 1):
        if line.startswith("#"):
            continue
        cells = _cells(line, separator)
        values = np.full(count, np.nan)
        for n, cell in enumerate(cells[:count]):
            if _is_number(cell):
                values[n] = float(cell.replace(",", "."))
            elif cell.strip().lower() not in _MISSING:
                raise ValueError(
                    f"a row must hold numbers; received {shown(cell)} in column {n + 1} of row {number} of {path}"
                )
        if np.isfinite(values).any():
            rows.append(values)
        else:
            dropped += 1
    table = np.array(rows)
    several = any(_parsed(title)[2] for title in titles)
    known = [n for n, title in enumerate(titles[:count]) if title]
    whole = np.isfinite(table[:, known]).all(axis=1) | several
    return titles, units, table[whole], facts, dropped + int(np.count_nonzero(~whole))


def _first_row(lines: Sequence[str]) -> tuple[str | None, int | None]:
    """Separator and number of the first of two rows of numbers."""
    for number, line in enumerate(lines[:_HEADER_LINES]):
        if line.startswith("#") or not line.strip():
            continue
        for separator in (";", "\t", ",", None):
            cells = _cells(line, separator)
            if len(cells) > 1 and sum(map(_is_number, cells)) > 1 and all(
                _is_number(cell) or cell.strip().lower() in _MISSING for cell in cells
            ):  # fmt: skip
                return separator, number
    return None, None


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip().strip('"') for cell in (line.split() if separator is None else line.split(separator))]


def _is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell.strip().replace(",", ".", 1)) is not None


def _decoded(path: Path) -> str:
    """The text of a file in UTF-8, UTF-16 or the encoding of Windows in the west."""
    if path.is_dir():
        raise ValueError(f"path must be a text file of columns; received {path}, which is a directory")
    if not stat.S_ISREG(path.stat().st_mode):
        raise ValueError(f"path must be a text file of columns; received {path}, which is not a regular file")
    with path.open("rb") as file:
        data = file.read(_MOST_TEXT + 1)
    if len(data) > _MOST_TEXT:
        raise ValueError(f"a text file must have at most {_MOST_TEXT} bytes; received {path}, which has more")
    wide = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    wide_without_mark = not wide and len(data) > 20 and data[1:400:2].count(0) > 0.9 * len(data[1:400:2])
    encodings = ("utf-16",) if wide else ("utf-16-le",) if wide_without_mark else ("utf-8-sig", "cp1252", "latin-1")
    for encoding in encodings:
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise ValueError(f"a file must be text in UTF-8, UTF-16 or Latin-1; received {path}, which is not")
