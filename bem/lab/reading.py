"""Read measured force curves: CSV files whose columns name their units, and the formats of afmformats.

A column is a name and a unit: `force (nN)`, `force [nN]`, `force/nN` or `force_nN`. Known names are time, indentation
or depth, displacement or position (of the stage, positive towards the sample), height (of the stage, positive away from
it), force or load, contact_radius, and segment. Approach and retract may be two files; then the second begins where the
first ends.
"""

from __future__ import annotations

import itertools
import logging
import re
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import ZipFile, is_zipfile

import numpy as np

from bem._support.text_files import csv_rows, read_text
from bem._support.validation import FloatArray
from bem._support.wording import shown
from bem.lab.units import ForceSign, factor

INSTALL = "`pip install '.[lab]'` in a clone of the repository"

_TEXT_FILES = (".csv", ".txt", ".tsv", ".dat")
_NAMES = {"t": "time", "depth": "indentation", "position": "displacement", "stage": "displacement", "piezo": "height"}
_NAMES |= {"load": "force"}
_NAMES |= {name: name for name in ("time", "indentation", "displacement", "height", "force", "contact_radius")}
_LONGEST_TITLE = 200  # the time of a search grows with the square of it
_NUMBER = re.compile(r"\s*[-+]?\.?\d")
_COLUMN = re.compile(r"\s*([A-Za-z][A-Za-z _]*?)\s*(?:\(([^)]*)\)|\[([^\]]*)\]|/\s*(\S+)|_([^\s_]+))?\s*")
_MOST_BYTES = 2**31  # of an AFM file, unpacked: most formats are archives
_HEIGHTS = ("height (measured)", "height (piezo)")
_DEEPEST = (0.2, 0.05)  # parts of the path that tell the sign of the force


class InstrumentError(ValueError):
    """A file that afmformats knows lacks something of a force curve."""


@dataclass(frozen=True)
class RawCurve:
    """What a file holds of one curve, in SI, compression positive."""

    quantities: dict[str, FloatArray]
    stiffness: float | None
    """In N/m; `None` where the indentation needs none."""
    speed: float | None = None
    """In m/s, for a curve without time."""
    position: tuple[float, float] = (np.nan, np.nan)
    """Of the curve in a map, in m; NaN where the file has none."""

    def columns(self, where: str, speed: float | None = None, force_sign: ForceSign = "compression") -> dict[str, Any]:
        """Of a `ForceCurve`; `speed` (m/s) replaces the file's own, and `where` names it in messages.

        Raises:
            ValueError: a column, the stiffness or the speed is missing, or the force grows the wrong way.
        """
        found, compression = self.quantities, self.quantities["force"]
        stage = found.get("displacement", -found["height"] if "height" in found else None)
        path = found.get("indentation", stage)
        if path is None:
            raise ValueError(
                f"Expected a column indentation, or displacement and a stiffness; received {where} with "
                f"{_listed(found)}"
            )
        if stage is None and self.stiffness is not None:
            raise ValueError(f"stiffness turns a displacement into an indentation; received {where}, which has none")
        depth = path
        if "indentation" not in found:
            if self.stiffness is None:
                raise ValueError(
                    "Expected the stiffness (N/m; --stiffness) that turns displacement into indentation; received "
                    f"{where} without"
                )
            depth = path - compression / self.stiffness
        time, speed = found.get("time"), speed or self.speed
        if time is None:
            if speed is None:
                raise ValueError(f"Expected a column time, such as 'time (s)', or a speed; received {where} without")
            time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path)))]) / speed
        _check_sign(path, compression, force_sign, where)
        force = compression if force_sign == "compression" else -compression
        further = {"contact_radius": found.get("contact_radius"), "stage": stage, "force_sign": force_sign}
        return {"time": time, "indentation": depth, "force": force, **further}


