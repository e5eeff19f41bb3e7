"""What each way to call `fast`, `accurate` and a model of the paper costs, beside the solver, and errors of gradients.

Processor seconds are of one thread, per trajectory, in a batch and in single calls, and per gradient of the pull-off
force, taken in turns with the solver's, on hidden protocols of the paper's modulus ratio. Errors of forces are measured
by `experiments.surrogates.errors_by_place`.

The inputs F and their measurement steps are compiled and not differentiated automatically, so the gradient of a
pretrained model is that of central differences of the network: twelve predictions for six quantities, of many protocols
in one batch. A gradient is that of the logarithm of the pull-off force by the logarithms of the quantities, at
differences of 5 % to either side, which every tool uses: an error is the tool's own and not that of the difference.
Errors are relative to the solver at a finer accuracy.
"""

from collections.abc import Callable, Iterable
from typing import Annotated, Any

import numpy as np
import typer

import surrogate
from experiments.cases import Hidden, results_of
from experiments.common import MODULUS_RATIO
from experiments.harness import Count, in_turn
from experiments.measurements.statistics import quantiles
from experiments.measurements.tools import predicted
from surrogate.files import BANDED as NAMES
from surrogate.intervals import KNOWN as QUANTITIES

COVERAGE = 0.9
ROUNDS = 5
COMMON = 5
"""The first ones, which a model of one material has too."""
STEP = 0.05
"""Difference of a logarithm."""
FINE = 5e-4
"""Accuracy of the solver whose gradient counts as true."""
SOLVERS = {"solver": "standard", "draft": "draft"}
"""Names of the solver in results, and its accuracy."""

PullOff = Callable[[Hidden], Iterable[float]]


def gradient(pull_off: PullOff, hidden: Hidden, count: int = len(QUANTITIES)) -> np.ndarray:
    """Derivatives of the logarithm of the pull-off force by those of the first `count` quantities, shape (n, count)."""
    base, directions = np.log([hidden.quantities[name] for name in QUANTITIES]), np.eye(len(QUANTITIES))[:count]
    # Each quantity less, then each more: 2 `count` n protocols.
    moved = base + STEP * np.concatenate([-directions, directions])[:, :, np.newaxis]
    rows = np.exp(moved).transpose(1, 0, 2).reshape(len(QUANTITIES), -1)
    forces = pull_off(Hidden(dict(zip(QUANTITIES, rows, strict=True))))
    logs = np.log(np.fromiter(forces, float)).reshape(2, count, len(hidden))
    return (logs[1] - logs[0]).T / (2.0 * STEP)


def count_of(name: str) -> int:
    """How many derivatives a tool has: the models of the paper's kind know one material."""
    return len(QUANTITIES) if name in (*SOLVERS, *NAMES) else COMMON


def of_solver(accuracy: str | float) -> PullOff:
    """Pull-off forces of the solver."""
    return lambda hidden: (trajectory.pull_off_force for trajectory in hidden.simulated(accuracy))


def of_model(model: Any, name: str) -> PullOff:
    """Pull-off forces of a model."""
    return lambda hidden: (prediction.pull_off_force for prediction in predicted(model, name, hidden))


def gradient_errors(gradients: np.ndarray, true: np.ndarray) -> dict[str, float]:
    """Errors of gradients (n, 5) or (n, 6), of the quantities that all tools know, as a share of the gradient."""
    size = np.linalg.norm(true[:, :COMMON], axis=1)
    return quantiles(np.linalg.norm(gradients[:, :COMMON] - true[:, :COMMON], axis=1) / size)


def results(name: str, model: Any, hidden: Hidden) -> list[Any]:
    """What a user asks of a prediction, which belongs to its cost."""
    predictions = predicted(model, name, hidden, coverage=COVERAGE)
    return [(run.pull_off_force, run.hysteresis, getattr(run, "pull_off_interval", None)) for run in predictions]


def cost(models: dict[str, Any], hidden: Hidden) -> dict[str, dict[str, float]]:
    """Median processor seconds of the solver at two accuracies and of every model, by what is asked.

    `batch` and `single` are per trajectory, `gradient` is that of a gradient of many protocols in one batch. The
    solver's gradient is its simulations.
    """
    few = len(hidden) // ROUNDS
    some = [hidden.part(slice(turn, few * ROUNDS, ROUNDS)) for turn in range(ROUNDS)]

    def of(name: str, model: Any) -> dict[str, tuple[Callable[[int], Any], int]]:
        return {
            "batch": (lambda _: results(name, model, hidden), len(hidden)),
            "single": (lambda turn: [results(name, model, some[turn].part(slice(i, i + 1))) for i in range(few)], few),
            "gradient": (lambda turn: gradient(of_model(model, name), some[turn], count_of(name)), few),
        }

    calls = {(name, way): call for name, model in models.items() for way, call in of(name, model).items()}
    solved = {name: (lambda turn, a=a: results_of(some[turn].simulated(a)), few) for name, a in SOLVERS.items()}
    seconds, costs = in_turn(solved | calls, ROUNDS), {}
    for name in SOLVERS:
        per_call = seconds[name]
        costs[name] = {"batch": per_call, "single": per_call, "gradient": 2 * len(QUANTITIES) * per_call}
    return costs | {name: {way: seconds[model, way] for model, way in calls if model == name} for name in models}


def study(
    *, count: Count = 128, model: Annotated[list[str] | None, typer.Option(help="Models; repeat the option.")] = None
) -> dict[str, Any]:
    """Compare the cost and the gradients of the models and the solver; the cases are the protocols of one batch."""
    models = {name: surrogate.load(name) for name in model or [*NAMES, "M1-concat"]}
    hidden = Hidden.draw(count, MODULUS_RATIO)
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
        "seconds": cost(models, hidden),
    }
