"""Errors of `fast` and `accurate`, coverage and widths of their intervals, over the ranges, at their edges and corners.

An edge is the outermost fifth of one range, in its logarithm; a corner is where all six are; a vertex is an end of the
paper's five ranges, at its modulus ratio. A model of the paper is judged at this ratio alone, and has no intervals.
Errors are relative to the solver's pull-off force, and to its loop area or, if this is more, a hundredth of its work of
loading. Protocols are drawn from the seed of the command line.
"""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

import surrogate
from bem import Trajectory
from bem.dataset.designs import OUTERMOST, Design
from experiments.cases import ANY_SOLID, HIDDEN_SEED, RANGES, Hidden
from experiments.common import MODULUS_RATIO
from experiments.harness import Count
from experiments.measurements.tools import predicted
from surrogate.files import BANDED
from surrogate.intervals import BANDS, RESULTS

COVERAGE = 0.9
LEVELS = (0.5, 0.9, 0.999)
INSIDE = (*RESULTS, *BANDS)
PAPER = "M1-concat"
"""Model of the paper that is judged, too."""
PLACES = ("paper", "vertices", "box")
"""At the paper's modulus ratio, over the ranges and at their ends, and over all ranges."""
WIDTH = 210
"""Of a printed table, in letters."""
MOST_IN_A_CORNER = 3.0
"""Aim: the largest 90th percentile of a corner, over that of the whole ranges."""


def errors_of_model(model: Any, name: str, hidden: Hidden, exact: Sequence[Trajectory]) -> dict[str, np.ndarray]:
    """Errors in percent, what lies inside, and widths over the result in percent, of each protocol."""
    banded = name in BANDED
    answers, rows = predicted(model, name, hidden, **({"coverage": COVERAGE} if banded else {})), []
    for answer, true in zip(answers, exact, strict=True):
        turn = int(np.argmax(true.indentation)) + 1
        pressing = abs(float(np.trapezoid(true.force[:turn], true.indentation[:turn])))  # type: ignore[attr-defined]
        unit = max(true.hysteresis, 0.01 * pressing)
        rows.append(
            [abs(answer.pull_off_force / true.pull_off_force - 1.0), abs(answer.hysteresis - true.hysteresis) / unit]
        )
        if not banded:
            continue
        force = true.at(answer.time)
        intervals = answer.pull_off_interval, answer.pull_off_time_interval, answer.hysteresis_interval
        values = true.pull_off_force, true.pull_off_time, true.hysteresis
        inside = [low <= value <= high for (low, high), value in zip(intervals, values, strict=True)]
        inside.append(np.mean((answer.force_lower <= force) & (force <= answer.force_upper)))
        inside.append(np.all((answer.curve_lower <= force) & (force <= answer.curve_upper)))
        widths = [np.ptp(answer.pull_off_interval) / true.pull_off_force, np.ptp(answer.hysteresis_interval) / unit]
        rows[-1] += [*inside, *widths]
    columns = np.array(rows, dtype=float).T
    names = ("pull_off", "hysteresis", *(f"inside/{name}" for name in INSIDE), "width/pull_off", "width/hysteresis")
    return {key: values if "inside" in key else 100.0 * values for key, values in zip(names, columns, strict=False)}


def summary(errors: dict[str, np.ndarray], rows: np.ndarray) -> dict[str, Any]:
    """Quantiles of errors and widths, and coverages, of some of the protocols."""
    return {"count": int(rows.sum())} | {
        key: float(values[rows].mean()) if "inside" in key else np.quantile(values[rows], LEVELS).tolist()
        for key, values in errors.items()
    }


def places(hidden: Hidden) -> np.ndarray:
    """Where each quantity lies in the logarithm of its range, from 0 to 1, shape (6, n)."""
    low, high = np.array(list(RANGES.values())).T[:, :, np.newaxis]
    values = np.array([hidden.quantities[name] for name in RANGES])
    return np.log(values / low) / np.log(high / low)


