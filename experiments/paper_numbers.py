"""The paper's own numbers, each transcribed once, in TOML and CSV files of `experiments/paper_values/`."""

import csv
import functools
import re
import tomllib
from pathlib import Path
from typing import Any

PAPER_VALUES = Path(__file__).parent / "paper_values"
PAPER_RECIPE = "{}-paper"
"""Label under which a model, trained by the paper's own recipe, is published."""


@functools.cache
def paper_values(name: str) -> dict[str, Any]:
    """The content of `paper_values/NAME.toml`."""
    return tomllib.loads((PAPER_VALUES / f"{name}.toml").read_text(encoding="utf-8"))


def paper_claims() -> list[dict[str, Any]]:
    """The claims of `paper_values/claims.toml`, each with the keys that its section states for all of its claims."""
    sections = paper_values("claims")["section"]
    claims = [section | claim for section in sections for claim in section["claim"]]
    return [{key: value for key, value in claim.items() if key != "claim"} for claim in claims]


def paper_rows(name: str) -> list[dict[str, Any]]:
    """The rows of `paper_values/NAME.csv`; a cell that reads as a number becomes a `float`."""
    with (PAPER_VALUES / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return [{key: _number(value) for key, value in row.items()} for row in csv.DictReader(file)]


def stated(address: str) -> Any:
    """A number of the paper by its place, for example `dataset:ranges/tabor/0`.

    Raises:
        ValueError: There is no such place.
    """
    name, _, path = address.partition(":")
    number: Any = paper_values(name)
    for key in path.split("/"):
        try:
            number = number[int(key)] if isinstance(number, list) else number[key]
        except (KeyError, IndexError, ValueError, TypeError) as error:
            raise ValueError(f"a place must be FILE:KEY/... in paper_values; received {address!r}") from error
    return number


def with_stated(text: str) -> str:
    """Replace each `{FILE:KEY/...}` in a text by the paper's number at that place."""
    return re.sub(r"\{(\w+:[\w/]+)\}", lambda match: f"{stated(match[1]):g}", text)


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
