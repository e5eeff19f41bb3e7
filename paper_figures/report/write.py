"""REPRODUCTION.md: one page of answers, a map of the paper, what it leaves open, and every number with a verdict.

The words are `page.md`, `page.toml` and `rules.md` beside this module, and `experiments/paper_values/`.


Usage: `python -m paper_figures.report.write [--results DIR] [--published DIR] [--out FILE]`.
"""

if __name__ == "__main__":  # before the imports that take long
    from bem._support.interruption import end_on_interrupt

    end_on_interrupt("paper_figures.report.write")

import re
import tomllib
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import typer

from bem._support.command_line import run_main
from bem._support.wording import markdown_table
from experiments.paper_numbers import PAPER_VALUES, paper_values, stated, with_stated
from paper_figures.report import claims
from paper_figures.report.claims import Finding, Results
from paper_figures.style import models_style
from paper_figures.style.writing import number

OUT = Path("REPRODUCTION.md")
HERE = Path(__file__).parent
FIRST_PAGE = "## Map of the paper"
"""Heading after the first page."""


def page_claims() -> list[dict[str, Any]]:
    """The claims of the first page, from `page.toml`."""
    claimed: list[dict[str, Any]] = tomllib.loads((HERE / "page.toml").read_text(encoding="utf-8"))["claim"]
    return claimed


def filled(text: str, results: Results) -> str:
    """Replace each `{FILE:KEY/...|FORMAT}` in a text by the paper's number or the result at that place."""

    def value_at(match: re.Match[str]) -> str:
        address, form = match[1], match[2]
        paper = (PAPER_VALUES / f"{address.partition(':')[0]}.toml").is_file()
        value = stated(address) if paper else results.at(address)
        if isinstance(value, list):
            return ", ".join(map(str, value))
        return "not yet" if value is None else format(value, form) if form else value_text(value)

    return re.sub(r"\{(\w+:[^{}|]+)(?:\|([^{}]+))?\}", value_at, text)


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


def paper_text(claim: dict[str, Any]) -> str:
    """The paper's number with the digits that it states."""
    value, unit = claim.get("value"), claim.get("unit", "")
    return f"{value:g} {unit}".rstrip() if isinstance(value, float) else value_text(value, unit)


def our_text(value: Any, unit: str = "") -> str:
    """Our number with three digits."""
    return value_text(float(f"{value:.3g}") if isinstance(value, float) else value, unit)


def row(finding: Finding, columns: int) -> list[str]:
    """One row of a table with one or two columns of our numbers; what is not counted has no verdict."""
    claim, unit = finding.claim, finding.claim.get("unit", "")
    ours = [our_text(finding.ours, unit), our_text(finding.beside, unit)][:columns]
    if "hardware" in claim:
        ours.reverse()
    ratio = "-" if finding.ratio is None else number(finding.ratio, 2)
    cells = [claim["says"], claim["place"], paper_text(claim), *ours, ratio]
    if finding.counted:
        cells += [tolerance_text(claim), verdict_text(finding)]
    return [*cells, finding.why]


def verdict_text(finding: Finding) -> str:
    """The verdict, with ‡ if the paper states no size of a model concerned, and † if a removed program trained one."""
    sizes, models = paper_values("structure")["sizes"], claims.models_of(finding.claim)
    guessed = any(sizes.get(name.split("-")[0], {}).get("how") == "guessed" for name in models)
    marks = "‡" * (guessed and "ranking" in finding.claim) + "†" * finding.by_removed
    return f"**{finding.verdict}** {marks}".rstrip()


