"""Trainings by the paper's own recipe: who made each, and which of the paper's rankings they decide.

`published/models/MODEL-paper` holds one training of each model. More seeds need no weights: `published/
paper_recipe_seeds.h5` holds their errors on each test trajectory, learning curves, metrics and settings, in groups
`MODEL/seed-S` as `experiments.run_folders` describes; `paper_recipe_seeds.json` is its index, for each model a list of
seed, backend, device, hours, command, epochs and MSE.

An order of two contenders of which each model has two seeds is decided as those of `swift` are
(`experiments.trainings.ranking`). Single trainings decide it only if their errors differ by more than the square of the
largest ratio of two seeds by `swift` among the models concerned: the spread by this recipe is not known.

Usage: `python -m experiments.paper.recipe_seeds FOLDER ...` adds finished trainings, which `surrogate train MODEL
--recipe paper --seed S --label MODEL-paper-seed-S` wrote, to both files.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.text_files import read_json
from experiments.common import Dataset, Models, Result, dataset_digest, ended_by_recipe, write_result
from experiments.paper_numbers import PAPER_RECIPE
from experiments.published_models import PAPER_TRAINED_CONTENDERS, REMOVED
from experiments.run_folders import add_seeds, read_table, read_trainings
from experiments.trainings import ranking as rankings
from surrogate.architectures.naming import paper_names

SEEDS = Path("published/paper_recipe_seeds.h5")


def facts(run: dict[str, Any], metrics: dict[str, Any]) -> dict[str, Any]:
    """Who made a training: backend, device, hours, command and seed, with its epochs and held-out MSE.

    Hours are of one core, or of the whole training on a GPU; `None` where neither was recorded.
    """
    seconds = metrics["cpu_seconds"] or run.get("seconds")
    return {
        "seed": run["seed"],
        "backend": f"{run['backend']} {run['versions'].get(run['backend'], '')}".rstrip(),
        "device": run.get("device", "processor"),
        "hours": seconds and seconds / 3600.0,
        "command": run["command"],
        "removed": run.get(REMOVED),
        "epochs": metrics["epochs"],
        "mse": metrics["test"]["mse"]["mean"],
    }


def trainings(models: Path, seeds: Path, digest: str) -> Iterator[tuple[str, dict[str, Any], np.ndarray]]:
    """Name in the rankings, facts and MSE of each test trajectory of all trainings that the paper's recipe ended."""
    for name, label in PAPER_TRAINED_CONTENDERS.items():
        folder = models / label
        if ended_by_recipe(folder) and read_json(folder / "run.json")["dataset_sha256"] == digest:
            run, metrics = (read_json(folder / f"{file}.json") for file in ("run", "metrics"))
            yield name, {"label": label, **facts(run, metrics)}, read_table(folder, "test_errors")["mse"]
    for group, training in read_trainings(seeds).items():
        run, labels = training["run"], (group.split("/")[0], PAPER_RECIPE.format(group.split("/")[0]))
        names = [name for name, label in PAPER_TRAINED_CONTENDERS.items() if label in labels]
        if (run["ended_by"], training["recipe"]["name"], run["dataset_sha256"]) == ("recipe", "paper", digest):
            for name in names:
                yield name, {"label": group, **facts(run, training["metrics"])}, training["test_errors"]["mse"]


