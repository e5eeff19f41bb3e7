"""REPRODUCTION.md: every number of the paper with ours, a verdict by a stated rule, and the paper's inconsistencies.

Usage: `python -m paper_figures.report.write [--results DIR] [--published DIR] [--out FILE]`.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("paper_figures.report.write")

from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.command_line import run_main
from bem._support.wording import markdown_table
from experiments.paper_numbers import paper_values, with_stated
from experiments.trainings.ranking import contenders
from paper_figures.report import claims
from paper_figures.report.claims import Finding, Results
from paper_figures.style import models_style
from paper_figures.style.writing import number

OUT = Path("REPRODUCTION.md")
INTRODUCTION = Path(__file__).with_name("introduction.md")


def value_text(value: Any, unit: str = "") -> str:
    """A number with its unit, a word, or '-' for `None`."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return value
    plain = isinstance(value, float) and value == round(value, 4) and abs(value) >= 1e-3
    text = f"{value:,}" if isinstance(value, int) else f"{value:g}" if plain else number(value)
    return f"{text} {unit}".rstrip()


def tolerance_text(claim: dict[str, Any]) -> str:
    """Tolerance of a row, with its justification."""
    tolerance = claims.tolerance_of(claim)
    if tolerance is None:
        return "-"
    return f"{100.0 * tolerance:g} %" + (f": {claim['because'].lower()}".rstrip(".") if "because" in claim else "")


def row(finding: Finding, trained: bool) -> list[str]:
    """One row of a table; a claim that is not the paper's has no tolerance and no verdict.

    `trained` tells whether the table has a column for the numbers by our recipe.
    """
    claim, unit = finding.claim, finding.claim.get("unit", "")
    ours = [finding.ours]
    if trained:
        ours += [finding.by_ours]
        if not ({"by_ours", "ranking"} & claim.keys()) and "by_paper_recipe" not in claim.get("over", ""):
            ours.reverse()
    values = [claim.get("value"), *ours]
    rounded = [float(f"{value:.3g}") if isinstance(value, float) else value for value in values]
    ratio = "-" if finding.ratio is None else number(finding.ratio, 2)
    cells = [claim["says"], claim["place"], *(value_text(value, unit) for value in rounded), ratio]
    if not claim.get("beyond"):
        sizes, ranked = paper_values("structure")["sizes"], contenders(claim)[1].values() if "ranking" in claim else ()
        how = [sizes.get(name.split("-")[0], {}).get("how") for names in ranked for name in names]
        mark = " ‡" if "guessed" in how else ""  # the paper does not tell the sizes of one of the architectures
        cells += [tolerance_text(claim), f"**{finding.verdict}**{mark}"]
    return [*cells, finding.why]


def section(group: str, findings: list[Finding]) -> str:
    """A heading and its table; what all rows have in common, reason or tolerance, is said once above it."""
    trained = any("by_ours" in finding.claim or "ranking" in finding.claim for finding in findings)
    header = ["what", "place", "paper", "here", "ratio", "tolerance", "verdict", "why"]
    header[3:4] = ["by its recipe", "by ours"] if trained else ["here"]
    if findings[0].claim.get("beyond"):
        header = ["what", "beside", "paper", "here", "ratio", "why"]
    rows, notes = [row(finding, trained) for finding in findings], []
    waiting = {finding.why for finding in findings if finding.verdict == claims.NOT_YET}
    for name, template in (("why", "{}"), ("tolerance", "Tolerance: {}.")):
        cells = {line[header.index(name)] for line in rows} if name in header else ()
        if len(rows) > 1 and len(cells) == 1 and not cells & {"-", *waiting}:
            notes.append(template.format(*cells))
            index = header.index(name)
            header, rows = (header[:index] + header[index + 1 :], [line[:index] + line[index + 1 :] for line in rows])
    table = markdown_table(header, rows, "llrrrr" if trained else "llrrr")
    return "\n\n".join([f"## {group}", *([" ".join(notes)] if notes else []), table])


