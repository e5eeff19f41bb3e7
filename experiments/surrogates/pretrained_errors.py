"""Errors, bands and cost of `fast` and `accurate` on hidden protocols, beside a model of the paper and the solver.

Hidden protocols are off the paper's grid, at its modulus ratio and at any; the corners of the paper's ranges are listed
apart, since no training has more than a few protocols near them. The truth is the solver at standard accuracy: its own
pull-off force and hysteresis. Processor seconds are of one thread, per trajectory, in a batch and in single calls, per
gradient of the pull-off force and per step of a stream, taken in turns with the solver's. Errors of gradients
(`experiments.surrogates.gradients`) are relative to the solver at a finer accuracy.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import typer

import surrogate
from experiments.common import MODULUS_RATIO
from experiments.measurements.cases import ANY_SOLID, Hidden, regions, results_of
from experiments.measurements.harness import Count, in_turn
from experiments.measurements.statistics import quantiles
from experiments.measurements.tools import predicted, streamed
from experiments.surrogates import gradients
from surrogate.prediction.files import BANDED as NAMES

COVERAGE = 0.9
FAST = 100.0
"""Unloading rate above which peaks are narrow."""
TIMED = 128
"""Protocols of one batch whose seconds are measured."""
ROUNDS = 5


def compare(name: str, model: Any, hidden: Hidden, truth: np.ndarray) -> dict[str, Any]:
    """Errors of one model, those by region, and how often its bands contain the truth (n, 2)."""
    found = predicted(model, name, hidden, coverage=COVERAGE)
    results = results_of(found)
    errors = np.abs(results / truth - 1.0)

    def of(rows: np.ndarray) -> dict[str, Any]:
        return {"pull_off": quantiles(errors[rows, 0]), "hysteresis": quantiles(errors[rows, 1])}

    content: dict[str, Any] = of(np.ones(len(errors), dtype=bool))
    if name in NAMES:
        low, high = np.array([one.pull_off_interval for one in found]).T
        inside = (low <= truth[:, 0]) & (truth[:, 0] <= high)
        quick = hidden.quantities["unloading_rate"] > FAST
        content |= {
            "covered": float(inside.mean()),
            "covered_fast": float(inside[quick].mean()) if quick.any() else None,
            "width": quantiles((high - low) / results[:, 0]),
            "regions": {
                region: {"count": int(rows.sum()), **of(rows), "covered": float(inside[rows].mean())}
                for region, rows in regions(hidden.quantities).items()
            },
        }
    return content


def asked(name: str, model: Any, hidden: Hidden) -> list[Any]:
    """What a user asks of a prediction, which belongs to its cost."""
    found = predicted(model, name, hidden, coverage=COVERAGE)
    return [(one.pull_off_force, one.hysteresis, getattr(one, "pull_off_interval", None)) for one in found]


def cost(models: dict[str, Any], hidden: Hidden) -> dict[str, dict[str, float]]:
    """Median processor seconds of the solver and of every model, by what is asked.

    `batch` and `single` are per trajectory, `gradient` is that of a gradient of many protocols in one batch, `step`
    that of one step of a stream. The solver's gradient is its simulations, its step one of its own time steps.
    """
    size = len(hidden)
    parts = [hidden.part(slice(turn, size, ROUNDS)) for turn in range(ROUNDS)]
    few = len(parts[-1])
    some = [part.part(slice(0, few)) for part in parts]  # as many in each round
    steps: dict[str, int] = {}

    def solved(turn: int) -> None:
        found = list(some[turn].simulated())
        results_of(found)
        steps["solver"] = sum(one.stats.steps for one in found)

    calls: dict[str, Any] = {"solver": solved}
    per_call = {"solver": few}
    for name, model in models.items():
        stream = streamed(model, name, hidden)

        def batch(_: int, name: str = name, model: Any = model) -> None:
            asked(name, model, hidden)

        def single(turn: int, name: str = name, model: Any = model) -> None:
            for row in range(few):
                asked(name, model, some[turn].part(slice(row, row + 1)))

        def gradient(turn: int, name: str = name, model: Any = model) -> None:
            gradients.gradient(gradients.of_model(model, name), some[turn], gradients.count_of(name))

        def step(turn: int, name: str = name, stream: Any = stream) -> None:
            steps[name] = sum(stream(row) for row in range(turn, size, ROUNDS)[:few])

        kinds = {"batch": (batch, size), "single": (single, few), "gradient": (gradient, few), "step": (step, 1)}
        for kind, (call, cases) in kinds.items():
            calls[f"{name}/{kind}"], per_call[f"{name}/{kind}"] = call, cases
    seconds = in_turn(calls, ROUNDS, per_call)
    each = seconds["solver"]
    found = {"solver": {"batch": each, "single": each, "gradient": 2 * len(gradients.QUANTITIES) * each}}
    found["solver"]["step"] = each * few / steps["solver"]
    for name in models:
        found[name] = {kind: seconds[f"{name}/{kind}"] for kind in ("batch", "single", "gradient", "step")}
        found[name]["step"] /= steps[name]
    return found


def slopes(models: dict[str, Any], hidden: Hidden) -> dict[str, Any]:
    """Errors of the gradients of the solver at standard accuracy and of every model."""
    true = gradients.gradient(gradients.of_solver(gradients.FINE), hidden)
    tools = {"solver": gradients.of_solver("standard")}
    tools |= {name: gradients.of_model(model, name) for name, model in models.items()}
    found = {
        name: gradients.errors(gradients.gradient(tool, hidden, gradients.count_of(name)), true)
        for name, tool in tools.items()
    }
    return {"count": len(hidden), "difference": gradients.STEP, "fine": gradients.FINE, "tools": found}


def study(
    *, count: Count = 2000, model: Annotated[list[str] | None, typer.Option(help="Models; repeat the option.")] = None
) -> dict[str, Any]:
    """Compare the models on hidden protocols, at the corners of the ranges, and their cost."""
    models = {name: surrogate.load(name) for name in model or [*NAMES, "M1-concat"]}
    errors: dict[str, dict[str, Any]] = {name: {} for name in models}
    several = {
        "paper": Hidden.draw(count, MODULUS_RATIO),
        "any": Hidden.draw(count, ANY_SOLID),
        "corners": Hidden.corners(MODULUS_RATIO),
    }
    for kind, hidden in several.items():
        truth = results_of(hidden.simulated())
        for name, one in models.items():
            if kind != "any" or name in NAMES:
                errors[name][kind] = compare(name, one, hidden, truth)
    few = Hidden.draw(min(count, TIMED), MODULUS_RATIO)
    content = {"count": count, "coverage": COVERAGE, "fast": FAST, "models": errors}
    return content | {"gradients": slopes(models, few), "seconds": cost(models, few)}
