"""Uncertainty of a ranking: spread over seeds, bootstrap intervals over the test set, and the probability of an order.

The errors of a model are an array of shape (seeds, trajectories); the trajectories are the same for all models. All
models share the resamples of the trajectories, so that a difficult trajectory is difficult for all of them. The
hierarchical bootstrap also draws, with replacement, as many seeds of each model as it has. The error of several seeds
is their median. Source: Efron and Tibshirani, An Introduction to the Bootstrap, sections 6.2, 8.3 and 13.3.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

CONFIDENCE = 0.95
LEAST_SEEDS = 2
"""Least number of seeds of each model for an order to be decided."""
HOLDS, TIE, FAILS, NOT_DECIDED = "holds", "tie", "fails", "not decided"
STATISTICS: dict[str, Callable[..., Any]] = {
    "test_mse": np.mean,
    "test_mae": np.mean,
    "test_dtw_rmse": np.mean,
    "pull_off_percent": np.median,
    "hysteresis_percent": np.median,
}
"""Statistic that reduces the errors of the test trajectories to the error of a training, by metric."""
CHUNK = 200
"""Resamples computed at a time, which bounds the memory."""


def resampled(trajectories: int, resamples: int) -> np.ndarray:
    """Indices of shape (resamples, trajectories), drawn with replacement from a fixed seed."""
    return np.random.default_rng(0).integers(trajectories, size=(resamples, trajectories), dtype=np.int32)


def replicates(errors: np.ndarray, indices: np.ndarray, metric: str) -> np.ndarray:
    """Error of each seed on each resample of the test set, shape (seeds, resamples)."""
    statistic = STATISTICS[metric]
    chunks = [indices[start : start + CHUNK] for start in range(0, len(indices), CHUNK)]
    return np.array([np.concatenate([statistic(seed[chunk], axis=1) for chunk in chunks]) for seed in errors])


def interval(found: np.ndarray) -> tuple[float, float]:
    """Percentile interval, at `CONFIDENCE`, of the median over seeds, from replicates of shape (seeds, resamples)."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(np.median(found, axis=0), [tail, 1.0 - tail])
    return float(low), float(high)


def hierarchical(found: np.ndarray, name: str) -> np.ndarray:
    """Median error over resampled seeds, of shape (resamples,).

    Args:
        found: Replicates of shape (seeds, resamples).
        name: The model. It seeds the draw, so that the numbers of a model do not change when another is published.
    """
    seeds, resamples = found.shape
    drawn = np.random.default_rng([1, *name.encode()]).integers(seeds, size=(seeds, resamples))
    return np.median(np.take_along_axis(found, drawn, axis=0), axis=0)


def probability(better: Sequence[np.ndarray], worse: Sequence[np.ndarray]) -> float:
    """Share of resamples in which the best model of `better` errs less than the best of `worse`; a tie counts half."""
    one, other = np.min(better, axis=0), np.min(worse, axis=0)
    return float(np.mean(one < other) + 0.5 * np.mean(one == other))


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


def duels(
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
    found = []
    for other in (label for label in contenders if label != champion):
        pair = champion, other
        both = [min(seeds.get(name, 0) for name in contenders[label]) for label in pair]
        chances: dict[str, float | None] = dict.fromkeys(STATISTICS)
        for metric in STATISTICS if min(both) >= LEAST_SEEDS else ():
            chances[metric] = probability(*([drawn[metric][name] for name in contenders[label]] for label in pair))
        ruling = decision(chances["test_mse"])
        found.append({"better": champion, "worse": other, "seeds": both, "probability": chances, "decision": ruling})
    return found
