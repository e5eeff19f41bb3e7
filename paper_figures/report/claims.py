"""Verdicts on the paper's numbers: what the paper claims, the number found here, and how the two compare.

A verdict follows from the rule of the claim alone:

    count   equal: reproduced; otherwise differs
    value   within the tolerance: reproduced; otherwise differs
    error, cost   smaller is better: within the tolerance: reproduced; smaller: better; larger: differs
    bound   ours at most the paper's: reproduced; otherwise differs
    least   ours at least the paper's: reproduced; otherwise differs
    text    the same word: reproduced; otherwise differs; a ranking that the seeds do not decide: tie
    none    not comparable

Tolerances are in `paper_values/claims.toml`. If a result does not exist yet, the verdict is "not yet", and the reason
names the target that makes it. Claims marked `beyond` are not in the paper and get no verdict.
"""

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from experiments.__main__ import studies
from experiments.common import read_result
from experiments.paper_numbers import paper_claims, paper_rows, paper_values, stated
from experiments.trainings.ranking import by_paper_recipe

VERDICTS = ("reproduced", "better", "tie", "differs", "not comparable", "not yet")
"""Verdicts, in the order of the overview."""
REPRODUCED, BETTER, TIE, DIFFERS, NOT_COMPARABLE, NOT_YET = VERDICTS
BY_SEEDS = {"holds": REPRODUCED, "tie": TIE, "fails": DIFFERS}
"""Verdict on a ranking, by the decision of several seeds."""
AGREE: dict[str, Callable[[Any, Any], bool]] = {
    "count": operator.eq,
    "text": lambda ours, theirs: str(ours).lower() == str(theirs).lower(),
    "bound": operator.le,
    "least": operator.ge,
}
"""Rules that have no tolerance: whether ours agrees with the paper's."""
RULES = ("count", "value", "error", "cost", "bound", "least", "text", "none")
EXACT = 1e-6
"""Largest relative difference of a setting that counts as equal to the paper's."""


@dataclass(frozen=True)
class Finding:
    """A claim with our number and the verdict."""

    claim: dict[str, Any]
    ours: Any
    verdict: str
    why: str
    by_ours: Any = None

    @property
    def ratio(self) -> float | None:
        """Ratio of our number to the paper's; `None` unless both are numbers and the paper's is not zero."""
        theirs = self.claim.get("value")
        if not _is_number(theirs) or not _is_number(self.ours) or theirs == 0:
            return None
        return self.ours / theirs

    @property
    def counted(self) -> bool:
        """Whether the claim is the paper's, so that its verdict counts."""
        return not self.claim.get("beyond")


class Results:
    """The result files; each is read on first use."""

    def __init__(self, results: Path, published: Path) -> None:
        folders = published, published / "measurements", results / "studies"
        self.paths = {path.stem: path for folder in folders for path in folder.glob("*.json")}
        self.read: dict[str, Any] = {}

    def content(self, name: str) -> Any:
        """Content of a result; `None` if its file does not exist."""
        if name not in self.read:
            self.read[name] = read_result(self.paths[name]) if name in self.paths else None
        return self.read[name]

    def find(self, claim: dict[str, Any]) -> Any:
        """Our number for a claim; `None` if there is none yet."""
        value = self.at(claim["source"])
        if value is None:
            return None
        reduced = _reduced(value, claim)
        for key, against in (("than", operator.gt), ("over", operator.truediv)):
            if key in claim:
                reference = self.at(claim[key])
                return None if reference is None else against(reduced, reference)
        return reduced

    def at(self, address: str) -> Any:
        """Value at a place of a result, such as `dataset_statistics:ranges/tabor/0`; `None` if there is none yet."""
        source, _, path = address.partition(":")
        value = self.content(source)
        for key in path.split("/"):
            if value is None:
                return None
            value = value[int(key)] if isinstance(value, list) else value.get(key)
        return value


def made_by_target(name: str) -> str:
    """The command that makes a result."""
    folder = studies()[name].split(".")[1]
    if folder == "paper":
        return "make report"
    own = name in ("feature_sets", "data_efficiency", "ranking", "model_forces")
    return f"make {'' if own else 'measure-'}{name.replace('_', '-')}"


def verdict(rule: str, theirs: Any, ours: Any, tolerance: float | None = None) -> str:
    """Compare two numbers or words by a rule.

    Raises:
        ValueError: The rule is unknown.
    """
    if rule not in RULES:
        raise ValueError(f"a rule must be one of {', '.join(RULES)}; received {rule!r}")
    if rule == "none":
        return NOT_COMPARABLE
    if rule in AGREE:
        return REPRODUCED if AGREE[rule](ours, theirs) else DIFFERS
    width = tolerance_of({"rule": rule, "tolerance": tolerance})
    if abs(ours - theirs) <= width * abs(theirs):
        return REPRODUCED
    return BETTER if rule in ("error", "cost") and ours < theirs else DIFFERS


def tolerance_of(claim: dict[str, Any]) -> float | None:
    """Relative tolerance of a claim: its own, or that of its rule; `None` if neither has one."""
    own = claim.get("tolerance")
    return paper_values("claims")["rules"].get(claim["rule"], {}).get("tolerance") if own is None else own


