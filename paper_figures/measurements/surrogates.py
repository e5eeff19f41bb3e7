"""The pretrained models: the steps they predict at, their errors, and parameters by them from a measured curve."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bem._support.wording import markdown_table
from bem.plots import COLOURS, FORCE_LABEL
from paper_figures.style import drawing
from paper_figures.style.writing import Table, caption, number

READINGS = {
    "pull_off": "Highest step",
    "pull_off_parabola": "Top of a parabola",
    "hysteresis_trapezoids": "Hysteresis, trapezoids",
    "hysteresis_cubics": "Hysteresis, monotone cubics",
}
LEAST = 1e-5
"""Errors below are drawn there."""


def draw_peak(axes: Axes, example: dict[str, Any]) -> None:
    """The peak, and the steps on it."""
    depth, force = np.array(example["indentation"]), np.array(example["force"])
    axes.plot(depth, force, color=drawing.BLACK, linewidth=0.8, label="solver")
    for name, steps in example["steps"].items():
        look = {"linestyle": "", "markersize": 2.5, **drawing.STEPS[name]}
        axes.plot(steps["indentation"], steps["force"], label=name, **look)
    top = int(force.argmax())
    axes.set(
        xlabel=drawing.INDENTATION,
        ylabel=drawing.FORCE,
        xlim=(depth[0] + 0.3, depth[top] - 3.0 * (depth[0] - depth[top])),
        ylim=(-0.4 * force[top], 1.2 * force[top]),
    )
    axes.legend(loc="upper right")


def draw_errors(axes: Axes, kinds: dict[str, Any]) -> None:
    """How often the error exceeds a size."""
    for name, kind in kinds.items():
        errors = np.maximum(np.sort(kind["pull_off_errors"])[::-1], LEAST)
        share = np.arange(1, errors.size + 1) / errors.size
        points = "+".join(map(str, kind["counts"]))
        axes.loglog(100.0 * errors, share, color=drawing.STEPS[name]["color"], label=f"{name}, {points}")
    for share in (0.1, 0.01):
        axes.axhline(share, color="0.7", linewidth=0.5, linestyle=":")
    axes.set(xlabel="error of the highest step (%)", ylabel="share of protocols above", ylim=(1e-3, 1.0))
    axes.legend(loc="lower left")


def floor_text(measurement_floor: Any) -> str:
    """A table of the errors for a page, in percent."""
    found = []
    for name, kind in measurement_floor["kinds"].items():
        cells = [kind[reading] for reading in READINGS]
        texts = [", ".join(f"{cell[level]:.2g}" for level in ("p50", "p90", "p99")) for cell in cells]
        found.append([name, " + ".join(map(str, kind["counts"])), *texts])
    table = markdown_table(["Steps", "Points", *READINGS.values()], found, "llrrrr")
    return f"{table}\n\nMeasured by `{measurement_floor['command']}`."


def figure_measurement_floor(measurement_floor: Any) -> Figure:
    """Figure: what uniform and physical measurement steps hold of the pull-off force.

    Left, both on a narrow peak; right, the share of hidden protocols whose highest step is further from the pull-off
    force than an error. Reads the data of `experiments.surrogates.measurement_floor`.
    """
    drawn, (left, right) = drawing.panels(1, 2, height=2.6)
    draw_peak(left, measurement_floor["example"])
    draw_errors(right, measurement_floor["kinds"])
    return drawn


LABELS = {
    "tabor": r"Tabor parameter $\mu$",
    "modulus_ratio": "modulus ratio $k$",
    "retardation_time": "retardation time (s)",
}
WORDS = {"tabor": "Tabor parameter", "modulus_ratio": "Modulus ratio", "retardation_time": "Retardation time (s)"}
STYLES = {
    "surrogate": {"color": COLOURS["fast"], "linewidth": 1.4},
    "surrogate, its error ignored": {"color": drawing.ORANGE, "linewidth": 1.0, "linestyle": "--"},
    "solver": {"color": drawing.BLACK, "linewidth": 0.9},
}
LEVELS = (0.95, 0.68)


def draw_density(axes: Axes, content: dict[str, Any], index: int) -> None:
    """Densities of one parameter, and its true value."""
    for tool, posterior in content["posteriors"].items():
        found = posterior["densities"][index]
        axes.stairs(found["density"], found["edges"], label=tool, **STYLES[tool])
    axes.axvline(content["true"][index], color=drawing.RED, linestyle=":", label="true")
    axes.set(xlabel=LABELS[content["parameters"][index]], yticks=[], ylim=(0.0, None))


def levels_of(density: np.ndarray) -> list[float]:
    """Heights of a histogram above which `LEVELS` of it lie, rising."""
    ordered = np.sort(density.ravel())[::-1]
    held = np.cumsum(ordered) / ordered.sum()
    return [float(ordered[np.searchsorted(held, level)]) for level in LEVELS]


def draw_pair(axes: Axes, content: dict[str, Any], pair: dict[str, Any]) -> None:
    """Regions of 68 and 95 % of the surrogate's posterior, samples of the solver's, and the true values."""
    x, y = (0.5 * (np.array(pair[name][1:]) + pair[name][:-1]) for name in "xy")
    density = np.array(pair["density"]).T
    axes.contourf(x, y, density, [*levels_of(density), np.inf], colors=drawing.tints(COLOURS["fast"], 3)[:2])
    first, second = pair["parameters"]
    solver = np.array(content["solver_shown"])
    axes.plot(solver[:, first], solver[:, second], ".", color=drawing.BLACK, markersize=1.2)
    axes.plot(content["true"][first], content["true"][second], "+", color=drawing.RED, markersize=9.0)
    axes.set(xlabel=LABELS[content["parameters"][first]], ylabel=LABELS[content["parameters"][second]])


def figure_inverse(inverse_problem: Any) -> Figure:
    """Figure: the posterior of three parameters from one noisy force curve, with a surrogate and with the solver.

    Reads the data of `experiments.surrogates.inverse_problem`; `inverse_text` is the table of docs/surrogate-models.md.
    """
    drawn, panels = drawing.panels(2, 3, height=4.4)
    for index, axes in enumerate(panels[:3]):
        draw_density(axes, inverse_problem, index)
    panels[0].set_ylabel("posterior density")
    axes, curve = panels[3], inverse_problem["curve"]
    axes.plot(curve["time"], curve["measured"], ".", color="0.6", markersize=2.5, label="measured")
    axes.plot(curve["time"], curve["mean"], color=drawing.BLACK, linewidth=1.0, label="at the mean")
    drawing.zero_line(axes)
    axes.set(xlabel="time (s)", ylabel=FORCE_LABEL)
    axes.legend(loc="upper left")
    for axes, pair in zip(panels[4:], inverse_problem["posteriors"]["surrogate"]["pairs"], strict=True):
        draw_pair(axes, inverse_problem, pair)
    handles, labels = panels[0].get_legend_handles_labels()
    drawn.legend(handles, labels, loc="outside upper center", ncols=len(labels))
    return drawn


def inverse_text(inverse_problem: Any) -> str:
    """The table for a page, one row for the truth and one for each posterior, and how it was made."""
    seconds, solver = inverse_problem["seconds"], inverse_problem["posteriors"]["solver"]["summary"]
    rows = [["true", *(number(value, 4) for value in inverse_problem["true"]), "", "", "", ""]]
    for tool, posterior in inverse_problem["posteriors"].items():
        summary = posterior["summary"]
        cells = [
            f"{number(mean, 4)} ({number(low, 4)} to {number(high, 4)})"
            for mean, low, high in zip(summary["mean"], summary["low"], summary["high"], strict=True)
        ]
        away = max(abs(a - b) / sd for a, b, sd in zip(summary["mean"], solver["mean"], solver["sd"], strict=True))
        counts = [f"{posterior['samples']:,}", f"{posterior['effective']:,.0f}"]
        # One pass over the samples gives both posteriors of the surrogate.
        price = 1e3 * seconds[tool.partition(",")[0]]
        rows.append([tool, *cells, "-" if tool == "solver" else f"{away:.2f}", *counts, f"{price:.3f}"])
    head = ["Posterior of", *(WORDS[name] for name in inverse_problem["parameters"])]
    head += ["Largest distance from the solver's mean (sd)", "Samples", "Effective samples", "Time of a sample (ms)"]
    return (
        f"{markdown_table(head, rows, 'lrrrrrrr')}\n\n"
        f"Means and 95 % intervals. A sample of the solver costs {seconds['solver'] / seconds['surrogate']:.0f} times "
        f"as much. Before, search and {inverse_problem['calibration']} simulations for the surrogate's error took "
        f"{inverse_problem['searched']:.0f} s of processor time. Measured by `{inverse_problem['command']}` "
        f"on {inverse_problem['host']}; the process had {inverse_problem['processor_share']:.0%} of its core."
    )


WAYS = {"batch": 1e3, "single": 1e3, "step": 1e6, "gradient": 1e3}
"""Ways to call, and units of their times over a second."""
PLACES = {"box": "0.01 to 1", "paper": "0.1", "vertices": "0.1, vertices of the ranges"}
HELD = ("pull_off", "hysteresis")
HEADS = [
    "Model",
    "Modulus ratio",
    "Pull-off error (%), median, p90, p99.9",
    "Hysteresis error (%), median, p90",
    "Covered: pull-off force, hysteresis",
    "Width of the pull-off interval (%), median, p90",
    "Time in batches (ms)",
    "Single (ms)",
    "Solver over model, batches",
]


def several(values: list[float]) -> str:
    """Some quantiles."""
    return ", ".join(f"{value:.2g}" for value in values)


def rows(errors_by_place: Any, ways_to_call: Any) -> list[list[str]]:
    """One row for each model and kind of protocols."""
    found, seconds = [], ways_to_call["seconds"]
    for name, places in errors_by_place["models"].items():
        cost, times = seconds[name], seconds["solver"]["batch"] / seconds[name]["batch"]
        for place, words in PLACES.items():
            if place in places:
                one = places[place]
                banded = "width/pull_off" in one
                covered = ", ".join(f"{one[f'inside/{result}']:.2f}" for result in HELD) if banded else ""
                widths = several(one["width/pull_off"][:2]) if banded else ""
                errors = several(one["pull_off"]), several(one["hysteresis"][:2])
                calls = f"{1e3 * cost['batch']:.3f}", f"{1e3 * cost['single']:.2f}", f"{times:.0f}"
                found.append([name, words, *errors, covered, widths, *calls])
    return found


def page_text(errors_by_place: Any, ways_to_call: Any) -> str:
    """The table for a page, and how it was made."""
    commands = f"Measured by `{errors_by_place['command']}` and `{ways_to_call['command']}`."
    return Table(HEADS, rows(errors_by_place, ways_to_call), commands).page("ll" + 7 * "r")


CALLS = ["Tool", "Batch (ms)", "Single (ms)", "Step (µs)", "Gradient (ms)", "Gradient error (%), median, p90"]


def calls_text(ways_to_call: Any) -> str:
    """The table of the ways to call for a page: times, the error of the gradient, and how it was made."""
    gradients, found = ways_to_call["gradients"], []
    for name in ("solver", *ways_to_call["models"]):
        seconds, errors = ways_to_call["seconds"][name], gradients["errors"][name]
        times = [f"{factor * seconds[kind]:.3g}" if kind in seconds else "-" for kind, factor in WAYS.items()]
        found.append([name, *times, ", ".join(number(errors[level], 2) for level in ("p50", "p90"))])
    return (
        f"{markdown_table(CALLS, found, 'lrrrrr')}\n\n"
        f"Errors of gradients on {ways_to_call['count']} protocols, relative to the solver at {gradients['fine']:g}; "
        f"measured by `{ways_to_call['command']}` on {ways_to_call['host']}."
    )


def size_text(size_error: Any) -> str:
    """How few parameters of one LSTM have the errors that the paper states, as published, in a sentence."""
    paper = drawing.paper_values("reference_model")
    aims = {name: paper[f"{key}_percent"] for name, key in (("pull_off", "pull_off_force"), ("hysteresis",) * 2)}
    errors = ", ".join(f"{name.replace('_', '-')} {number(most, 2)} %" for name, most in aims.items())
    row = min(
        (one for one in size_error["lstm"] if all(one["paper"][name]["p50"] <= most for name, most in aims.items())),
        key=lambda one: one["parameters"],
    )
    return (
        f"The median errors that the paper states for its best model ({errors}) are reached by one LSTM on the inputs "
        f"F from {row['units']} units on, with {row['parameters']:,} parameters, "
        f"{paper['parameters'] / row['parameters']:.0f} times fewer than the paper's model has: {size_error['count']} "
        f"hidden protocols, {size_error['epochs']} epochs on {size_error['trajectories']:,} trajectories, one seed."
    )


def table_surrogates(errors_by_place: Any, ways_to_call: Any) -> Table:
    """Tables: errors, intervals and cost of the pretrained models beside M1-concat, and the cost of each way to call.

    Reads the data of `experiments.surrogates.errors_by_place` and `experiments.surrogates.ways_to_call`.
    """
    facts = {name: errors_by_place[name] for name in ("count", "coverage")}
    solver = 1e3 * ways_to_call["seconds"]["solver"]["batch"]
    return Table(HEADS, rows(errors_by_place, ways_to_call), caption("surrogates", solver=solver, **facts))