def overview(findings: list[Finding]) -> str:
    """Number of findings with each verdict, and what is not counted."""
    counts = Counter(finding.verdict for finding in findings if finding.counted)
    rows = [[name, str(counts[name])] for name in claims.VERDICTS if counts[name]]
    ours = sum(bool(finding.claim.get("beyond")) for finding in findings)
    count = sum(len(group["parts"]) for group in claims.settings())
    uncounted = (
        f"Not counted: {count} settings of the paper, and {ours} numbers that the paper does not state. They have "
        "sections of their own."
    )
    table = markdown_table(["verdict", "numbers"], rows, "lr")
    return f"{sum(counts.values())} numbers:\n\n{table}\n\n{uncounted}"


def settings_section(results: Results) -> str:
    """Settings of the paper in groups: its values, and ours where they differ."""
    rows = []
    for group in claims.settings():
        parts = [(entry, results.find(entry)) for entry in group["parts"]]
        theirs = "; ".join(f"{entry['says']} {value_text(entry['value'], entry.get('unit', ''))}" for entry, _ in parts)
        different = [
            f"{entry['says']} {'not yet' if ours is None else value_text(ours, entry.get('unit', ''))}"
            for entry, ours in parts
            if ours is None or not claims.followed(entry["value"], ours)
        ]
        summary = "; ".join(different)
        if len(different) < len(parts):
            summary = f"the same, but for {summary}" if different else "the same"
        rows.append([group["what"], group["place"], theirs, summary, group.get("why", "-")])
    table = markdown_table(["settings", "place", "paper", "here", "why"], rows)
    return f"## Settings of the paper that we follow\n\n{table}"


def slips_section(results: Results) -> str:
    """Inconsistencies of the paper, each with the command that shows it and its result."""
    slips = (results.content("inconsistencies") or {"slips": {}})["slips"]
    rows = []
    for slip in paper_values("slips")["slip"]:
        values = slips.get(slip.get("name", ""), {})
        comes_to = "; ".join(f"{quantity}: {value:.6g}" for quantity, value in values.items()) or "-"
        says, instead = (with_stated(slip[key]) for key in ("says", "instead"))
        shown_by = slip.get("shown_by") or f"python -m experiments inconsistencies --only {slip['name']}"
        rows.append([slip["place"], says, instead, f"`{shown_by}`", comes_to])
    table = markdown_table(["place", "the paper says", "instead", "shown by", "result"], rows)
    return f"## Inconsistencies of the paper\n\n{table}"


def report(results: Results) -> str:
    """The whole report as Markdown."""
    findings = [claims.judge(claim, results) for claim in (*claims.text_claims(), *claims.table_claims())]
    groups = list(dict.fromkeys(finding.claim["group"] for finding in findings))
    # Numbers that are not in the paper come last.
    groups.sort(key=lambda group: any(f.claim.get("beyond") for f in findings if f.claim["group"] == group))
    tolerances = [
        f"{100.0 * rule['tolerance']:g} % of {name}s" + (f" ({rule['because']})" if "because" in rule else "")
        for name, rule in paper_values("claims")["rules"].items()
    ]
    parts = [
        INTRODUCTION.read_text(encoding="utf-8").rstrip(),
        f"Tolerances unless a row has its own: {', '.join(tolerances)}.",
        overview(findings),
    ]
    missing = models_style.missing_note((results.content("model_comparison") or {}).get("missing", []))
    if missing:
        parts.append(f"Models {missing}.")
    parts += (results.content("model_comparison") or {}).get("outdated", {}).values()
    if forces := models_style.forces_note(results.content("model_forces")):
        parts.append(f"{forces} `make model-forces` compares them.")
    host = results.at("canonical_regimes:times/host")
    if host:
        parts.append(f"Timings: {host}.")
    parts += [section(group, [f for f in findings if f.claim["group"] == group]) for group in groups]
    return "\n\n".join([*parts, settings_section(results), slips_section(results)]) + "\n"


def main(
    results: Annotated[Path, typer.Option(help="Folder of result files.")] = Path("results"),
    published: Annotated[Path, typer.Option(help="Folder of published files.")] = Path("published"),
    out: Annotated[Path, typer.Option(help="File to write.")] = OUT,
) -> None:
    """Write the report."""
    out.write_text(report(Results(results, published)), encoding="utf-8")
    print(f"{out} written")


if __name__ == "__main__":
    run_main(main)
