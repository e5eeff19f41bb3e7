"""Which of the paper's rankings hold: every published seed of every model, spreads, and the probability of each order.

The study reads `published/seeds.h5`; it trains and predicts nothing. Seeds are compared if they were trained
on the shipped data set with the same recipe and the same test part. Another backend counts as another seed: it computes
the same up to rounding errors, and draws other initial weights. The rankings, and the model that the paper ranks first,
are the claims in `paper_values/claims.toml` that have a `ranking`. Each order is decided by the held-out MSE, as in the
paper. Percentages are medians over the test set, as in the table of the models; the other errors are means.

The errors of a model are an array of shape (seeds, trajectories); the error of several seeds is their median. All
models share the resamples of the trajectories, so that a difficult trajectory is difficult for all of them. The
hierarchical bootstrap also draws, with replacement, as many seeds of each model as it has.

Sources: the paper's section "Model-family selection" and its appendix on conditioning; Efron and Tibshirani, An
Introduction to the Bootstrap, sections 6.2, 8.3 and 13.3.
"""

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from experiments.common import Dataset
from experiments.paper_numbers import paper_claims
from experiments.published_models import REFERENCE
from experiments.run_folders import read_trainings
from surrogate.architectures.naming import CONDITIONINGS, PAPER_FAMILIES, paper_names
from surrogate.data.dataset import TrajectoryDataset

COLUMNS = {
    "test_mse": "mse",
    "test_mae": "mae",
    "test_dtw_rmse": "dtw_rmse",
    "pull_off_percent": "pull_off_force_percent",
    "hysteresis_percent": "hysteresis_percent",
}
"""Names of the metrics in `metrics` and `test_errors` of a training."""
MEDIANS = ("pull_off_percent", "hysteresis_percent")
"""Metrics that are medians over the test trajectories; the others are means."""
EXPECTED = 3
"""Number of seeds of each model; they are numbered from zero."""
RESAMPLES, CHUNK = 4000, 200
"""Resamples of the test set, and those computed at a time, which bounds the memory."""
CONFIDENCE = 0.95
LEAST_SEEDS = 2
"""Least number of seeds of each model for an order to be decided."""
HOLDS, TIE, FAILS, NOT_DECIDED = "holds", "tie", "fails", "not decided"
INPUTS = {features: [f"features-{features}"] for features in "ABCD"}
"""Labels of the seeds of the study of input representations."""


def resampled(trajectories: int, resamples: int) -> np.ndarray:
    """Indices of shape (resamples, trajectories), drawn with replacement from a fixed seed."""
    return np.random.default_rng(0).integers(trajectories, size=(resamples, trajectories), dtype=np.int32)


def replicates(errors: np.ndarray, indices: np.ndarray, metric: str) -> np.ndarray:
    """Error of each seed on each resample of the test set, shape (seeds, resamples)."""
    statistic: Callable[..., Any] = np.median if metric in MEDIANS else np.mean
    chunks = [indices[start : start + CHUNK] for start in range(0, len(indices), CHUNK)]
    return np.array([np.concatenate([statistic(seed[chunk], axis=1) for chunk in chunks]) for seed in errors])


