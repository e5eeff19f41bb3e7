"""What a reviewer should conclude: the numbers of `docs/reproducibility.md`, from the published files.

`make docs-numbers` writes them into the page. Rankings come from all published seeds.
"""

from pathlib import Path
from typing import Any

from bem._support.wording import markdown_table
from experiments.paper.recipe_seeds import SEEDS, decisions
from experiments.trainings import ranking as rankings
from experiments.trainings.ranking import FAILS, HOLDS, NOT_DECIDED, TIE
from paper_figures.style import models_style
from paper_figures.style.writing import number
from paper_figures.tables.table_ranking import chance_text, says
from surrogate.architectures.naming import paper_names

DECISIONS = {HOLDS: "Hold", TIE: "Are ties", FAILS: "Fail", NOT_DECIDED: "Are undecided"}
"""Headings of the statements, by the decision on their orders."""


def forces_text(model_forces: Any) -> str:
    """Models that were trained on earlier forces; if there are none, how far the recorded errors are from ours."""
    # Nothing is known of a model whose weights are not published.
    largest = 100.0 * max(model["error_difference"] or 0.0 for model in model_forces["models"].values())
    return models_style.forces_note(model_forces) or (
        "All published models were trained on the forces of the published file, up to the solver's accuracy. The mean "
        f"test errors on it, of those with weights, are within {largest:.2g} % of the recorded ones."
    )


def seeds_text(ranking: Any) -> str:
    """Number of published trainings, out of the required ones, in words."""
    seeds, names = ranking["seeds_expected"], paper_names()
    present = [len(ranking["models"].get(name, ())) for name in names]
    complete = sum(count >= seeds for count in present)
    return f"{sum(present)} of {seeds * len(names)} trainings; {complete} of {len(names)} models have all {seeds} seeds"


def statements_text(models: Path, ranking: Any) -> str:
    """One line for each decision by the paper's recipe, with its statements, and a table of both recipes."""
    statements: dict[str, list[str]] = {decision: [] for decision in DECISIONS}
    header = ["the paper says", "its first", "by its recipe", "first", "ratio", "decisive", "trainings"]
    header, rows, decided = [*header, "by seeds", "first", "least sure order"], [], _by_paper_recipe(models, ranking)
    for claim in rankings.ranked():
        champion, _ = rankings.contenders(claim)
        outcome = ranking["claims"][claim["ranking"]]
        pairs = [pair for pair in ranking["pairs"] if pair["claim"] == claim["ranking"]]
        sure = [pair for pair in pairs if pair["probability"]["test_mse"] is not None]
        least = min(sure, key=lambda pair: pair["probability"]["test_mse"], default=None)
        order = "-"
        if least:
            chance = chance_text(least["probability"]["test_mse"], ranking["resamples"])
            order = f"{least['better']} before {least['worse']}: {chance}"
        theirs = decided[claim["ranking"]]
        statements[theirs.get("decision", NOT_DECIDED)].append(says(claim["ranking"]))
        by_recipe = [f"not yet: {len(theirs['lacking'])} to train", "-", "-", "-", "-"]
        if not theirs["lacking"]:
            by_recipe = [
                f"**{theirs['decision']}**",
                theirs["first"],
                f"{theirs['ratio']:.2f}",
                f"{theirs['apart']:.2f}",
                str(theirs["seeds"]),
            ]
        by_seeds = [f"**{outcome['decision']}**", outcome["first"] or "not trained yet", order]
        rows.append([says(claim["ranking"]), champion, *by_recipe, *by_seeds])
    lines = [f"- **{label}**: {', '.join(statements[key]) or 'none'}." for key, label in DECISIONS.items()]
    return "\n".join([*lines, "", markdown_table(header, rows, "llllrrrlll")])


def spread_table(ranking: Any) -> str:
    """Spread over the seeds of each model that has at least two."""
    several = [name for name in ranking["models"] if models_style.seeds_of(ranking, name) >= models_style.SEVERAL]
    header, rows = ["model", "seeds", "held-out MSE", "apart", "median pull-off error (%)", "apart"], []
    for name in several:
        cells = [name, str(models_style.seeds_of(ranking, name))]
        for metric in ("test_mse", "pull_off_percent"):
            spread = ranking["spread"][name][metric]
            share = 100.0 * (spread["max"] - spread["min"]) / spread["median"]
            cells += [f"{number(spread['min'])} to {number(spread['max'])}", f"{number(share, 2)} %"]
        rows.append(cells)
    return markdown_table(header, rows, "lrlrlr") if several else "No model has two seeds yet."


def _by_paper_recipe(models: Path, ranking: Any) -> dict[str, Any]:
    """Decisions on the rankings by the trainings by the paper's recipe in a folder, and by the published seeds."""
    claims: dict[str, Any] = decisions(models, SEEDS, ranking["dataset_sha256"], ranking["spread"])["claims"]
    return claims
