"""Numbers and tables of pages: docs/reproducibility.md, docs/limits.md and REPRODUCING.md.

`make docs-numbers` writes them into the pages. Rankings come from all published seeds. Other rows of the page of limits
name a command or a test.
"""

import json
from pathlib import Path
from typing import Any

from bem._support.wording import markdown_table
from bem.accuracy import resolve_accuracy
from experiments.common import ended_by_recipe
from experiments.paper.model_comparison import PAPER_TRAINED, PAPER_TRAINED_CONTENDERS
from experiments.stages import hours_of, read_stages
from experiments.trainings import ranking as rankings
from experiments.trainings.ranking_statistics import FAILS, HOLDS, NOT_DECIDED, TIE
from experiments.trainings.training_speed import batch_seconds, training_seconds
from paper_figures.__main__ import captions
from paper_figures.figures.features import LABELS
from paper_figures.figures.rankings import chance_text, says
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import number, table_rows
from surrogate.architectures.naming import paper_names

DECISIONS = {HOLDS: "Hold", TIE: "Are ties", FAILS: "Fail", NOT_DECIDED: "Are not decided"}
"""Headings of the statements, by the decision on their orders."""
MEDIANS = {"pull_off_force_percent": "median pull-off error", "hysteresis_percent": "median hysteresis error"}


def forces_text(model_forces: Any) -> str:
    """Models that were trained on earlier forces; if there are none, how far the recorded errors are from ours."""
    # Nothing is known of a model whose weights are not published.
    largest = 100.0 * max(one["error_difference"] or 0.0 for one in model_forces["models"].values())
    return models_style.forces_note(model_forces) or (
        "All published models were trained on the forces of the published file, up to the solver's accuracy: their "
        f"mean test errors on it are within {largest:.2g} % of the recorded ones."
    )


def seeds_text(ranking: Any) -> str:
    """Number of published trainings, out of the required ones, in words."""
    wanted, names = ranking["seeds_expected"], paper_names()
    present = [len(ranking["models"].get(name, ())) for name in names]
    whole = sum(count >= wanted for count in present)
    return f"{sum(present)} of {wanted * len(names)} trainings; {whole} of {len(names)} models have all {wanted} seeds"


def statements_text(models: Path, ranking: Any) -> str:
    """One line for each decision of the seeds, with the statements that it is about, and a table of both recipes."""
    words: dict[str, list[str]] = {decision: [] for decision in DECISIONS}
    for claim in rankings.ranked():
        words[ranking["claims"][claim["ranking"]]["decision"]].append(says(claim["ranking"]))
    lines = [f"- **{label}**: {', '.join(words[key]) or 'none'}." for key, label in DECISIONS.items()]
    header = ["the paper says", "its first", "by its recipe", "by seeds", "orders decided", "least sure order"]
    header, rows, mse = [*header, "first by seeds"], [], {}
    for name, label in PAPER_TRAINED_CONTENDERS.items():
        if ended_by_recipe(models / label):
            mse[name] = _trained(models / label)[0]["test"]["mse"]["mean"]
    for claim in rankings.ranked():
        champion, _ = rankings.contenders(claim)
        found = ranking["claims"][claim["ranking"]]
        pairs = [pair for pair in ranking["pairs"] if pair["claim"] == claim["ranking"]]
        decided = [pair for pair in pairs if pair["probability"]["test_mse"] is not None]
        least = min(decided, key=lambda pair: pair["probability"]["test_mse"], default=None)
        order = "-"
        if least:
            chance = chance_text(least["probability"]["test_mse"], ranking["resamples"])
            order = f"{least['better']} before {least['worse']}: {chance}"
        theirs = rankings.by_paper_recipe(claim, mse, ranking["spread"])
        lacking = f"not yet: {len(theirs['lacking'])} to train"
        rows.append(
            [
                says(claim["ranking"]),
                champion,
                lacking if theirs["lacking"] else f"**{theirs['decision']}**",
                f"**{found['decision']}**",
                f"{len(decided)} of {len(pairs)}",
                order,
                found["first"] or "not trained yet",
            ]
        )
    return "\n".join([*lines, "", markdown_table(header, rows, "llllrll")])