def interval(medians: np.ndarray) -> tuple[float, float]:
    """Percentile interval, at `CONFIDENCE`, of the median over seeds, from replicates of shape (seeds, resamples)."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(np.median(medians, axis=0), [tail, 1.0 - tail])
    return float(low), float(high)


def hierarchical(errors: np.ndarray, name: str) -> np.ndarray:
    """Median error over resampled seeds, of shape (resamples,).

    Args:
        errors: Replicates of shape (seeds, resamples).
        name: The model. It seeds the draw, so that the numbers of a model do not change when another is published.
    """
    seeds, resamples = errors.shape
    drawn = np.random.default_rng([1, *name.encode()]).integers(seeds, size=(seeds, resamples))
    return np.median(np.take_along_axis(errors, drawn, axis=0), axis=0)


def probability(better: Sequence[np.ndarray], worse: Sequence[np.ndarray]) -> float:
    """Share of resamples in which the best model of `better` errs less than the best of `worse`; a tie counts half."""
    first, second = np.min(better, axis=0), np.min(worse, axis=0)
    return float(np.mean(first < second) + 0.5 * np.mean(first == second))


def decision(chance: float | None) -> str:
    """Decision on an order from its probability; `None` means too few seeds."""
    if chance is None:
        return NOT_DECIDED
    if chance >= CONFIDENCE:
        return HOLDS
    return FAILS if chance <= 1.0 - CONFIDENCE else TIE


def verdict(decisions: Sequence[str]) -> str:
    """Decision on a ranking from the decisions on its orders.

    The ranking fails if one order fails, and holds only if all orders hold.
    """
    return next((word for word in (FAILS, NOT_DECIDED, TIE) if word in decisions), HOLDS)


def orders(
    champion: str,
    contenders: Mapping[str, Sequence[str]],
    drawn: Mapping[str, Mapping[str, np.ndarray]],
    seeds: Mapping[str, int],
) -> list[dict[str, Any]]:
    """The order of the champion and each other contender, with its probability by each metric.

    Args:
        champion: The contender that the paper ranks first.
        contenders: The models of each contender; the error of a contender is that of its best model.
        drawn: What `hierarchical` returns, by metric and model.
        seeds: Number of seeds by model; zero for a model that is absent.
    """
    pairs = []
    for rival in (label for label in contenders if label != champion):
        pair = champion, rival
        both = [min(seeds.get(name, 0) for name in contenders[label]) for label in pair]
        chances: dict[str, float | None] = dict.fromkeys(COLUMNS)
        for metric in COLUMNS if min(both) >= LEAST_SEEDS else ():
            chances[metric] = probability(*([drawn[metric][name] for name in contenders[label]] for label in pair))
        ruling = decision(chances["test_mse"])
        pairs.append({"better": champion, "worse": rival, "seeds": both, "probability": chances, "decision": ruling})
    return pairs


def contenders(claim: dict[str, Any]) -> tuple[str, dict[str, list[str]]]:
    """The contender that the paper ranks first, and all contenders, by label, with the models of each.

    Raises:
        ValueError: The ranking of the claim is unknown.
    """
    ranking, _, family = claim["ranking"].partition("/")
    by_family = {group: [f"{group}-{how}" for how in CONDITIONINGS] for group in PAPER_FAMILIES}
    contenders_by_ranking = {
        "best_model": {name: [name] for name in paper_names()},
        "best_conditioning": {how: [f"{family}-{how}"] for how in CONDITIONINGS},
        "second_family": {group: names for group, names in by_family.items() if group != REFERENCE.split("-")[0]},
        "concatenation_suffices": {how: [f"{group}-{how}" for group in PAPER_FAMILIES] for how in CONDITIONINGS},
        "best_input": INPUTS,
        "d_better_than_c": {features: INPUTS[features] for features in "CD"},
    }
    if ranking not in contenders_by_ranking:
        raise ValueError(f"a ranking must be one of {', '.join(contenders_by_ranking)}; received {claim['ranking']!r}")
    first = {"concatenation_suffices": "concat", "d_better_than_c": "D"}.get(ranking, claim["value"])
    return first, contenders_by_ranking[ranking]


def seed_facts(training: dict[str, Any]) -> dict[str, Any]:
    """Errors of one training of `read_trainings` on the test set, and its settings.

    Raises:
        ValueError: A quantity is missing.
    """
    try:
        run, errors, test = training["run"], training["test_errors"], training["metrics"]["test"]
        curve = training["history"]["validation_mse"].tolist()
        row = {"seed": int(run["seed"]), "backend": run["backend"]}
        row |= {name: float(test[column]["median" if name in MEDIANS else "mean"]) for name, column in COLUMNS.items()}
        return {
            "seed": row["seed"],
            "data set": run["dataset_sha256"],
            "recipe": training["recipe"] | {"seed": None},
            "inputs": run["features"],
            "architecture": run["architecture"],
            "test part": errors["trajectory"].astype(int).tolist(),
            "errors": {name: errors[column] for name, column in COLUMNS.items()},
            "row": row | {"validation_mse": min(curve)},
            "curve": curve,
        }
    except LookupError as error:
        raise ValueError(f"seed must have the errors and settings of a training; it lacks {error}") from error


def comparable_seeds(seeds: Path, digest: str) -> tuple[dict[str, list[dict[str, Any]]], dict[str, str]]:
    """Seeds that can be compared, by model and in order, and a sentence for each seed that is left out."""
    facts = {label: seed_facts(training) for label, training in read_trainings(seeds).items()}
    ours = {label: training for label, training in facts.items() if training["data set"] == digest}
    kept: dict[str, list[dict[str, Any]]] = {name: [] for name in (*paper_names(), *(n for (n,) in INPUTS.values()))}
    left_out = {}

    def usual(trainings: list[dict[str, Any]], word: str) -> Any:
        frequency = Counter(json.dumps(training[word], sort_keys=True) for training in trainings)
        return json.loads(frequency.most_common(1)[0][0])

    for label, training in facts.items():
        name = label.split("/")[0]
        architecture = REFERENCE if name.startswith("features-") else name
        inputs = name.removeprefix("features-") if name.startswith("features-") else "D"
        # The study of input representations has its own recipe.
        alike = [peer for key, peer in ours.items() if (key.split("/")[0] in paper_names()) == (name in paper_names())]
        reasons = [] if label in ours else ["data set"]
        reasons += [word for word in ("recipe", "test part") if not reasons and training[word] != usual(alike, word)]
        if name not in kept or (training["architecture"], training["inputs"]) != (architecture, inputs):
            reasons.append("model")
        if reasons:
            left_out[label] = f"left out, because its {' and '.join(reasons)} differs"
        else:
            kept[name].append(training)
    return {name: sorted(rows, key=lambda run: run["seed"]) for name, rows in kept.items() if rows}, left_out


def ranked() -> list[dict[str, Any]]:
    """The paper's claims that rank models."""
    return [claim for claim in paper_claims() if "ranking" in claim]


