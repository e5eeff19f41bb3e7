"""The paper's own numbers, each transcribed once in `experiments/paper_values/`: TOML files and tables in CSV."""

from __future__ import annotations

import csv
import functools
import re
import tomllib
from pathlib import Path
from typing import Any

PAPER_VALUES = Path(__file__).parent / "paper_values"


@functools.cache
def paper_values(name: str) -> dict[str, Any]:
    """The content of `paper_values/NAME.toml`."""
    return tomllib.loads((PAPER_VALUES / f"{name}.toml").read_text(encoding="utf-8"))


def paper_rows(name: str) -> list[dict[str, Any]]:
    """The rows of `paper_values/NAME.csv`, every cell a number that can be one."""
    with (PAPER_VALUES / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return [{key: _number(value) for key, value in row.items()} for row in csv.DictReader(file)]


def stated(place: str) -> Any:
    """A number of the paper by its place, as `dataset:ranges/tabor/0`.

    Raises:
        ValueError: there is none at that place.
    """
    name, _, path = place.partition(":")
    found: Any = paper_values(name)
    for key in path.split("/"):
        try:
            found = found[int(key)] if isinstance(found, list) else found[key]
        except (KeyError, IndexError, ValueError, TypeError) as error:
            raise ValueError(f"a place must be FILE:KEY/... in paper_values; received {place!r}") from error
    return found


def with_stated(text: str) -> str:
    """A text whose `{FILE:KEY}` are filled with the paper's numbers."""
    return re.sub(r"\{(\w+:[\w/]+)\}", lambda match: f"{stated(match[1]):g}", text)


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