def spread_table(ranking: Any) -> str:
    """Spread over the seeds of each model that has at least two."""
    several = [name for name in ranking["models"] if models_style.seeds_of(ranking, name) >= models_style.SEVERAL]
    header, rows = ["model", "seeds", "held-out MSE", "apart", "median pull-off error (%)", "apart"], []
    for name in several:
        cells = [name, str(models_style.seeds_of(ranking, name))]
        for metric in ("test_mse", "pull_off_percent"):
            one = ranking["spread"][name][metric]
            share = 100.0 * (one["max"] - one["min"]) / one["median"]
            cells += [f"{number(one['min'])} to {number(one['max'])}", f"{number(share, 2)} %"]
        rows.append(cells)
    return markdown_table(header, rows, "lrlrlr") if several else "No model has two seeds yet."


def inputs_table(step_length: Any, feature_sets: Any, ranking: Any) -> str:
    """How well each input representation shows the step length, and its error: the median of its seeds, if any."""
    header, rows = ["inputs", "channels", "loading", "dwell", "unloading", "held-out MSE", "trainings"], []
    for name, phases in step_length["sets"].items():
        seeds = models_style.seeds_of(ranking, f"features-{name}")
        error = (
            ranking["spread"][f"features-{name}"]["test_mse"]["median"] if seeds else feature_sets["sets"][name]["mse"]
        )
        shares = [f"{share:.2f}" for share in phases.values()]
        rows.append([name, LABELS[name], *shares, number(error), str(seeds or 1)])
    return markdown_table(header, rows, "llrrrrr")


def training_table(models: Path) -> str:
    """The paper's model trained by the paper's recipe: its epochs, and its errors compared with the paper's."""
    folder = models / PAPER_TRAINED["M1-concat"]
    if not (folder / "run.json").is_file():
        return "Not trained yet: `make model-paper-recipe`."
    metrics, by_recipe = _trained(folder)
    paper, test = drawing.paper_values("reference_model"), metrics["test"]
    ended = "ended by the recipe" if by_recipe else "stopped before the recipe's own end"
    most = next(
        claim["value"] for claim in drawing.paper_values("claims")["claim"] if "any model needed" in claim["says"]
    )
    rows = [["epochs", f"at most {most}", f"{metrics['epochs']}, {ended}"]]
    rows += [[f"held-out {key.upper()}", number(paper[key]), number(test[key]["mean"])] for key in ("mse", "mae")]
    rows += [[says_, f"{paper[key]} %", f"{number(test[key]['median'], 2)} %"] for key, says_ in MEDIANS.items()]
    native = number(test["native_pull_off_force_percent"]["median"], 2)
    rows.append(["median pull-off error, against the solver's own peak between the steps", "-", f"{native} %"])
    return "\n".join(["| | paper | here |", "|---|---|---|", table_rows(rows)])


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
        rows.append([*cells, *map(number, errors[name]), *(number(one, 2) for one in pull_off)])
    if not rows:
        return "None yet."
    by_paper, by_seeds = (", ".join(sorted(errors, key=lambda name, at=at: errors[name][at])) for at in (0, 1))
    order = f"Order by held-out MSE: {by_paper} by the recipe `paper`; {by_seeds} by the seeds."
    return f"{markdown_table(header, rows, 'lrlrrrr')}\n\n{order}"


def hours_text(models: Path, training_speed: Any) -> str:
    """Core hours of each training that the paper's recipe ended: of its batches if measured, otherwise as recorded."""
    folders = {name: models / label for name, label in PAPER_TRAINED.items() if ended_by_recipe(models / label)}
    seconds = {name: training_seconds(one, batch_seconds(training_speed)) for name, one in folders.items()}
    return ", ".join(f"{name} {number(one / 3600.0, 2)}" for name, one in seconds.items() if one)


def _trained(folder: Path) -> tuple[dict[str, Any], bool]:
    """Metrics of a model directory, and whether its recipe ended the training."""
    return json.loads((folder / "metrics.json").read_text(encoding="utf-8")), ended_by_recipe(folder)


