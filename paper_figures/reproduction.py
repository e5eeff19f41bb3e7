"""Verdicts on the paper's numbers: what each claim says, what ours is, and how the two compare.

A verdict follows from the claim's rule alone:

    count   equal: reproduced; otherwise differs
    value   within the tolerance (10 % unless stated): reproduced; otherwise differs
    error, cost   smaller is better: within 25 %: reproduced; smaller: better; larger: differs
    bound   ours at most the paper's: reproduced; otherwise differs
    text    the same word: reproduced; otherwise differs
    none    not comparable

Where a result is not there yet the verdict is "not yet", with the target that makes it.
"""

from __future__ import annotations

import csv
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paper_figures import drawing

REPRODUCED, BETTER, DIFFERS, NOT_COMPARABLE, NOT_YET = "reproduced", "better", "differs", "not comparable", "not yet"
VERDICTS = (REPRODUCED, BETTER, DIFFERS, NOT_COMPARABLE, NOT_YET)
TOLERANCES = {"value": 0.10, "error": 0.25, "cost": 0.25}
RULES = ("count", "value", "error", "cost", "bound", "text", "none")

SOURCES = {
    "dataset": ("results", "dataset/statistics.json", "make table-protocols-dataset"),
    "canonical": ("results", "studies/canonical_regimes.json", "make table-protocols-canonical"),
    "persson_brener": ("results", "studies/persson_brener.json", "make table-persson-brener"),
    "errors": ("results", "studies/error_statistics.json", "make table-quartiles"),
    "fms": ("results", "studies/fms_transfer.json", "make figure-fms-transfer"),
    "models": ("results", "studies/model_comparison.json", "make models table-models"),
    "graphs": ("results", "studies/architecture_graphs.json", "make figure-architectures"),
    "slips": ("results", "studies/paper_slips.json", "make report"),
    "features": ("published", "feature_sets.json", "make feature-sets"),
    "efficiency": ("published", "data_efficiency.json", "make data-efficiency"),
}


@dataclass(frozen=True)
class Finding:
    """A claim with our number and the verdict."""

    claim: dict[str, Any]
    ours: Any
    verdict: str
    why: str

    @property
    def ratio(self) -> float | None:
        """Ours over the paper's, where both are numbers."""
        theirs = self.claim["value"]
        if not _is_number(theirs) or not _is_number(self.ours) or theirs == 0:
            return None
        return self.ours / theirs


class Results:
    """The result files, read when first asked for."""

    def __init__(self, results: Path, published: Path) -> None:
        self.roots = {"results": results, "published": published}
        self.read: dict[str, Any] = {}

    def content(self, name: str) -> Any:
        """Content of a source, or `None` where its file does not exist."""
        if name not in self.read:
            root, file, _ = SOURCES[name]
            path = self.roots[root] / file
            self.read[name] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None
        return self.read[name]

    def find(self, claim: dict[str, Any]) -> Any:
        """Our number for a claim; `None` where there is none yet."""
        source, _, path = claim["source"].partition(":")
        found = self.content(source)
        for key in path.split("/"):
            if found is None:
                return None
            found = found[int(key)] if isinstance(found, list) else found.get(key)
        return None if found is None else _reduced(found, claim)


def verdict(rule: str, theirs: Any, ours: Any, tolerance: float | None = None) -> str:
    """Compare two numbers or words by a rule."""
    if rule == "none":
        return NOT_COMPARABLE
    if rule == "text":
        return REPRODUCED if str(ours).lower() == str(theirs).lower() else DIFFERS
    if rule == "count":
        return REPRODUCED if ours == theirs else DIFFERS
    if rule == "bound":
        return REPRODUCED if ours <= theirs else DIFFERS
    width = TOLERANCES[rule] if tolerance is None else tolerance
    if abs(ours - theirs) <= width * abs(theirs):
        return REPRODUCED
    return BETTER if rule in ("error", "cost") and ours < theirs else DIFFERS


def judge(claim: dict[str, Any], results: Results) -> Finding:
    """Find our number for a claim and compare."""
    ours = results.find(claim) if claim.get("source") else None
    if ours is None and claim["rule"] != "none":
        target = SOURCES[claim["source"].partition(":")[0]][2]
        return Finding(claim, None, NOT_YET, f"`{target}` makes it.")
    return Finding(claim, ours, verdict(claim["rule"], claim["value"], ours, claim.get("tolerance")), claim["why"])


def text_claims() -> list[dict[str, Any]]:
    """Claims of the paper's text and captions."""
    return drawing.paper_values("claims")["claim"]


def table_claims() -> list[dict[str, Any]]:
    """Claims of the paper's tables: quartiles, timings, crack velocities."""
    claims: list[dict[str, Any]] = []
    for row in _rows("quartiles"):
        for column in ("mse", "pull_off_force_percent", "hysteresis_percent", "pull_off_time_percent"):
            for part, word in (("mean", "mean"), ("sd", "standard deviation")):
                quartile = row["quartile"]
                claims.append(
                    {
                        "group": "Quartile table",
                        "place": "table 2",
                        "says": f"{quartile}: {word} of {column.replace('_percent', ' error').replace('_', ' ')}",
                        "value": float(row[f"{column}_{part}"]),
                        "unit": "%" if "percent" in column else "",
                        "rule": "error",
                        "source": f"errors:quartiles/{quartile}/{column}/{part}",
                        "why": "Ranked by force MSE, relative errors on the measurement steps.",
                    }
                )
    for index, row in enumerate(_rows("canonical_protocols")):
        pairs = (("bem", "solver", "solver"), ("surrogate", "keras_call", "plain Keras call"))
        for column, key, word in pairs:
            claims.append(
                {
                    "group": "Timing table",
                    "place": "table 1",
                    "says": f"sample ({row['sample']}), {word}",
                    "value": float(row[f"{column}_seconds"]),
                    "unit": "s",
                    "rule": "cost",
                    "source": f"canonical:regimes/{index}/seconds/{key}",
                    "why": "One thread of another processor.",
                }
            )
    for index, row in enumerate(_rows("persson_brener_protocols")):
        claims.append(
            {
                "group": "Crack velocities",
                "place": "table 4",
                "says": f"crack velocity of point {row['point']}",
                "value": float(row["crack_velocity"]),
                "rule": "value",
                "tolerance": 0.2,
                "source": f"persson_brener:points/{index}/own_crack_velocity",
                "why": "Ours is measured at the retreating contact edge; the paper's comes from another study.",
            }
        )
    return claims


def _rows(name: str) -> list[dict[str, str]]:
    with (drawing.PAPER_VALUES / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _reduced(found: Any, claim: dict[str, Any]) -> Any:
    if "layers" in claim:
        return sum(layer["parameters"] for layer in found if layer["name"] in claim["layers"])
    if claim.get("op") == "length":
        return len(found)
    if claim.get("op") == "decades":
        return math.log10(found[-1] / found[0])
    return found * claim["scale"] if "scale" in claim else found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