def rankings(errors: dict[str, dict[str, np.ndarray]], rows: dict[str, list[dict[str, Any]]]) -> dict[str, Any]:
    """Spreads and intervals of all models, and the decision on each of the paper's rankings.

    `errors` are arrays of shape (seeds, trajectories), by model and metric; `rows` has one row for each seed, by model.
    """
    spread: dict[str, dict[str, Any]] = {name: {} for name in errors}
    drawn: dict[str, dict[str, np.ndarray]] = {metric: {} for metric in COLUMNS}
    for name, by_metric in errors.items():
        indices = resampled(by_metric["test_mse"].shape[1], RESAMPLES)
        for metric in (*COLUMNS, "validation_mse"):
            values = [row[metric] for row in rows[name]]
            spread[name][metric] = {"min": min(values), "median": float(np.median(values)), "max": max(values)}
        for metric in COLUMNS:
            drawn_errors = replicates(by_metric[metric], indices, metric)
            spread[name][metric] |= dict(zip(("low", "high"), interval(drawn_errors), strict=True))
            drawn[metric][name] = hierarchical(drawn_errors, name)
    seeds = {name: len(model_rows) for name, model_rows in rows.items()}
    pairs, claims = [], {}
    for claim in ranked():
        champion, contenders_by_label = contenders(claim)
        decided = orders(champion, contenders_by_label, drawn, seeds)
        pairs += [{"claim": claim["ranking"], **pair} for pair in decided]
        present = {label: [name for name in names if name in spread] for label, names in contenders_by_label.items()}
        medians = {
            label: min(spread[name]["test_mse"]["median"] for name in names)
            for label, names in present.items()
            if names
        }
        claims[claim["ranking"]] = {
            "paper": champion,
            "first": min(medians, key=medians.__getitem__, default=None),
            "level": [champion, *(pair["worse"] for pair in decided if pair["decision"] == TIE)],
            "decision": verdict([pair["decision"] for pair in decided]),
        }
    return {"spread": spread, "pairs": pairs, "claims": claims}


def study(dataset: Dataset, seeds: Path) -> dict[str, Any]:
    """Rank the published seeds; `curves` holds the validation errors by model, seed and epoch."""
    digest = TrajectoryDataset.load(dataset).sha256
    kept, left_out = comparable_seeds(seeds, digest)
    errors = {
        name: {metric: np.array([training["errors"][metric] for training in trainings]) for metric in COLUMNS}
        for name, trainings in kept.items()
    }
    rows = {name: [training["row"] for training in trainings] for name, trainings in kept.items()}
    present = {name: {row["seed"] for row in rows.get(name, ())} for name in paper_names()}
    missing = {name: [seed for seed in range(EXPECTED) if seed not in seen] for name, seen in present.items()}
    return {
        "dataset_sha256": digest,
        "confidence": CONFIDENCE,
        "resamples": RESAMPLES,
        "seeds_expected": EXPECTED,
        "models": rows,
        "curves": {name: [training["curve"] for training in trainings] for name, trainings in kept.items()},
        "missing": {name: absent for name, absent in missing.items() if absent},
        "left_out": left_out,
        **rankings(errors, rows),
    }