def hard_cases_text(hard_case_map: Any) -> str:
    """How many random cases in and beyond the paper's box change by more than the target when refined."""
    target = resolve_accuracy(hard_case_map["accuracy"]).target
    changes = {
        where: [row["change"] for row in hard_case_map["map"] if row["where"] == where]
        for where in ("inside", "beyond")
    }
    missed = {where: sum(change > target for change in found) for where, found in changes.items()}
    beyond = changes["beyond"]
    return (
        f"{missed['beyond'] or 'none'} of {len(beyond)} random cases far beyond it at `{hard_case_map['accuracy']}` "
        f"({100.0 * target:g} %) change by more than the target when refined, at most by {100.0 * max(beyond):.1f} %; "
        f"{missed['inside'] or 'none'} of {len(changes['inside'])} inside"
    )


def campaign_text(campaign_scale: Any) -> str:
    """How much faster two processes of a campaign are than one, and what their starts take."""
    one, two = campaign_scale["runs"]
    count, start = campaign_scale["count"], campaign_scale["start"]
    return (
        f"{one['wall'] / two['wall']:.2f} times over {count:,} trajectories of "
        f"{1e3 * one['processor'] / count:.0f} ms, "
        f"starts included; 1.9 was the aim. A worker starts in {start['worker']:.1f} s, the command in "
        f"{start['command']:.1f} s"
    )


def draft_text(accuracy_cost: Any) -> str:
    """The errors of the pull-off force at draft accuracy."""
    errors = next(tool for tool in accuracy_cost["tools"] if tool["setting"] == "draft")["errors"]["pull_off_force"]
    worst, usual = (number(100.0 * errors[name], 2) for name in ("largest", "p95"))
    return f"by {usual} % (95th percentile) and by at most {worst} % on {accuracy_cost['protocols']} held-out protocols"


def pretrained_text(ways_to_call: Any) -> str:
    """What one call costs."""
    seconds = ways_to_call["seconds"]
    cheaper = seconds["solver"]["batch"] / seconds["fast"]["batch"]
    return (
        f"`fast` is {cheaper:.0f} times cheaper than the solver at standard accuracy, and a single call takes "
        f"{1e3 * seconds['fast']['single']:.2g} ms (aims: 100 times, 0.1 ms)"
    )


def vertices_text(errors_by_place: Any) -> str:
    """Coverage and errors at the vertices of the ranges."""
    corners = {name: one["vertices"] for name, one in errors_by_place["models"].items()}
    held = " and ".join(f"{corners[name]['inside/pull_off']:.2f} (`{name}`)" for name in ("accurate", "fast"))
    errors = ", ".join(f"{number(one['pull_off'][1], 2)} % ({name})" for name, one in corners.items())
    return (
        f"at the 32 vertices, modulus ratio 0.1, the 90 % interval of the pull-off force contains the solver's value "
        f"in {held} of the cases; the errors at the 90th percentile are {errors}"
    )


def targets() -> str:
    """Every figure and table with its title, in the order of `captions.toml`."""
    rows = [[f"`make {name}`", words["title"]] for name, words in captions().items() if "title" in words]
    return markdown_table(["Target", "Shows"], rows)


def stages(published: Path) -> str:
    """What each stage of the reproduction from scratch does, and its hours; `e` marks an estimate."""
    known = read_stages()
    hours = {name: hours_of(name, known, published) for name in known}
    rows = [
        [f"`make {name}`", known[name]["does"], f"{value:.2g}{'' if sure else ' e'}"]
        for name, (value, sure) in hours.items()
    ]
    return markdown_table(["Stage", "Does", "Hours"], rows, "llr")


def minutes(target_minutes: Any) -> str:
    """Minutes of all figures and tables, and of the small run from scratch, as they were measured."""
    spent = target_minutes["minutes"]
    return (
        f"All figures and tables take {spent['figures tables']:.1f} minutes, the report included {spent['paper']:.1f}, "
        f"and `make smoke` {spent['smoke']:.1f}, on {target_minutes['host']}"
    )
