"""Tables as Markdown, CSV and LaTeX from the same cells, and how numbers are written in them."""

import csv
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bem._support.wording import markdown_table


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


def milliseconds(seconds: Mapping[str, Any]) -> str:
    """Median of seconds and, in brackets, its quartiles, in milliseconds; '-' if there is none."""
    if seconds["median"] is None:
        return "-"
    median, low, high = (number(1e3 * seconds[name]) for name in ("median", "low", "high"))
    return f"{median} ({low}-{high})"


def left_out(result: Mapping[str, Any], phrases: Mapping[str, str]) -> str:
    """A sentence for each list of names in a result that is not empty; `phrases` gives its first words by key."""
    return "".join(f" {phrase}: {', '.join(result[key])}." for key, phrase in phrases.items() if result.get(key))


def table_rows(rows: Sequence[Sequence[Any]]) -> str:
    """Rows of a table in Markdown, without its head."""
    return "\n".join(f"| {' | '.join(map(str, row))} |" for row in rows)


def caption(name: str, **values: Any) -> str:
    """The text below a table, from `tables/captions.toml`, with its places filled."""
    return " ".join(tomllib.loads(CAPTIONS.read_text(encoding="utf-8"))[name].split()).format(**values)


CAPTIONS = Path(__file__).parents[1] / "tables" / "captions.toml"
LETTERS = 135
"""In a line of a table in LaTeX, as wide as a figure of two columns."""


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

    def page(self, align: str = "") -> str:
        """The table and its caption for a page of the documentation; `align` as for `markdown_table`."""
        return f"{markdown_table(self.header, self.rows, align)}\n\n{self.caption}"

    def save(self, name: str, folder: Path) -> None:
        """Write `NAME.md`, `NAME.csv` and `NAME.tex`."""
        folder.mkdir(parents=True, exist_ok=True)
        # `make` prints this one: columns stand under each other.
        columns = [
            [cell.replace(r"$\pm$", "±") for cell in column] for column in zip(self.header, *self.rows, strict=True)
        ]
        padded = ([cell.ljust(max(map(len, column))) for cell in column] for column in columns)
        header, *rows = zip(*padded, strict=True)
        caption = self.caption.replace(r"$\pm$", "±")
        text = f"{markdown_table(header, rows)}\n\n{caption}\n"
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
        with (folder / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
            csv.writer(file, lineterminator="\n").writerows([self.header, *self.rows])
        body = "".join("    " + " & ".join(map(_latex, row)) + r" \\" + "\n" for row in self.rows)
        heads = " & ".join(map(_latex, self.header))
        (folder / f"{name}.tex").write_text(
            "% \\usepackage{booktabs, tabularx}\n"
            "\\begin{table}[h]\n"
            f"    \\caption{{{_latex(self.caption)}}}\n"
            f"    \\label{{tab:{name}}}\n"
            "    \\scriptsize\\setlength{\\tabcolsep}{2pt}\n"
            f"    \\begin{{tabularx}}{{\\textwidth}}{{@{{}}{self._shares()}@{{}}}}\n"
            f"    \\toprule\n    {heads} \\\\\n    \\midrule\n{body}    \\bottomrule\n"
            "    \\end{tabularx}\n\\end{table}\n",
            encoding="utf-8",
        )

    def _shares(self) -> str:
        """Columns as wide as the page together: each holds its longest word, and the rest goes to the longest cells."""
        columns = [(head, *cells) for head, *cells in zip(self.header, *self.rows, strict=True)]
        # A formula is about four letters wide; capitals are wider than others.
        drawn = ([*re.sub(r"\$.*?\$", "Pmax", " ".join(column)).split()] for column in columns)
        widths = ([len(word) + 0.3 * sum(map(str.isupper, word)) for word in texts] for texts in drawn)
        longest = [2.0 + max(lengths, default=1.0) for lengths in widths]
        cells = (min(max(map(len, column[1:]), default=1), 40) for column in columns)
        beyond = [max(cell - word, 1) for cell, word in zip(cells, longest, strict=True)]
        spare = max(LETTERS - len(columns) - sum(longest), 0)
        needs = [word + spare * more / sum(beyond) for word, more in zip(longest, beyond, strict=True)]
        shares = [len(needs) * need / sum(needs) for need in needs]
        column = r">{{\hsize={:.3f}\hsize\raggedright\arraybackslash\hspace{{0pt}}}}X"
        return "".join(map(column.format, shares))


def _latex(text: str) -> str:
    parts = text.split("$")
    # The parts at odd positions are mathematics.
    parts[::2] = [re.sub(r"([%&#_])", r"\\\1", prose) for prose in parts[::2]]
    joined = "$".join(parts)
    power = lambda match: rf"${match[1]}\times10^{{{int(match[2])}}}$"  # noqa: E731
    return re.sub(r"(?<![\w.])(-?\d(?:\.\d+)?)e([+-]\d+)\b", power, joined)
