"""How sure a ranking is: spread over seeds, bootstrap intervals over the test set, and the probability of an order.

Errors of a model are an array of shape (seeds, trajectories), the trajectories the same for all models. A resample of
the trajectories is shared by all models, so that a hard trajectory is hard for all of them; the hierarchical bootstrap
also draws as many seeds of each model, with replacement. The number that stands for several seeds is their median.
Source: Efron and Tibshirani, An Introduction to the Bootstrap, sections 6.2, 8.3 and 13.3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

CONFIDENCE = 0.95
LEAST_SEEDS = 2
"""Seeds that both sides of an order need for it to be decided."""
HOLDS, TIE, FAILS, NOT_DECIDED = "holds", "tie", "fails", "not decided"
STATISTICS: dict[str, Callable[..., Any]] = {
    "test_mse": np.mean,
    "test_mae": np.mean,
    "test_dtw_rmse": np.mean,
    "pull_off_percent": np.median,
    "hysteresis_percent": np.median,
}
"""How the errors of the test trajectories become the error of a training."""
CHUNK = 200
"""Resamples taken at once; bounds memory."""


def resampled(trajectories: int, resamples: int) -> np.ndarray:
    """Indices of shape (resamples, trajectories), drawn with replacement; the same ones at every call."""
    return np.random.default_rng(0).integers(trajectories, size=(resamples, trajectories), dtype=np.int32)


def replicates(errors: np.ndarray, indices: np.ndarray, metric: str) -> np.ndarray:
    """Error of each seed on each resample of the test set, shape (seeds, resamples)."""
    statistic = STATISTICS[metric]
    chunks = [indices[start : start + CHUNK] for start in range(0, len(indices), CHUNK)]
    return np.array([np.concatenate([statistic(seed[chunk], axis=1) for chunk in chunks]) for seed in errors])


def interval(found: np.ndarray) -> tuple[float, float]:
    """Percentile interval of the median over seeds, from replicates of shape (seeds, resamples)."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(np.median(found, axis=0), [tail, 1.0 - tail])
    return float(low), float(high)


def hierarchical(found: np.ndarray, name: str) -> np.ndarray:
    """Median error over seeds that are resampled too, shape (resamples,).

    Args:
        found: Replicates of shape (seeds, resamples).
        name: The model; it decides which seeds are drawn, so that another model that is published moves nothing.
    """
    seeds, resamples = found.shape
    drawn = np.random.default_rng([1, *name.encode()]).integers(seeds, size=(seeds, resamples))
    return np.median(np.take_along_axis(found, drawn, axis=0), axis=0)


def probability(better: Sequence[np.ndarray], worse: Sequence[np.ndarray]) -> float:
    """Share of the resamples where the best of the first models errs less than the best of the others."""
    one, other = np.min(better, axis=0), np.min(worse, axis=0)
    return float(np.mean(one < other) + 0.5 * np.mean(one == other))


def decision(chance: float | None) -> str:
    """What a probability of the order says; `None` stands for too few seeds."""
    if chance is None:
        return NOT_DECIDED
    if chance >= CONFIDENCE:
        return HOLDS
    return FAILS if chance <= 1.0 - CONFIDENCE else TIE


def verdict(decisions: Sequence[str]) -> str:
    """Whether one contender is ahead of all others, from the decisions on each order.

    A single order that fails is enough to refute; to confirm, all have to hold.
    """
    for word in (FAILS, NOT_DECIDED, TIE):
        if word in decisions:
            return word
    return HOLDS


def duels(
    champion: str,
    contenders: Mapping[str, Sequence[str]],
    drawn: Mapping[str, Mapping[str, np.ndarray]],
    seeds: Mapping[str, int],
) -> list[dict[str, Any]]:
    """The order of the champion and each other contender, with its probability by every metric.

    Args:
        champion: The contender that the paper ranks first.
        contenders: The models that each contender stands for; its error is that of its best one.
        drawn: What `hierarchical` returns, by metric and model.
        seeds: Number of seeds by model; none where it is absent.
    """

    def least(label: str) -> int:
        return min(seeds.get(name, 0) for name in contenders[label])

    def chance(metric: str, other: str) -> float:
        better, worse = ([drawn[metric][name] for name in contenders[label]] for label in (champion, other))
        return probability(better, worse)

    found = []
    for other in contenders:
        if other == champion:
            continue
        counts = [least(champion), least(other)]
        enough = min(counts) >= LEAST_SEEDS
        chances = {metric: chance(metric, other) if enough else None for metric in STATISTICS}
        ruling = decision(chances["test_mse"])
        found.append({"better": champion, "worse": other, "seeds": counts, "probability": chances, "decision": ruling})
    return found
