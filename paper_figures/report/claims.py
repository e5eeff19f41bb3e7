"""Verdicts on the paper's numbers: what the paper claims, the number found here, and how the two compare.

A verdict follows from the rule of the claim alone:

    count   equal: reproduced; otherwise differs
    value   within the tolerance: reproduced; otherwise differs
    error   within the tolerance: reproduced; smaller: smaller; larger: differs
    bound   ours at most the paper's: reproduced; otherwise differs
    least   ours at least the paper's: reproduced; otherwise differs
    text    the same word: reproduced; otherwise differs
    none    not comparable

An error of the scaled force must have the same verdict for every threshold of the symmetric logarithm, or is not
comparable. A ranking is a tie if seeds by the paper's recipe say so, and undecided without them. Tolerances are in
`paper_values/claims.toml`. If a result does not exist yet, the verdict is "not yet", and the reason names the target
that makes it. Claims marked `beyond` are not in the paper, those marked `hardware` are seconds; both get no verdict.
"""

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from experiments.__main__ import studies
from experiments.common import read_result
from experiments.paper_numbers import paper_claims, paper_rows, paper_values, stated
from experiments.trainings.ranking import contenders
from surrogate.architectures.naming import paper_names

VERDICTS = ("reproduced", "smaller", "tie", "undecided", "differs", "not comparable", "not yet")
"""Verdicts, in the order of the overview."""
REPRODUCED, SMALLER, TIE, UNDECIDED, DIFFERS, NOT_COMPARABLE, NOT_YET = VERDICTS
BY_SEEDS = {"holds": REPRODUCED, "tie": TIE, "fails": DIFFERS, "not decided": UNDECIDED}
"""Verdict on a ranking, by its decision."""
RANKED_WHY = {
    True: "One training each: decided only if errors differ by more than the squared ratio of two seeds by `swift`.",
    False: "Seeds and test trajectories are resampled together.",
}
"""Reason of a ranking, by whether some model has a single training."""
UNITS = "The verdict depends on the unit of the force, which the paper does not define."
AGREE: dict[str, Callable[[Any, Any], bool]] = {
    "count": operator.eq,
    "text": lambda ours, theirs: str(ours).lower() == str(theirs).lower(),
    "bound": operator.le,
    "least": operator.ge,
}
"""Rules that have no tolerance: whether ours agrees with the paper's."""
RULES = ("count", "value", "error", "bound", "least", "text", "none")
EXACT = 1e-6
"""Largest relative difference of a setting that counts as equal to the paper's."""


@dataclass(frozen=True)
class Finding:
    """A claim with our number and the verdict."""

    claim: dict[str, Any]
    ours: Any
    verdict: str
    why: str
    beside: Any = None
    by_removed: bool = False

    @property
    def ratio(self) -> float | None:
        """Ratio of our number to the paper's; `None` unless both are numbers and the paper's is not zero."""
        theirs = self.claim.get("value")
        if not _is_number(theirs) or not _is_number(self.ours) or theirs == 0:
            return None
        return self.ours / theirs

    @property
    def counted(self) -> bool:
        """Whether the claim is the paper's and has a verdict that counts."""
        return not self.claim.keys() & {"beyond", "hardware"}


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
        return reduced > claim["above"] if "above" in claim else reduced

    def at(self, address: str) -> Any:
        """Value at a place of a result, such as `dataset_statistics:ranges/tabor/0`; `None` if there is none yet."""
        source, _, path = address.partition(":")
        value = self.content(source)
        for key in path.split("/"):
            if value is None:
                return None
            value = dict(enumerate(value)).get(int(key)) if isinstance(value, list) else value.get(key)
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
    return SMALLER if rule == "error" and ours < theirs else DIFFERS


def tolerance_of(claim: dict[str, Any]) -> float | None:
    """Relative tolerance of a claim: its own, or that of its rule; `None` if neither has one."""
    own = claim.get("tolerance")
    return paper_values("claims")["rules"].get(claim["rule"], {}).get("tolerance") if own is None else own


