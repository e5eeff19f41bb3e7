"""Errors, bands and cost of `fast` and `accurate` on hidden protocols, beside a model of the paper and the solver.

Hidden protocols are off the paper's grid, at its modulus ratio and at any; the corners of the paper's ranges are listed
apart, since no training has more than a few protocols near them. The truth is the solver at standard
accuracy: its own pull-off force and hysteresis. Processor seconds are of one thread, per trajectory, in a batch and in
single calls, per gradient of the pull-off force (`experiments.surrogates.gradients`) and per step of a stream, taken in
turns with the solver's. Errors of gradients are relative to the solver at a finer accuracy.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import surrogate
from bem._support.plain_json import plain
from experiments import common
from experiments.common import MODULUS_RATIO, write_result
from experiments.surrogates import gradients
from experiments.surrogates.hidden_protocols import ANY_SOLID, Hidden, quantiles
from experiments.surrogates.model_calls import pull_offs, streamed
from experiments.surrogates.regions import regions
from experiments.timing import MEASUREMENTS
from surrogate.pretrained.model import NAMES

OUT = MEASUREMENTS / "pretrained_errors.json"
COVERAGE = 0.9
FAST = 100.0
"""Unloading rate above which peaks are narrow."""
TIMED = 128
"""Protocols of one batch whose seconds are measured."""
ROUNDS = 5


def predicted(name: str, hidden: Hidden) -> Callable[[slice], list[Any]]:
    """What predicts some of the protocols; names other than the pretrained are models of the paper's kind."""
    model: Any = surrogate.load(name)
    paths, tabor, ratio = hidden.protocols(), hidden.quantities["tabor"], hidden.quantities["modulus_ratio"]

    def of(part: slice) -> list[Any]:
        given = {"modulus_ratio": ratio[part], "coverage": COVERAGE} if name in NAMES else {}
        found = model.trajectories(paths[part], tabor=tabor[part], **given)
        # What a user asks of a trajectory belongs to its cost.
        return [(one.pull_off_force, one.hysteresis, getattr(one, "pull_off_interval", None)) for one in found]

    return of


def compare(name: str, hidden: Hidden, truth: np.ndarray) -> dict[str, Any]:
    """Errors of one model, those by region, and how often its bands contain the truth (n, 2)."""
    found = predicted(name, hidden)(slice(None))
    results = np.array([row[:2] for row in found])
    errors = np.abs(results / truth - 1.0)
    content: dict[str, Any] = {"pull_off": quantiles(errors[:, 0]), "hysteresis": quantiles(errors[:, 1])}
    if name in NAMES:
        low, high = np.array([row[2] for row in found]).T
        inside = (low <= truth[:, 0]) & (truth[:, 0] <= high)
        quick = hidden.quantities["unloading_rate"] > FAST
        content |= {
            "covered": float(inside.mean()),
            "covered_fast": float(inside[quick].mean()) if quick.any() else None,
            "width": quantiles((high - low) / results[:, 0]),
            "regions": {
                region: {
                    "count": int(rows.sum()),
                    "pull_off": quantiles(errors[rows, 0]),
                    "hysteresis": quantiles(errors[rows, 1]),
                    "covered": float(inside[rows].mean()),
                }
                for region, rows in regions(hidden.quantities).items()
            },
        }
    return content


