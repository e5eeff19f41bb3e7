"""Tables as Markdown, CSV and LaTeX from the same cells, and how numbers are written in them."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any


def number(value: float, digits: int = 3) -> str:
    """A number with `digits` significant digits; as `1.2e-05` below 1e-3 and from 1e5 on."""
    if value != 0.0 and not 1e-3 <= abs(value) < 1e5:
        return f"{value:.{digits - 1}e}"
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text else text


def percent(value: float | None, digits: int = 2) -> str:
    """A share in percent; '-' for `None`."""
    return "-" if value is None else number(100.0 * value, digits)


def median_and_p95(error: Mapping[str, float | None]) -> str:
    """Median and 95th percentile of a relative error in percent; '-' if there is none."""
    return "-" if error["median"] is None else f"{percent(error['median'])} / {percent(error['p95'])}"


def milliseconds(seconds: Mapping[str, float]) -> str:
    """Median of seconds and, in brackets, its quartiles, in milliseconds."""
    median, low, high = (number(1e3 * seconds[name]) for name in ("median", "low", "high"))
    return f"{median} ({low}-{high})"


def left_out(content: Mapping[str, Any], said: Mapping[str, str]) -> str:
    """A sentence for each list of names in a result that is not empty; `said` gives its first words by key."""
    return "".join(f" {words}: {', '.join(content[key])}." for key, words in said.items() if content.get(key))


@dataclass(frozen=True)
class Table:
    """A table of text.

    Args:
        header: Column heads; mathematics between dollars.
        rows: Cells as text; numbers are written by `number`.
        caption: What the table shows and where it comes from; mathematics between dollars.
    """

    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    caption: str

    def save(self, name: str, folder: Path) -> None:
        """Write `NAME.md`, `NAME.csv` and `NAME.tex`."""
        folder.mkdir(parents=True, exist_ok=True)
        header, rows = self.header, self.rows
        widths = [max(len(row[i]) for row in (header, *rows)) for i in range(len(header))]

        def line(cells: Sequence[str]) -> str:
            return "| " + " | ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)) + " |"

        rule = "| " + " | ".join("-" * width for width in widths) + " |"
        markdown = "\n".join([line(header), rule, *(line(row) for row in rows), "", self.caption, ""])
        (folder / f"{name}.md").write_text(markdown, encoding="utf-8")
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([header, *rows])
        body = "".join("    " + " & ".join(map(_latex, row)) + r" \\" + "\n" for row in rows)
        heads = " & ".join(map(_latex, header))
        columns = "l" + "c" * (len(header) - 1)
        (folder / f"{name}.tex").write_text(
            "\\begin{table}[h]\n"
            "    \\centering\n"
            f"    \\caption{{{_latex(self.caption)}}}\n"
            f"    \\label{{tab:{name}}}\n"
            f"    \\begin{{tabular}}{{@{{}}{columns}@{{}}}}\n"
            f"    \\toprule\n    {heads} \\\\\n    \\midrule\n{body}    \\bottomrule\n"
            "    \\end{tabular}\n\\end{table}\n",
            encoding="utf-8",
        )


def _latex(text: str) -> str:
    parts = text.split("$")
    # The parts at odd positions are mathematics.
    parts[::2] = [re.sub(r"([%&#_])", r"\\\1", part) for part in parts[::2]]
    joined = "$".join(parts)
    return re.sub(r"(?<![\w.])(-?\d(?:\.\d+)?)e([+-]\d+)\b", _power, joined)


def _power(match: re.Match) -> str:
    return rf"${match[1]}\times10^{{{int(match[2])}}}$"
