"""What a reviewer should conclude: the numbers of `docs/reproducibility.md`, from the published files.

`make docs-numbers` writes them into the page. Rankings come from all published seeds.
"""

import json
from pathlib import Path
from typing import Any

from bem._support.wording import markdown_table
from experiments.common import ended_by_recipe
from experiments.paper.model_comparison import PAPER_TRAINED, REFERENCE, WORDED, read_model
from experiments.paper.recipe_seeds import SEEDS, decisions
from experiments.paper_numbers import paper_claims
from experiments.trainings import ranking as rankings
from experiments.trainings.ranking import FAILS, HOLDS, NOT_DECIDED, TIE
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import number
from paper_figures.tables.table_ranking import chance_text, says
from surrogate.architectures.naming import paper_names

DECISIONS = {HOLDS: "Hold", TIE: "Are ties", FAILS: "Fail", NOT_DECIDED: "Are undecided"}
"""Headings of the statements, by the decision on their orders."""
MEDIANS = {"pull_off_force_percent": "median pull-off error", "hysteresis_percent": "median hysteresis error"}


def forces_text(model_forces: Any) -> str:
    """Models that were trained on earlier forces; if there are none, how far the recorded errors are from ours."""
    # Nothing is known of a model whose weights are not published.
    largest = 100.0 * max(model["error_difference"] or 0.0 for model in model_forces["models"].values())
    return models_style.forces_note(model_forces) or (
        "All published models were trained on the forces of the published file, up to the solver's accuracy: the mean "
        f"test errors on it of those with weights are within {largest:.2g} % of the recorded ones."
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


def changes_text(models: Path, ranking: Any) -> str:
    """The statements on which both recipes decide differently, with both decisions, in a sentence."""
    decided, differ = _by_paper_recipe(models, ranking), []
    for claim in rankings.ranked():
        theirs = decided[claim["ranking"]].get("decision", NOT_DECIDED)
        ours = ranking["claims"][claim["ranking"]]["decision"]
        if theirs != ours:
            differ.append(f"{says(claim['ranking'])} ({theirs}; by seeds {ours})")
    return f"The paper's recipe decides otherwise than the seeds of ours on: {', '.join(differ) or 'nothing'}."


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


def training_table(models: Path) -> str:
    """The paper's model by the paper's recipe, and by its words: epochs, and errors compared with the paper's."""
    ways = {"here": PAPER_TRAINED[REFERENCE], "here, without Keras's threshold": WORDED}
    runs = {way: _trained(models / label) for way, label in ways.items() if (models / label / "run.json").is_file()}
    if not runs:
        return "Not trained yet: `make model-paper-recipe`."
    paper, tests = drawing.paper_values("reference_model"), [metrics["test"] for metrics, _ in runs.values()]
    most = next(claim["value"] for claim in paper_claims() if "any model needed" in claim["says"])
    ended = {True: "ended by the recipe", False: "stopped before the recipe's own end"}
    epochs = [f"{metrics['epochs']}, {ended[by_recipe]}" for metrics, by_recipe in runs.values()]
    rows = [["epochs", f"at most {most}", *epochs]]
    for key in ("mse", "mae"):
        rows.append([f"held-out {key.upper()}", number(paper[key]), *(number(test[key]["mean"]) for test in tests)])
    for key, title in MEDIANS.items():
        rows.append([title, f"{paper[key]} %", *(f"{number(test[key]['median'], 2)} %" for test in tests)])
    native = [f"{number(test['native_pull_off_force_percent']['median'], 2)} %" for test in tests]
    rows.append(["median pull-off error, against the solver's own peak between the steps", "-", *native])
    return markdown_table(["", "paper", *runs], rows, "l" * (2 + len(runs)))


def recipe_table(models: Path, ranking: Any) -> str:
    """Errors of the models that were also trained by the paper's recipe, those of their seeds, and both orders."""
    header = ["model", "epochs", "ended by", "held-out MSE", "of seeds", "median pull-off error (%)", "of seeds"]
    rows, errors = [], {}
    for name, label in PAPER_TRAINED.items():
        folder = models / label
        if not (folder / "run.json").is_file() or not ranking["models"].get(name):
            continue
        metrics, by_recipe = _trained(folder)
        test, spread = metrics["test"], ranking["spread"][name]
        errors[name] = (test["mse"]["mean"], spread["test_mse"]["median"])
        pull_off = (test["pull_off_force_percent"]["median"], spread["pull_off_percent"]["median"])
        where = ", on a GPU" if metrics["cpu_seconds"] is None else ""
        cells = [name, str(metrics["epochs"]), f"{'recipe' if by_recipe else 'EPOCHS'}{where}"]
        rows.append([*cells, *map(number, errors[name]), *(number(error, 2) for error in pull_off)])
    if not rows:
        return "None yet."
    by_paper, by_seeds = (", ".join(sorted(errors, key=lambda name, at=at: errors[name][at])) for at in (0, 1))
    order = f"Order by held-out MSE: {by_paper} by the recipe `paper`; {by_seeds} by the seeds."
    return f"{markdown_table(header, rows, 'lrlrrrr')}\n\n{order}"


def hours_text(models: Path, training_speed: Any) -> str:
    """Core hours of each training that the paper's recipe ended: of its batches if measured, otherwise as recorded."""
    folders = {name: models / label for name, label in PAPER_TRAINED.items() if ended_by_recipe(models / label)}
    seconds = {name: read_model(folder, training_speed)["core_seconds"] for name, folder in folders.items()}
    measured = {name: duration for name, duration in seconds.items() if duration}
    hours = ", ".join(f"{name} {number(duration / 3600.0, 2)}" for name, duration in measured.items())
    return f"{hours}; {sum(measured.values()) / 3600.0:.0f} for these {len(measured)}"


def _by_paper_recipe(models: Path, ranking: Any) -> dict[str, Any]:
    """Decisions on the rankings by the trainings by the paper's recipe in a folder, and by the published seeds."""
    claims: dict[str, Any] = decisions(models, SEEDS, ranking["dataset_sha256"], ranking["spread"])["claims"]
    return claims


def _trained(folder: Path) -> tuple[dict[str, Any], bool]:
    """Metrics of a model directory, and whether its recipe ended the training."""
    return json.loads((folder / "metrics.json").read_text(encoding="utf-8")), ended_by_recipe(folder)