def section(group: str, findings: list[Finding]) -> str:
    """A heading and its table; what all rows have in common, reason or tolerance, is said once above it."""
    of_hardware = "hardware" in findings[0].claim
    trained = any({"by_ours", "ranking"} & finding.claim.keys() for finding in findings)
    ours = (
        ["the paper's method here", "here"] if of_hardware else ["by its recipe", "by `swift`"] if trained else ["here"]
    )
    counted = ["tolerance", "verdict"] if findings[0].counted else []
    place = "place" if findings[0].counted or of_hardware else "beside"
    header = ["what", place, "paper", *ours, "ratio", *counted, "why"]
    rows, notes = [row(finding, len(ours)) for finding in findings], []
    waiting = {finding.why for finding in findings if finding.verdict == claims.NOT_YET}
    for name, template in (("why", "{}"), ("tolerance", "Tolerance: {}.")):
        cells = {line[header.index(name)] for line in rows} if name in header else ()
        if len(rows) > 1 and len(cells) == 1 and not cells & {"-", *waiting}:
            notes.append(template.format(*cells))
            index = header.index(name)
            header, rows = (header[:index] + header[index + 1 :], [line[:index] + line[index + 1 :] for line in rows])
    table = markdown_table(header, rows, "llr" + "r" * (len(ours) + 1))
    return "\n\n".join([f"### {group}", *([" ".join(notes)] if notes else []), table])


def first_page(findings: dict[str, Finding], results: Results) -> str:
    """The page that answers: claims of abstract and conclusions, other numbers that differ, questions."""
    rows, answered = [], set()
    for claim in page_claims():
        finding = findings.get(claim.get("finding", ""))
        verdict, shown = (finding.verdict, verdict_text(finding)) if finding else (claim["verdict"], claim["verdict"])
        paper, here = claim.get("paper"), claim.get("here")
        if finding is not None:
            unit = finding.claim.get("unit", "")
            paper, here = paper or paper_text(finding.claim), here or our_text(finding.ours, unit)
            answered.add(finding.claim["says"])
        why = claim["why"] if isinstance(claim["why"], str) else claim["why"][verdict]
        rows.append([claim["says"], *(filled(text, results) for text in (paper, here)), shown, filled(why, results)])
    differing = [
        f for says, f in findings.items() if f.counted and f.verdict == claims.DIFFERS and says not in answered
    ]
    others = [
        f"- {f.claim['says']}: {paper_text(f.claim)}, here {our_text(f.ours, f.claim.get('unit', ''))}"
        for f in differing
    ]
    removed = results.at("recipe_seeds:removed")
    notice = (
        f"A program that is no longer here trained {removed} of 18 models, wholly or in part (†). " if removed else ""
    )
    table = markdown_table(["claim", "paper", "here", "verdict", "why"], rows)
    text = filled((HERE / "page.md").read_text(encoding="utf-8"), results)
    parts = {"{removed}": notice, "{claims}": table, "{differing}": "\n".join(others)}
    for place, part in parts.items():
        text = text.replace(place, part)
    return text.rstrip()


def readme_table() -> str:
    """The first page's table for the README, with the commands that show its numbers; read from REPRODUCTION.md."""
    lines = (HERE.parents[1] / OUT).read_text(encoding="utf-8").partition(FIRST_PAGE)[0].splitlines()
    rows = {name: cells for name, *cells in (line.strip("| ").split(" | ") for line in lines) if cells}
    shown = [
        [claim["says"], *rows[claim["says"]][:3], f"`{claim['command']}`"]
        for claim in page_claims()
        if claim.get("readme", True)
    ]
    return markdown_table(["claim", "paper", "here", "verdict", "command"], shown)


def verdicts_of(findings: list[Finding]) -> str:
    """How many of the findings have each verdict, in words."""
    counts = Counter(finding.verdict for finding in findings if finding.counted)
    return ", ".join(f"{counts[name]} {name}" for name in claims.VERDICTS if counts[name])