def decided(claim: dict[str, Any], errors: dict[str, np.ndarray], spread: dict[str, Any]) -> dict[str, Any]:
    """Decision on one of the paper's rankings.

    Args:
        claim: The claim.
        errors: Errors of shape (seeds, trajectories) by model.
        spread: `min` and `max` over the seeds by `swift`, by model and metric.

    Returns:
        `lacking`, the models without a training; if there is none, also `first`; `level`, the contenders from which the
        paper's first is not separated; `decision`; `ratio`, its error over the least of the others; `apart`, the ratio
        above which single trainings decide; and `seeds`, the least number of them.
    """
    champion, contenders = rankings.contenders(claim)
    names = [name for group in contenders.values() for name in group]
    lacking = [name for name in names if name not in errors]
    if lacking:
        return {"lacking": lacking}
    mse = {name: float(np.median(errors[name].mean(axis=1))) for name in names}
    least = {label: min(mse[name] for name in group) for label, group in contenders.items()}
    ends = [spread[name]["test_mse"] for name in names if name in spread]
    apart = float(max((end["max"] / end["min"] for end in ends), default=np.inf)) ** 2

    def drawn(label: str) -> list[np.ndarray]:
        indices = rankings.resampled(errors[names[0]].shape[1], rankings.RESAMPLES)  # the same for every label
        return [
            rankings.hierarchical(rankings.replicates(errors[name], indices, "test_mse"), name)
            for name in contenders[label]
        ]

    decisions = {}
    for label in contenders.keys() - {champion}:
        both = [name for side in (champion, label) for name in contenders[side]]
        if min(len(errors[name]) for name in both) >= rankings.LEAST_SEEDS:
            decisions[label] = rankings.decision(rankings.probability(drawn(champion), drawn(label)))
        else:
            ratio = least[label] / least[champion]
            far = max(ratio, 1.0 / ratio) > apart
            decisions[label] = (rankings.HOLDS if ratio > 1.0 else rankings.FAILS) if far else rankings.NOT_DECIDED
    open_orders = (rankings.TIE, rankings.NOT_DECIDED)
    return {
        "lacking": [],
        "first": min(least, key=least.__getitem__),
        "level": [champion, *(label for label in contenders if decisions.get(label) in open_orders)],
        "decision": rankings.verdict(list(decisions.values())),
        "ratio": least[champion] / min(error for label, error in least.items() if label != champion),
        "apart": apart,
        "seeds": min(len(errors[name]) for name in names),
    }


def decisions(models: Path, seeds: Path, digest: str, spread: dict[str, Any]) -> dict[str, Any]:
    """All trainings, and the decision on each of the paper's rankings, by its name."""
    rows: list[dict[str, Any]] = []
    errors: dict[str, list[np.ndarray]] = {}
    for name, row, mse in trainings(models, seeds, digest):
        if not any(np.array_equal(mse, other) for other in errors.get(name, ())):  # published, and among the seeds
            rows.append({"model": name, **row})
            errors.setdefault(name, []).append(mse)
    stacked = {name: np.array(columns) for name, columns in errors.items()}
    claims = {claim["ranking"]: decided(claim, stacked, spread) for claim in rankings.ranked()}
    of_models = [row for row in rows if row["model"] in paper_names()]
    on_processors = [row for row in of_models if row["device"] == "processor"]
    backends = Counter(row["backend"] for row in of_models)
    return {
        "trainings": rows,
        "claims": claims,
        "longest": max(on_processors, key=lambda row: row["hours"], default=None),
        "backends": ", ".join(f"{name} of {count} trainings" for name, count in sorted(backends.items())),
        "removed": len({row["model"] for row in of_models if row["removed"]}),
    }


def study(models: Models, dataset: Dataset, ranking: Result = None) -> dict[str, Any]:
    """List the trainings by the paper's recipe and decide the rankings; `ranking` has the spread of other seeds.

    The seeds are those beside the folder of models. Without a spread single trainings decide nothing.
    """
    return decisions(models, models.parent / SEEDS.name, dataset_digest(dataset), ranking["spread"] if ranking else {})


def add(folders: list[Path], seeds: Path = SEEDS) -> None:
    """Add finished trainings by the paper's recipe to the file of seeds, and write its index.

    Raises:
        ValueError: A training is not complete, or its recipe did not end it.
    """
    for folder in folders:
        if not ended_by_recipe(folder) or read_json(folder / "run.json")["recipe"]["name"] != "paper":
            raise ValueError(f"training must be one that the recipe `paper` ended; received {str(folder)!r}")
    add_seeds(seeds, folders)
    index: dict[str, list[dict[str, Any]]] = {}
    for group, training in read_trainings(seeds).items():
        index.setdefault(group.split("/")[0], []).append(facts(training["run"], training["metrics"]))
    write_result(seeds.with_suffix(".json"), "paper_recipe_seeds", {"models": index})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER")
    add(parser.parse_args().folders)
