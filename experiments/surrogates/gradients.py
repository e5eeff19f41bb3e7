"""Gradients of `fast`, `accurate` and a model of the paper, beside the solver's: errors and cost.

Processor seconds are of one thread, per gradient of the pull-off force, taken in turns with the solver's, on hidden
protocols of the paper's modulus ratio. Costs of calls are measured by `experiments.measurements.accuracy_cost`.

The features of a pretrained model are compiled and not differentiated automatically, so its gradient is that of central
differences: twelve predictions for six quantities, of many protocols in one batch. A gradient is that of the logarithm
of the pull-off force by the logarithms of the quantities, at differences of 5 % to either side, which every tool uses:
an error is the tool's own and not that of the difference. Errors are relative to the solver at a finer accuracy.
"""

from collections.abc import Callable, Iterable
from typing import Annotated, Any

import numpy as np
import typer

import surrogate
from experiments.cases import RANGES, cases_of, hidden_protocols
from experiments.common import MODULUS_RATIO
from experiments.harness import Count, in_turn
from experiments.measurements.statistics import quantiles
from experiments.measurements.tools import predicted
from surrogate.files import PRETRAINED as NAMES

ROUNDS = 5
QUANTITIES = tuple(RANGES)
COMMON = 5
"""The first ones, which a model of one material has too."""
STEP = 0.05
"""Difference of a logarithm."""
FINE = 5e-4
"""Accuracy of the solver whose gradient counts as true."""
SOLVERS = {"solver": "standard", "draft": "draft"}
"""Names of the solver in results, and its accuracy."""

Columns = dict[str, np.ndarray]
PullOff = Callable[[Columns], Iterable[float]]


def gradient(pull_off: PullOff, hidden: Columns, count: int = len(QUANTITIES)) -> np.ndarray:
    """Derivatives of the logarithm of the pull-off force by those of the first `count` quantities, shape (n, count)."""
    base, directions = np.log([hidden[name] for name in QUANTITIES]), np.eye(len(QUANTITIES))[:count]
    # Each quantity less, then each more: 2 `count` n protocols.
    moved = base + STEP * np.concatenate([-directions, directions])[:, :, np.newaxis]
    rows = np.exp(moved).transpose(1, 0, 2).reshape(len(QUANTITIES), -1)
    forces = pull_off(dict(zip(QUANTITIES, rows, strict=True)))
    logs = np.log(np.fromiter(forces, float)).reshape(2, count, -1)
    return (logs[1] - logs[0]).T / (2.0 * STEP)


def count_of(name: str) -> int:
    """How many derivatives a tool has: the models of the paper's kind know one material."""
    return len(QUANTITIES) if name in (*SOLVERS, *NAMES) else COMMON


def of_solver(accuracy: str | float) -> PullOff:
    """Pull-off forces of the solver."""
    return lambda hidden: (case.simulated(accuracy).pull_off_force for case in cases_of(hidden))


def of_model(model: Any, name: str) -> PullOff:
    """Pull-off forces of a model."""
    return lambda hidden: (prediction.pull_off_force for prediction in predicted(model, name, hidden))


def gradient_errors(gradients: np.ndarray, true: np.ndarray) -> dict[str, float]:
    """Errors of gradients (n, 5) or (n, 6), of the quantities that all tools know, as a share of the gradient."""
    size = np.linalg.norm(true[:, :COMMON], axis=1)
    return quantiles(np.linalg.norm(gradients[:, :COMMON] - true[:, :COMMON], axis=1) / size)


def gradient_seconds(models: dict[str, Any], hidden: Columns) -> dict[str, float]:
    """Median processor seconds of a gradient of many protocols in one batch; the solver's is its simulations."""
    few = len(hidden["tabor"]) // ROUNDS
    some = [{name: values[turn : few * ROUNDS : ROUNDS] for name, values in hidden.items()} for turn in range(ROUNDS)]
    calls: dict[str, tuple[Callable[[int], Any], int]] = {
        name: (lambda turn, m=model, n=name: gradient(of_model(m, n), some[turn], count_of(n)), few)
        for name, model in models.items()
    }
    for name, target in SOLVERS.items():
        calls[name] = (lambda turn, a=target: list(of_solver(a)(some[turn])), few)
    seconds = in_turn(calls, ROUNDS)
    return seconds | {name: 2 * len(QUANTITIES) * seconds[name] for name in SOLVERS}


def study(
    *, count: Count = 128, model: Annotated[list[str] | None, typer.Option(help="Models; repeat the option.")] = None
) -> dict[str, Any]:
    """Compare the cost and the gradients of the models and the solver; the cases are the protocols of one batch."""
    models = {name: surrogate.load(name) for name in model or [*NAMES, "M1-concat"]}
    hidden = hidden_protocols(count, MODULUS_RATIO)
    tools: dict[str, PullOff] = {name: of_solver(accuracy) for name, accuracy in SOLVERS.items()}
    tools |= {name: of_model(trained, name) for name, trained in models.items()}
    true = gradient(of_solver(FINE), hidden)
    slopes = {name: gradient_errors(gradient(tool, hidden, count_of(name)), true) for name, tool in tools.items()}
    exact, solved = np.fromiter(of_solver(FINE)(hidden), float), {}
    for name in SOLVERS:
        solved[name] = quantiles(np.abs(np.fromiter(tools[name](hidden), float) / exact - 1.0))
    return {
        "count": count,
        "models": list(models),
        "gradients": {"difference": STEP, "fine": FINE, "errors": slopes},
        "solvers": solved,  # errors of the pull-off force
        "seconds": {name: {"gradient": value} for name, value in gradient_seconds(models, hidden).items()},
    }
