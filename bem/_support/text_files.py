"""Text from outside, read within bounds, and values in the form that JSON can hold.

What a reader gets may be damaged or hostile. It is therefore bounded in size, field length and nesting before a parser
sees it; what is not, is one short `ValueError`, which the caller completes by the file and what it wanted.
"""

import csv
import json
import re
import stat
import tomllib
from collections.abc import Callable, Iterable, Mapping
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

MOST_CHARACTERS = 2**26
MOST_OF_TOML = 2**20  # hand-written: the parser's time grows faster than the text
DEEPEST = 100
_MOST_DOTS = 100  # in a line: the parser's memory grows with the square of the parts of a key


def read_text(path: str | Path, most: int = MOST_CHARACTERS) -> str:
    """Return the text of a file in UTF-8.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no regular file, such as a device, no text, or longer than `most` characters.
    """
    if not stat.S_ISREG(Path(path).stat().st_mode):
        raise ValueError("not a regular file")
    try:
        with Path(path).open(encoding="utf-8-sig") as file:
            text = file.read(most + 1)
    except UnicodeDecodeError as error:
        raise ValueError("not UTF-8 text") from error
    if len(text) > most:
        raise ValueError(f"more than {most} characters")
    return text


def read_toml(path: str | Path) -> dict[str, Any]:
    """Return the content of a TOML file; errors as `read_text`, and text that is no TOML or too deeply nested."""
    text = read_text(path, MOST_OF_TOML)
    if any(re.sub(r"\d\.\d", "", line).count(".") > _MOST_DOTS for line in text.splitlines()):
        raise ValueError(f"more than {_MOST_DOTS} dots in a line")
    return _parsed(tomllib.loads, text)


def parse_json(text: str, **options: Any) -> Any:
    """Return the content of JSON; `options` are those of `json.loads`.

    Raises:
        ValueError: the text is no JSON, or nested too deeply.
    """
    return _parsed(json.loads, text, **options)


def read_json(path: str | Path) -> Any:
    """Return the content of a JSON file; errors as `read_text` and `parse_json`."""
    return parse_json(read_text(path))


def csv_rows(lines: Iterable[str], **dialect: Any) -> list[tuple[int, list[str]]]:
    """Return the rows of CSV, each with the number of its last line; `dialect` is that of `csv.reader`.

    Raises:
        ValueError: the text is no CSV, or a field is longer than `csv.field_size_limit()`.
    """
    reader = csv.reader(lines, **dialect)
    try:
        return [(reader.line_num, row) for row in reader]
    except csv.Error as error:
        raise ValueError(str(error)) from error


def plain(value: Any) -> Any:
    """Return a value with NaN and infinity as `None`, arrays and tuples as lists, and NumPy's numbers as Python's."""
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def _parsed(parse: Callable[..., Any], text: str, **options: Any) -> Any:
    """What a parser makes of text whose brackets nest no deeper than `DEEPEST`; brackets in quotes count too."""
    steps = (1 if bracket in "[{" else -1 for bracket in re.findall(r"[\[\]{}]", text))
    if any(depth > DEEPEST for depth in accumulate(steps, lambda depth, step: max(depth + step, 0), initial=0)):
        raise ValueError(f"nested too deeply, more than {DEEPEST} times")
    try:
        return parse(text, **options)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error