def limits_text(errors_by_place: Any) -> str:
    """What both models reach of the aims for errors in pull-off force and hysteresis, and of those for coverage."""
    lines, lowest = [], dict.fromkeys(INSIDE, 1.0)
    for name in BANDED:
        summaries = errors_by_place["models"][name]
        box, corners = summaries["box"], summaries["corners"]
        parts = {key: [row[key][1] / max(box[key][1], 1e-9) for row in corners] for key in ("pull_off", "hysteresis")}
        errors = "pull-off force by " + ", ".join(f"{value:.2g}" for value in box["pull_off"])
        errors += f" %, in hysteresis by {', '.join(f'{value:.2g}' for value in box['hysteresis'][:2])} %"
        above = {key: sum(ratio > MOST_IN_A_CORNER for ratio in ratios) for key, ratios in parts.items()}
        most = {key: max(ratios) for key, ratios in parts.items()}
        lines.append(
            f"`{name}` errs in the {errors}; in {above['pull_off']} of {len(corners)} corners the 90th percentile for "
            f"the pull-off force is more than {MOST_IN_A_CORNER:g} times that of all, {most['pull_off']:.2f} times at "
            f"most, and in {above['hysteresis']} that for hysteresis, {most['hysteresis']:.0f} times at most"
        )
        for key in INSIDE:
            shares = [region[f"inside/{key}"] for region in (box, *corners, *summaries["edges"].values())]
            lowest[key] = min(lowest[key], *shares)
    curve = lowest.pop(INSIDE[-1])
    return (
        f"{'. '.join(lines)}. The 90 % intervals contain {min(lowest.values()):.3f} or more at every edge and in every "
        f"corner, the band of the whole curve {curve:.3f} or more"
    )


def worst(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The largest error and width of several places, and the least coverage, each by itself."""
    return {
        key: min(row[key] for row in rows) if "inside" in key else np.max([row[key] for row in rows], axis=0)
        for key in rows[0]
    } | {"count": min(row["count"] for row in rows)}


def print_table(name: str, summaries: dict[str, Any]) -> None:
    """Print the summaries of a model: a line for each place, and one for the worst of the corners."""
    lines = {region: summaries[region] for region in PLACES if region in summaries} | summaries.get("edges", {})
    if "corners" in summaries:
        lines[f"worst of {len(summaries['corners'])} corners"] = worst(summaries["corners"])
    levels = ", ".join(f"{100.0 * level:g}" for level in LEVELS)
    table = Table(
        title=f"{name}, errors and widths in percent: percentiles {levels}; shares in intervals of {COVERAGE}"
    )
    for key in ("place", *lines[PLACES[0]]):
        header = key.replace("inside/", "in ").replace("width/", "width of ").replace("_", " ")
        table.add_column(header, justify="left" if key == "place" else "right", no_wrap=key == "place")
    for region, row in lines.items():
        cells = (" ".join(f"{value:.3g}" for value in np.atleast_1d(row[key])) for key in row if key != "count")
        table.add_row(region, f"{row['count']:,}", *cells)
    Console(width=WIDTH).print(table)


def study(
    *,
    count: Count = 20_000,
    corner: Annotated[int, typer.Option(help="Protocols in each of the 64 corners.", min=1)] = 600,
    seed: Annotated[int, typer.Option(help="Seed of the protocols.", min=0)] = HIDDEN_SEED,
) -> dict[str, Any]:
    """Judge the pretrained models over the ranges, at their edges and in their corners."""
    result: dict[str, Any] = {"count": count, "corner": corner, "coverage": COVERAGE, "models": {}}
    box = Hidden.draw(count, ANY_SOLID, seed)
    corners = Hidden(Design("corners", modulus_ratio=ANY_SOLID).protocols(64 * corner, seed))
    number, at = (1 << np.arange(6)) @ (places(corners) > 0.5), places(box)
    ends = {"low": at <= OUTERMOST, "high": at >= 1.0 - OUTERMOST}
    edges = {f"{end} {name}": ends[end][row] for row, name in enumerate(RANGES) for end in ends}
    paper = Hidden(box.quantities | {"modulus_ratio": np.full(count, MODULUS_RATIO)})
    exact = [(sample, list(sample.simulated())) for sample in (paper, Hidden.corners(MODULUS_RATIO), box, corners)]
    for name in (*BANDED, PAPER):
        model, banded = surrogate.load(name), name in BANDED
        errors = [errors_of_model(model, name, *pair) for pair in exact[: None if banded else 2]]
        totals = [summary(table, np.ones(len(table["pull_off"]), dtype=bool)) for table in errors]
        rows = result["models"][name] = dict(zip(PLACES, totals, strict=False))
        if banded:
            rows["edges"] = {edge: summary(errors[2], chosen) for edge, chosen in edges.items() if chosen.any()}
            rows["corners"] = [summary(errors[3], number == index) for index in range(64)]
        print_table(name, rows)
    print(limits_text(result))
    return result
