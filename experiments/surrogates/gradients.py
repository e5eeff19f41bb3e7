"""Gradients of the pull-off force by finite differences, through a surrogate in one batch and through the solver.

The inputs F and their measurement steps are compiled and not differentiated automatically, so the gradient of a
pretrained model is that of central differences of the network: twelve predictions for six quantities, of many protocols
in one batch. A gradient is that of the logarithm of the pull-off force by the logarithms of the quantities, at
differences of 5 % to either side, which every tool uses: an error is the tool's own and not that of the difference.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from experiments.measurements.cases import Hidden
from experiments.measurements.statistics import quantiles
from experiments.measurements.tools import predicted
from surrogate.prediction.bands import KNOWN as QUANTITIES
from surrogate.prediction.files import BANDED as NAMES

COMMON = 5
"""The first ones, which a model of one material has too."""
STEP = 0.05
"""Difference of a logarithm."""
FINE = 5e-4
"""Accuracy of the solver whose gradient counts as true."""

PullOff = Callable[[Hidden], Iterable[float]]
"""Pull-off forces of some protocols."""


def neighbours(hidden: Hidden, count: int = len(QUANTITIES)) -> Hidden:
    """Protocols with each of the first `count` quantities less, then with each more: 2 `count` n rows."""
    base = np.log([hidden.quantities[name] for name in QUANTITIES])
    one = np.eye(len(QUANTITIES))[:count]
    moved = base + STEP * np.concatenate([-one, one])[:, :, np.newaxis]
    rows = np.exp(moved).transpose(1, 0, 2).reshape(len(QUANTITIES), -1)
    return Hidden(dict(zip(QUANTITIES, rows, strict=True)))


def gradient(pull_off: PullOff, hidden: Hidden, count: int = len(QUANTITIES)) -> np.ndarray:
    """Derivatives of the logarithm of the pull-off force by those of the first `count` quantities, shape (n, count)."""
    logs = np.log(np.fromiter(pull_off(neighbours(hidden, count)), float)).reshape(2, count, len(hidden))
    return (logs[1] - logs[0]).T / (2.0 * STEP)


def count_of(name: str) -> int:
    """How many derivatives a tool has: the models of the paper's kind know one material."""
    return len(QUANTITIES) if name in ("solver", *NAMES) else COMMON


def of_solver(accuracy: str | float) -> PullOff:
    """Pull-off forces of the solver."""
    return lambda hidden: (one.pull_off_force for one in hidden.simulated(accuracy))


def of_model(model: Any, name: str) -> PullOff:
    """Pull-off forces of a model."""
    return lambda hidden: (one.pull_off_force for one in predicted(model, name, hidden))


def errors(found: np.ndarray, true: np.ndarray) -> dict[str, dict[str, float] | None]:
    """Errors of gradients (n, 5) or (n, 6): of the common quantities as a share of the gradient, and of the last one.

    The derivative by the modulus ratio may vanish: its error is absolute, in hundredths.
    """
    common = np.linalg.norm(found[:, :COMMON] - true[:, :COMMON], axis=1) / np.linalg.norm(true[:, :COMMON], axis=1)
    last = np.abs(found[:, COMMON] - true[:, COMMON]) if found.shape[1] > COMMON else None
    return {"common": quantiles(common), "modulus_ratio": None if last is None else quantiles(last)}
