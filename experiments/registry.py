"""The registry in the Makefile: figures, tables, studies and measurements, for messages and documents.

A line reads `NAME.KIND := WORDS  ## CAPTION`. The kinds `paper` and `cost` are figures and tables; their words are the
results that they read. The kind `study` is a result of `experiments`. The kinds `makes` and `publishes` are targets
that publish a result.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

MAKEFILE = Path(__file__).parents[1] / "Makefile"
LINE = re.compile(r"^([\w-]+)\.(paper|cost|study|makes|publishes) :=(.*?)(?:\s*## (.*))?$", re.MULTILINE)
WHOLE = {
    "figures tables": "All figures and tables",
    "paper": "Figures, tables and the report",
    "smoke": "The reproduction from scratch on tiny data",
}
"""Targets in the table of REPRODUCING.md besides the figures and tables of the paper, with their captions."""
INPUTS = {
    "architectures": "Keras models, untrained",
    "solver": "solver",
    "dataset": "data set",
    "M1-concat": "M1-concat",
    "models": "all models",
    "more-models": "further trainings of M1-concat",
    "feature_sets": "`published/feature_sets.json`",
    "data_efficiency": "`published/data_efficiency.json`",
    "accuracy_price": "`published/accuracy_price.json`",
    "ranking": "`published/ranking.json`",
    "model_forces": "`published/model_forces.json`",
}
"""Names of the inputs of studies as the table of REPRODUCING.md shows them; published timings are not listed."""
STAGES = {
    "M1-concat": "reference",
    "models": "models",
    "more-models": "more-models",
    "feature_sets": "feature-sets",
    "data_efficiency": "data-efficiency",
}
"""Stage of the reproduction from scratch that makes an input; each of these stages needs the data set."""


@dataclass(frozen=True)
class Entry:
    """A line of the registry."""

    name: str
    kind: str
    words: tuple[str, ...]
    caption: str

    @property
    def reads(self) -> tuple[str, ...]:
        """Names of the results that the entry reads."""
        return tuple(word.removesuffix("?") for word in self.words)

    @property
    def optional(self) -> set[str]:
        """Names of the results that may be missing."""
        return {word.removesuffix("?") for word in self.words if word.endswith("?")}


def entries(makefile: Path = MAKEFILE) -> list[Entry]:
    """All entries of the registry, in the order of the Makefile."""
    text = makefile.read_text(encoding="utf-8")
    return [Entry(name, kind, tuple(words.split()), caption or "") for name, kind, words, caption in LINE.findall(text)]


def maker(result: str) -> str | None:
    """The make command that publishes a result; `None` if no target does."""
    made = [entry for entry in entries() if entry.kind in ("makes", "publishes") and result in entry.words]
    return f"make {made[0].name}" if made else None


def inputs(name: str, makefile: Path = MAKEFILE) -> list[str]:
    """Inputs that a figure or table needs, directly or through studies, in the order of `INPUTS`."""
    known = entries(makefile)
    studies = {entry.name: entry.reads for entry in known if entry.kind == "study"}
    open_, found = [entry.reads for entry in known if entry.kind == "paper" and entry.name == name], set()
    while open_:
        for read in open_.pop():
            found.add(read)
            if read in studies:
                open_.append(studies[read])
    if "models" in found:
        found.discard("M1-concat")
    return [one for one in INPUTS if one in found]


def stages(name: str, makefile: Path = MAKEFILE) -> list[str]:
    """Stages of the reproduction from scratch that a figure or table needs."""
    found = inputs(name, makefile)
    made = [STAGES[one] for one in found if one in STAGES]
    return ["dataset", *made] if made or "dataset" in found else []