def cost(names: list[str], hidden: Hidden) -> dict[str, dict[str, float]]:
    """Median processor seconds of the solver and of every model, by what is asked.

    `batch` and `single` are per trajectory, `gradient` is that of a gradient of many protocols in one batch, `step`
    that of one step of a stream. The solver's gradient is its simulations, its step one of its own time steps.
    """
    part = slice(0, min(TIMED, len(hidden)))
    makers = {name: predicted(name, hidden) for name in names}
    slopes = {name: pull_offs(name) for name in names}
    streams = {name: streamed(name, hidden) for name in names}
    for name, make in makers.items():
        make(part)
        make(slice(0, 1))
        gradients.gradient(slopes[name], hidden.part(slice(0, 1)), gradients.of(name))
        streams[name](0)
    kinds = ("batch", "single", "gradient", "step")
    spent: dict[str, dict[str, list[float]]] = {name: {kind: [] for kind in kinds} for name in ("solver", *names)}
    size = part.stop
    for turn in range(ROUNDS):
        chosen = range(turn, size, ROUNDS)
        clock, steps = time.process_time(), 0
        for index in chosen:
            values, ratio = hidden.row(index)
            trajectory = common.simulated(values, accuracy="standard", modulus_ratio=ratio)
            assert trajectory.pull_off_force + trajectory.hysteresis > 0.0
            steps += trajectory.stats.steps
        each = (time.process_time() - clock) / len(chosen)
        spent["solver"]["single"].append(each)
        spent["solver"]["gradient"].append(2 * len(gradients.QUANTITIES) * each)
        spent["solver"]["step"].append(each * len(chosen) / steps)
        for name, make in makers.items():
            clock = time.process_time()
            make(part)
            spent[name]["batch"].append((time.process_time() - clock) / size)
            clock = time.process_time()
            for index in chosen:
                make(slice(index, index + 1))
            spent[name]["single"].append((time.process_time() - clock) / len(chosen))
            some = hidden.part(slice(turn, size, ROUNDS))
            clock = time.process_time()
            gradients.gradient(slopes[name], some, gradients.of(name))
            spent[name]["gradient"].append((time.process_time() - clock) / len(some))
            clock = time.process_time()
            steps = sum(streams[name](index) for index in chosen)
            spent[name]["step"].append((time.process_time() - clock) / steps)
    spent["solver"]["batch"] = spent["solver"]["single"]
    return {name: {kind: float(np.median(values)) for kind, values in row.items()} for name, row in spent.items()}


def slopes(names: list[str], hidden: Hidden) -> dict[str, Any]:
    """Errors of the gradients of the solver at standard accuracy and of every model."""
    true = gradients.gradient(gradients.simulated(gradients.FINE), hidden)
    tools = {"solver": gradients.simulated("standard")} | {name: pull_offs(name) for name in names}
    found = {
        name: gradients.errors(gradients.gradient(tool, hidden, gradients.of(name)), true)
        for name, tool in tools.items()
    }
    return {"count": len(hidden), "difference": gradients.STEP, "fine": gradients.FINE, "tools": found}


def main(
    count: Annotated[int, typer.Option(help="How many protocols of each kind.")] = 2000,
    model: Annotated[list[str] | None, typer.Option(help="Models; repeat the option.")] = None,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Compare the models on hidden protocols, at the corners of the ranges, and their cost."""
    names = model or [*NAMES, "M1-concat"]
    content: dict[str, Any] = {
        "count": count,
        "coverage": COVERAGE,
        "fast": FAST,
        "models": {name: {} for name in names},
    }
    several = {
        "paper": Hidden.draw(count, MODULUS_RATIO),
        "any": Hidden.draw(count, ANY_SOLID),
        "corners": Hidden.corners(MODULUS_RATIO),
    }
    for kind, hidden in several.items():
        truth = np.array([(one.pull_off_force, one.hysteresis) for one in hidden.simulated()])
        for name in names:
            if kind != "any" or name in NAMES:
                content["models"][name][kind] = compare(name, hidden, truth)
                found = {key: value for key, value in content["models"][name][kind].items() if key != "regions"}
                print(f"{name}, {kind}: {found}")
    content["gradients"] = slopes(names, Hidden.draw(min(count, TIMED), MODULUS_RATIO))
    for name, found in content["gradients"]["tools"].items():
        print(f"{name}, gradient: {found}")
    seconds = cost(names, Hidden.draw(min(count, TIMED), MODULUS_RATIO))
    content["seconds"] = seconds
    for name in names:
        ratios = ", ".join(f"{kind} {seconds['solver'][kind] / seconds[name][kind]:.1f}" for kind in seconds[name])
        print(f"{name}: so many times cheaper than the solver: {ratios}")
    write_result(out, f"pretrained_errors --count {count}", plain(content))
