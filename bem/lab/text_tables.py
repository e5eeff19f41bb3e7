"""The table of a text file, whatever its encoding, separator and decimal sign, and the lines before it."""

from __future__ import annotations

import codecs
import re
import stat
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bem._support.validation import FloatArray
from bem._support.wording import shown
from bem.lab.exporters import column_of

_MOST_TEXT = 2**26  # bytes
_HEADER_LINES = 2000  # before the first row of numbers
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_MISSING = {"", "nan", "-nan", "inf", "-inf", "n/a", "#n/a", "na", "null", "none", "-", "--"}


def require_file(path: Path, what: str) -> None:
    """Raise a `FileNotFoundError` where there is nothing, and a `ValueError` where there is no regular file."""
    if not stat.S_ISREG(path.stat().st_mode):
        received = "a directory" if path.is_dir() else "not a regular file"
        raise ValueError(f"path must be {what}; received {path}, which is {received}")


def table_of(path: Path) -> tuple[list[str], list[str], FloatArray, dict[str, str], int]:
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
    rows = []
    for number, line in enumerate(lines[start:], 1):
        if line.startswith("#"):
            continue
        values = np.full(count, np.nan)
        for n, cell in enumerate(_cells(line, separator)[:count]):
            if (entry := _value(cell)) is None:
                raise ValueError(
                    f"a row must hold numbers; received {shown(cell)} in column {n + 1} of row {number} of {path}"
                )
            values[n] = entry
        rows.append(values)
    table = np.array([values for values in rows if np.isfinite(values).any()])
    dropped = len(rows) - len(table)
    several = any(column_of(title)[2] for title in titles)
    titled = [n for n, title in enumerate(titles[:count]) if title]
    complete = np.isfinite(table[:, titled]).all(axis=1) | several
    return titles, units, table[complete], facts, dropped + int(np.count_nonzero(~complete))


def _first_row(lines: Sequence[str]) -> tuple[str | None, int | None]:
    """Separator and number of the first of two rows of numbers."""
    for number, line in enumerate(lines[:_HEADER_LINES]):
        if line.startswith("#") or not line.strip():
            continue
        for separator in (";", "\t", ",", None):
            cells = _cells(line, separator)
            if sum(map(_is_number, cells)) > 1 and None not in map(_value, cells):
                return separator, number
    return None, None


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip().strip('"') for cell in (line.split() if separator is None else line.split(separator))]


def _value(cell: str) -> float | None:
    """The number in a cell, NaN where the cell says that there is none; `None` for text."""
    if _is_number(cell):
        return float(cell.replace(",", "."))
    return np.nan if cell.strip().lower() in _MISSING else None


def _is_number(cell: str) -> bool:
    return NUMBER.fullmatch(cell.strip().replace(",", ".", 1)) is not None


def _decoded(path: Path) -> str:
    """The text of a file in UTF-8, UTF-16 or the encoding of Windows in the west."""
    require_file(path, "a text file of columns")
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
