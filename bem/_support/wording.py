"""Words for people: quotes of user input in messages, with bounded length, and tables in plain text and Markdown."""

import reprlib
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Any

_FEW, _MANY = 12, 40
_REPR = reprlib.Repr()
_REPR.maxlevel, _REPR.maxstring, _REPR.maxother = 2, 120, 200


def shortened(text: str, limit: int = 300) -> str:
    """Text on one line and of bounded length, with its middle left out where it is longer."""
    line = " ".join(text.split())
    half = limit // 2
    return line if len(line) <= limit else f"{line[:half]} ... {line[-half:]}"


def shown(value: Any) -> str:
    """A value from outside as messages quote it: its `repr` on one line and of bounded length, whatever it is."""
    try:
        return shortened(_REPR.repr(value))
    except Exception:  # the repr of a foreign object may raise anything
        return f"an object of type {type(value).__name__}, which cannot be shown"


def listed(choices: Iterable[str], received: str) -> str:
    """Choices for a message that received none of them: alike ones first; of many, only those or short ones."""
    every = list(choices)
    alike = get_close_matches(received, every, cutoff=0.5)
    if len(every) > _MANY and not alike:
        alike = sorted(every, key=len)[:_FEW]
    if len(every) <= _FEW or not alike:
        return ", ".join(alike + [choice for choice in every if choice not in alike])
    return f"{', '.join(alike)} or {len(every) - len(alike)} others"


def plain_table(rows: Sequence[Sequence[str]]) -> str:
    """A table in aligned columns, the header among its rows."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("   ".join(map(str.ljust, row, widths)).rstrip() for row in rows)


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]], align: str = "") -> str:
    """A table in Markdown. `align` has a letter for each column: r for numbers, to the right; others to the left."""
    rule = ["---:" if letter == "r" else "---" for letter in align.ljust(len(header))]
    lines = [f"| {' | '.join(cells)} |" for cells in (header, *rows)]
    return "\n".join([lines[0], f"|{'|'.join(rule)}|", *lines[1:]])