def models_of(claim: dict[str, Any]) -> list[str]:
    """Models, by their names in the rankings, whose trainings by the paper's recipe a claim is about."""
    if "ranking" in claim:
        return [name for names in contenders(claim)[1].values() for name in names]
    named: list[str] = paper_names() if claim.get("models") == "all" else claim.get("models", [])
    return named


def judge(claim: dict[str, Any], results: Results) -> Finding:
    """Judge a claim, and say whether a program that is no longer part of the repository trained one of its models."""
    trainings = results.at("recipe_seeds:trainings") or ()
    removed = {row["model"] for row in trainings if row["removed"]}
    finding = judge_ranking(claim, results) if "ranking" in claim else judge_number(claim, results)
    return replace(finding, by_removed=bool(removed & set(models_of(claim))))


def judge_number(claim: dict[str, Any], results: Results) -> Finding:
    """Find our number for a claim and compare it; that by our recipe, or by the paper's method, stands beside it."""
    ours = results.find(claim) if claim.get("source") else None
    beside = results.at(claim["by_ours"]) if "by_ours" in claim else None
    beside = results.at(claim["by_method"]) if "by_method" in claim else beside
    beside = beside if beside is None or "by_method" in claim else _reduced(beside, claim)
    scales = (results.content("open_choices") or {"thresholds": {}})["thresholds"] if "thresholds" in claim else None
    if scales == {}:
        return Finding(claim, None, NOT_YET, f"`{made_by_target('open_choices')}` makes it.", beside)
    if ours is None and (claim["rule"] != "none" or claim.get("beyond")):
        places = [claim[key] for key in ("source", "than", "over") if key in claim]
        lacking = next(address for address in places if results.at(address) is None)
        made_by = claim.get("made_by") or made_by_target(lacking.partition(":")[0])
        return Finding(claim, None, NOT_YET, f"`{made_by}` makes it.", beside)
    places = [f"open_choices:thresholds/{scale}/{claim['thresholds']}" for scale in scales or ()]
    compared = [ours, *map(results.at, places)]
    decisions = {verdict(claim["rule"], claim.get("value"), value, claim.get("tolerance")) for value in compared}
    if len(decisions) > 1:
        return Finding(claim, ours, NOT_COMPARABLE, UNITS, beside)
    return Finding(claim, ours, decisions.pop(), claim["why"], beside)


def judge_ranking(claim: dict[str, Any], results: Results) -> Finding:
    """Judge a ranking by the trainings by the paper's recipe; beside it what the seeds of ours decide."""
    ranking = results.content("ranking")
    by_seeds = (ranking or {"claims": {}})["claims"].get(claim["ranking"])
    beside = f"{_ranked_first(claim, by_seeds)}, {by_seeds['decision']}" if by_seeds else None
    decided = results.at("recipe_seeds:claims")
    decided = decided and decided[claim["ranking"]]
    if not decided or decided["lacking"]:
        made, count = claim.get("made_by", "make models RECIPE=paper"), len(decided["lacking"]) if decided else "all"
        return Finding(claim, None, NOT_YET, f"`{made}` trains what is missing: {count}.", beside)
    why = RANKED_WHY[decided["seeds"] == 1]
    return Finding(claim, _ranked_first(claim, decided), BY_SEEDS[decided["decision"]], why, beside)


def _ranked_first(claim: dict[str, Any], order: dict[str, Any]) -> str:
    binary = claim["value"] == "true"
    word, level = BY_SEEDS[order["decision"]], order["level"]
    first = "false" if binary else order["first"]
    ours = {REPRODUCED: claim["value"], TIE: " = ".join(level), DIFFERS: first, UNDECIDED: f"{order['first']} first"}
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
            "source": f"error_statistics:paper/quartiles/{row['quartile']}/{column}/{statistic}",
            "by_ours": f"error_statistics:swift/quartiles/{row['quartile']}/{column}/{statistic}",
            "thresholds": f"quartiles/{row['quartile']}/{column}/{statistic}",
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
            **(
                {"by_method": f"paper_method_times:protocols/{row['sample']:g}/paper_method"}
                if tool == "solver"
                else {}
            ),
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