def map_section(findings: list[Finding]) -> str:
    """Every figure, table and numbered equation of the paper with its target or file, and its verdict."""
    parts = [FIRST_PAGE]
    for kind, heading in (("shown", "Figures and tables"), ("equation", "Numbered equations")):
        rows = []
        for entry in paper_values("map")[kind]:
            concerned = [
                f
                for f in findings
                if f.claim["group"] in entry.get("groups", ()) or f.claim["says"] in entry.get("says", ())
            ]
            verdict = verdicts_of(concerned) or entry["verdict"]
            where = f"`make {entry['target']}`" if "target" in entry else ""
            files = ", ".join(f"`{file}`" for file in entry["files"])
            rows.append([entry["paper"], entry["what"], *([where] if kind == "shown" else []), files, verdict])
        header = ["in the paper", "what", *(["target"] if kind == "shown" else []), "file", "verdict"]
        parts += [f"### {heading}", markdown_table(header, rows)]
    return "\n\n".join(parts)


def open_section(results: Results) -> str:
    """What the paper does not say, what was chosen here, and what the choice changes."""
    entries = paper_values("left_open")["choice"]
    rows = [[entry["unsaid"], entry["ours"], filled(entry["changes"], results), entry["shown_by"]] for entry in entries]
    table = markdown_table(["the paper does not say", "chosen here", "what it changes", "measured by"], rows)
    return f"## What the paper leaves open\n\n{table}"


def trainings_section(results: Results) -> str:
    """Who trained each model by the paper's recipe: backend, device, hours, command."""
    rows = [
        [
            f"{training['label']}{' †' if training['removed'] else ''}",
            *(str(training[key]) for key in ("seed", "backend", "device")),
            "-" if training["hours"] is None else number(training["hours"], 2),
            str(training["epochs"]),
            number(training["mse"]),
            f"`{training['command']}`",
        ]
        for training in {row["label"]: row for row in results.at("recipe_seeds:trainings") or ()}.values()
    ]
    note = (
        "Hours of one core on a processor, of the whole training on a GPU. † A program that is no longer part of the "
        "repository trained it, wholly or in part (`git log -- unfinished/gpu` finds it in a whole clone). `make "
        "paper-recipe-seeds FOLDERS=...` adds more seeds."
    )
    table = markdown_table(
        ["training", "seed", "backend", "device", "hours", "epochs", "held-out MSE", "command"], rows, "lrllrrrl"
    )
    return f"## Trainings by the paper's recipe\n\n{note}\n\n{table}"


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
    return f"### Settings of the paper that we follow\n\n{table}"


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
    """The whole report as Markdown: the first page, the map, and the appendix of all numbers."""
    judged = [claims.judge(claim, results) for claim in (*claims.text_claims(), *claims.table_claims())]
    groups: dict[str, list[Finding]] = {}
    for finding in judged:
        groups.setdefault(finding.claim["group"], []).append(finding)
    counted, uncounted = (
        [group for group, rows in groups.items() if rows[0].counted == is_counted] for is_counted in (True, False)
    )
    tolerances = [
        f"{100.0 * rule['tolerance']:g} % of {name}s" + (f" ({rule['because']})" if "because" in rule else "")
        for name, rule in paper_values("claims")["rules"].items()
    ]
    appendix = [
        filled((HERE / "rules.md").read_text(encoding="utf-8").rstrip(), results),
        f"Tolerances unless a row has its own: {', '.join(tolerances)}.",
        f"{sum(finding.counted for finding in judged)} numbers: {verdicts_of(judged)}.",
    ]
    missing = models_style.missing_note((results.content("model_comparison") or {}).get("missing", []))
    if missing:
        appendix.append(f"Models {missing}.")
    appendix += (results.content("model_comparison") or {}).get("outdated", {}).values()
    if forces := models_style.forces_note(results.content("model_forces")):
        appendix.append(f"{forces} `make model-forces` compares them.")
    if host := results.at("canonical_regimes:times/host"):
        appendix.append(f"Timings: {host}; those of the paper's method: {results.at('paper_method_times:host')}.")
    parts = [
        first_page({finding.claim["says"]: finding for finding in judged}, results),
        map_section(judged),
        open_section(results),
        trainings_section(results),
        slips_section(results),
        *appendix,
        *(section(group, groups[group]) for group in (*counted, *uncounted)),
        settings_section(results),
    ]
    return "\n\n".join(parts) + "\n"


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