def raw_curves(
    paths: Sequence[Path],
    stiffness: float | None,
    force_sign: ForceSign,
    columns: Mapping[str, str],
    sensitivity: float | None = None,
) -> list[RawCurve]:
    """All curves of an AFM file, or the one of text files; see `ForceCurve.read`."""
    if len(paths) == 1 and paths[0].suffix.lower() not in _TEXT_FILES:
        return load_afm(paths[0], stiffness, sensitivity)
    try:
        found = _joined(paths, columns)
    except ValueError as error:
        # Instruments write text of their own, which afmformats may know.
        try:
            if len(paths) == 1 and (curves := load_afm(paths[0], stiffness, sensitivity)):
                return curves
        except InstrumentError as other:
            raise ValueError(f"{error}; as a file of an instrument: {other}") from other
        except ValueError:
            pass
        raise
    if sensitivity is not None:
        raise ValueError(
            f"sensitivity turns volts into a force; received {', '.join(map(str, paths))}, which has forces"
        )
    found["force"] = found["force"] if force_sign == "compression" else -found["force"]
    return [RawCurve(found, stiffness)]


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
        raise ValueError(f"Expected a CSV or an AFM file; received {path}, which is {what}")
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
    return RawCurve(quantities, spring_used, speed_known, (x, y))


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
    """The columns that were found, in words."""
    return ", ".join(sorted(quantities)) or "no column of a known name in its first line"


def _joined(paths: Sequence[Path], columns: Mapping[str, str]) -> dict[str, FloatArray]:
    """The columns of text files in a row; times that begin before the last file ended are moved behind it."""
    parts = [_quantities(part, columns) for part in paths]
    if "force" not in parts[0]:
        raise ValueError(f"Expected a column force, such as 'force (nN)'; received {paths[0]} with {_listed(parts[0])}")
    for part, before, name in zip(parts[1:], parts, paths[1:], strict=False):
        if set(part) != set(before):
            raise ValueError(f"the files of one curve must have the same columns; received {name} with {_listed(part)}")
        if "time" in part and part["time"][0] < (end := before["time"][-1]):
            time = part["time"]
            part["time"] = time - time[0] + end + (float(np.median(np.diff(time))) if time.size > 1 else 0.0)
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


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
        dimension = name if name in ("time", "force") else "length"
        scale, values = factor(f"column {shown(title)} of {path}", unit, dimension), np.full(len(rows), np.nan)
        for line, row in enumerate(rows):
            with suppress(ValueError, IndexError):
                values[line] = float(row[number])
            if not np.isfinite(values[line]):
                received = shown(row[number]) if number < len(row) else "nothing"
                raise ValueError(
                    f"Expected finite numbers in column {shown(title)} of {path}; received {received} in row {line + 1}"
                )
        found[name] = scale * values
    return found


def _table(path: Path) -> tuple[list[str], list[list[str]]]:
    if path.is_dir():
        raise ValueError(f"Expected a text file of columns; received {path}, which is a directory")
    try:
        written = [line for line in read_text(path).splitlines() if line.strip()]
        lines = [line for line in written if not line.startswith("#")]
        comments = [line.lstrip("# ") for line in itertools.takewhile(lambda line: line.startswith("#"), written)]
        # A header may be a comment, as NumPy writes it; other comments are left out.
        if comments and lines and _NUMBER.match(lines[0]):
            lines.insert(0, comments[-1])
        separator = max(",;\t", key="".join(lines[:1]).count)
        if separator == ";":
            lines = [line.replace(",", ".") for line in lines]
        header, *rows = (row for _, row in csv_rows(lines, delimiter=separator)) if len(lines) > 2 else ([],)
    except ValueError as error:
        raise ValueError(f"Expected a text file of columns; received {path} ({error})") from error
    if len(lines) < 3:
        raise ValueError(f"Expected a header and at least two rows; received {path} with {len(lines)} lines")
    return header, rows


def _parsed(title: str) -> tuple[str | None, str]:
    """Name and unit of a column; the name is `None` where it is not known."""
    match = _COLUMN.fullmatch(title) if len(title) <= _LONGEST_TITLE else None
    if match is None:
        return None, ""
    if title.strip().lower() == "contact_radius":  # which looks like a name and a unit
        return "contact_radius", ""
    unit = next((group.strip() for group in match.groups()[1:] if group), "")
    return _NAMES.get(match[1].strip().lower().replace(" ", "_")), unit
