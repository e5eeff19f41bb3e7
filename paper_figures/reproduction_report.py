"""REPRODUCTION.md: every number of the paper beside ours, with a verdict by a stated rule, and the paper's slips.

Usage: `python -m paper_figures.reproduction_report [--results DIR] [--published DIR] [--out FILE]`.
"""

from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from paper_figures import drawing, models_style
from paper_figures.reproduction import VERDICTS, Finding, Results, judge, table_claims, text_claims
from paper_figures.tables import number

OUT = Path("REPRODUCTION.md")
INTRODUCTION = """\
# Reproduction report

Every number the paper states, ours beside it, and a verdict. `make report` writes this file from the result files; no
number in it is typed in by hand but the paper's own, which are in `paper_figures/paper_values/`.

The rule of the verdict: counts and words must be equal. Values must agree within 10 %, or the tolerance stated in the
data file. Of errors and costs, where smaller is better, those within 25 % of the paper's count as reproduced, smaller
ones as better, larger ones as differing. Bounds must hold. "Not comparable" means that the two do not measure the same
thing, "not yet" that the result is still to be computed."""


def value_text(value: Any, unit: str = "") -> str:
    """A number, word or nothing, with its unit."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return f"{value:,}{' ' + unit if unit else ''}"
    if isinstance(value, float):
        text = f"{value:g}" if value == round(value, 4) and abs(value) >= 1e-3 else number(value)
        return f"{text}{' ' + unit if unit else ''}"
    return str(value)


def row(finding: Finding) -> str:
    """One line of a table."""
    claim, unit = finding.claim, finding.claim.get("unit", "")
    ours = finding.ours if not isinstance(finding.ours, float) else float(f"{finding.ours:.3g}")
    ratio = "-" if finding.ratio is None else number(finding.ratio, 2)
    cells = (claim["says"], claim["place"], value_text(claim["value"], unit), value_text(ours, unit), ratio)
    return "| " + " | ".join((*cells, f"**{finding.verdict}**", finding.why)) + " |"


def section(group: str, findings: list[Finding]) -> str:
    """A heading and its table."""
    head = "| what | place | paper | here | ratio | verdict | why |\n|---|---|---:|---:|---:|---|---|"
    return "\n".join([f"## {group}\n", head, *(row(finding) for finding in findings)])


def overview(findings: list[Finding]) -> str:
    """How often each verdict falls, and what holds of the models."""
    counts = Counter(finding.verdict for finding in findings)
    lines = [f"| {name} | {counts[name]} |" for name in VERDICTS if counts[name]]
    return "\n".join([f"{len(findings)} numbers:\n", "| verdict | numbers |", "|---|---:|", *lines])


def slips_section(results: Results) -> str:
    """The paper's slips, each with the command that shows it and what it comes to."""
    found = (results.content("slips") or {"slips": {}})["slips"]
    lines = ["| place | the paper says | instead | shown by | it comes to |", "|---|---|---|---|---|"]
    for slip in drawing.paper_values("slips")["slip"]:
        values = found.get(slip.get("name", ""), {})
        comes_to = "; ".join(f"{what}: {value:.6g}" for what, value in values.items()) or "-"
        cells = (slip["place"], slip["says"], slip["instead"], f"`{slip['shown_by']}`", comes_to)
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(["## Slips of the paper\n", *lines])


def report(results: Results) -> str:
    """The whole report as Markdown."""
    findings = [judge(claim, results) for claim in (*text_claims(), *table_claims())]
    groups = list(dict.fromkeys(finding.claim["group"] for finding in findings))
    parts = [INTRODUCTION, overview(findings)]
    missing = models_style.missing_note((results.content("models") or {}).get("missing", []))
    if missing:
        parts.append(f"Models {missing}.")
    host = (results.content("canonical") or {}).get("host")
    if host:
        parts.append(f"Timings: {host}.")
    parts += [section(group, [f for f in findings if f.claim["group"] == group]) for group in groups]
    return "\n\n".join([*parts, slips_section(results)]) + "\n"


def main(
    results: Annotated[Path, typer.Option(help="Where result files are.")] = Path("results"),
    published: Annotated[Path, typer.Option(help="Where published files are.")] = Path("published"),
    out: Annotated[Path, typer.Option(help="File to write.")] = OUT,
) -> None:
    """Write the report."""
    out.write_text(report(Results(results, published)), encoding="utf-8")
    print(f"{out} written")


if __name__ == "__main__":
    typer.run(main)
