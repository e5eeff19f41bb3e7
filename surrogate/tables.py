"""The table of models in `docs/surrogate-models.md`, generated so that no count is typed in by hand."""

from __future__ import annotations

from surrogate.architectures import CONDITIONINGS, FAMILIES, PAPER_PARAMETER_COUNTS, build


def parameter_table() -> str:
    """Return a Markdown table of trainable parameters; a star marks the counts the paper states."""
    lines = [f"| family | {' | '.join(CONDITIONINGS)} |", f"|---|{'---:|' * len(CONDITIONINGS)}"]
    for family, words in FAMILIES.items():
        cells = []
        for conditioning in CONDITIONINGS:
            name = f"{family}-{conditioning}"
            star = " *" if name in PAPER_PARAMETER_COUNTS else ""
            cells.append(f"{build(name).count_params():,}{star}")
        lines.append(f"| {family}: {words} | {' | '.join(cells)} |")
    return "\n".join(lines)