def judge(claim: dict[str, Any], results: Results) -> Finding:
    """Find our number for a claim and compare it; that by our recipe stands beside it."""
    if "ranking" in claim:
        return judge_ranking(claim, results)
    ours = results.find(claim) if claim.get("source") else None
    beside = results.at(claim["by_ours"]) if "by_ours" in claim else None
    beside = beside if beside is None else _reduced(beside, claim)
    if ours is None and (claim["rule"] != "none" or claim.get("beyond")):
        places = [claim[key] for key in ("source", "than", "over") if key in claim]
        lacking = next(address for address in places if results.at(address) is None)
        made_by = claim.get("made_by") or made_by_target(lacking.partition(":")[0])
        return Finding(claim, None, NOT_YET, f"`{made_by}` makes it.", beside)
    decision = verdict(claim["rule"], claim.get("value"), ours, claim.get("tolerance"))
    return Finding(claim, ours, decision, claim["why"], beside)


def judge_ranking(claim: dict[str, Any], results: Results) -> Finding:
    """Judge a ranking by one training of each model by the paper's recipe; beside it what the seeds of ours decide."""
    ranking = results.content("ranking")
    by_seeds = (ranking or {"claims": {}})["claims"].get(claim["ranking"])
    if by_seeds and by_seeds["decision"] in BY_SEEDS:
        beside = f"{_ranked_first(claim, by_seeds)}, {by_seeds['decision']}"
    else:
        value = results.find(claim)
        beside = None if value is None else f"{value}, one training each"
    mse = results.at("model_comparison:by_paper_recipe/mse") or {}
    decided = by_paper_recipe(claim, mse, (ranking or {}).get("spread", {}))
    if decided["lacking"]:
        made = claim.get("made_by", "make models RECIPE=paper")
        return Finding(claim, None, NOT_YET, f"`{made}` trains what is missing: {len(decided['lacking'])}.", beside)
    why = "One training each. An order is decided if the errors differ by more than those of the seeds of our recipe."
    return Finding(claim, _ranked_first(claim, decided), BY_SEEDS[decided["decision"]], why, beside)


def _ranked_first(claim: dict[str, Any], order: dict[str, Any]) -> str:
    binary = claim["value"] == "true"
    word = BY_SEEDS[order["decision"]]
    ours = {REPRODUCED: claim["value"], TIE: " = ".join(order["level"]), DIFFERS: "false" if binary else order["first"]}
    return ours[word]


def text_claims() -> list[dict[str, Any]]:
    """Claims of the paper's text and captions, with the numbers that are transcribed elsewhere filled in."""
    return [_with_value(claim) for claim in paper_claims()]


def settings() -> list[dict[str, Any]]:
    """Settings of the paper that are adopted here, in groups, with the value of each part filled in."""
    return [
        group | {"parts": [_with_value(entry) for entry in group["parts"]]}
        for group in paper_values("claims")["setting"]
    ]


def followed(theirs: Any, ours: Any) -> bool:
    """Whether a setting equals the paper's."""
    return math.isclose(ours, theirs, rel_tol=EXACT) if _is_number(theirs) else str(ours) == str(theirs)


def table_claims() -> list[dict[str, Any]]:
    """Claims of the paper's tables: quartiles, timings, crack velocities."""
    common = paper_values("claims")["tables"]
    quantities = ("pull-off force", "hysteresis", "pull-off time")
    columns = {"mse": "MSE"}
    columns |= {f"{name.replace('-', '_').replace(' ', '_')}_percent": f"{name} error" for name in quantities}
    parts = {"mean": "mean", "sd": "standard deviation"}
    quartiles = [
        common["quartiles"]
        | {
            "says": f"{row['quartile']}: {word} of the {label}",
            "value": row[f"{column}_{statistic}"],
            "unit": "%" if "percent" in column else "",
            "source": f"error_statistics:by_paper_recipe/quartiles/{row['quartile']}/{column}/{statistic}",
            "by_ours": f"error_statistics:quartiles/{row['quartile']}/{column}/{statistic}",
            "made_by": "make model-paper-recipe",
        }
        for row, (column, label), (statistic, word) in product(paper_rows("quartiles"), columns.items(), parts.items())
    ]
    tools = {"solver": ("bem", "solver", "solver"), "surrogate": ("surrogate", "keras_call", "plain Keras call")}
    seconds = [
        common[f"{tool}_seconds"]
        | {
            "says": f"sample ({row['sample']:g}), {word}",
            "value": row[f"{column}_seconds"],
            "source": f"canonical_regimes:regimes/{index}/seconds/{key}",
        }
        for index, row in enumerate(paper_rows("canonical_protocols"))
        for tool, (column, key, word) in tools.items()
    ]
    velocities = [
        common["crack_velocities"]
        | {
            "says": f"crack velocity of point {row['point']:g}",
            "value": row["crack_velocity"],
            "source": f"persson_brener:points/{index}/own_crack_velocity",
        }
        for index, row in enumerate(paper_rows("persson_brener_protocols"))
    ]
    return [*quartiles, *seconds, *velocities]


def _with_value(claim: dict[str, Any]) -> dict[str, Any]:
    return claim | ({"value": _listed(stated(claim["stated"]))} if "stated" in claim else {})


def _reduced(value: Any, claim: dict[str, Any]) -> Any:
    if "layers" in claim:
        return sum(layer["parameters"] for layer in value if layer["name"] in claim["layers"])
    if claim.get("op") == "length":
        return len(value)
    if claim.get("op") == "join":
        return _listed(value)
    if claim.get("op") == "decades":
        return math.log10(value[-1] / value[0])
    return value * claim["scale"] if "scale" in claim else value


def _listed(value: Any) -> Any:
    return ", ".join(f"{number:g}" for number in value) if isinstance(value, list) else value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
