"""Forces that the reference model predicts: canonical protocols, other measurement steps, crack velocities."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.figures.trajectories import QUANTITIES
from paper_figures.style import drawing, models_style
from paper_figures.style.writing import Table, caption, number

PANELS = ((1, 2, 3), (4, 5, 6), (7, 8, 9), (10, 11, 12))
CROWDED = {7: (42, 14), 10: (42, 14)}
"""Offset in points of the numbers of those samples whose turning point lies among other loops."""


def draw_regime(axes: Axes, regime: dict[str, Any], model: str, color: str) -> None:
    """Draw the solver's force as a line, the surrogate's steps as markers, and the number of the sample."""
    native, steps = regime["native"], regime["steps"]
    axes.plot(native["indentation"], native["force"], color=drawing.BLACK, linewidth=0.9, zorder=2)
    look = models_style.step_marker(model) | {"color": color, "markeredgecolor": color}
    axes.plot(steps["indentation"], steps["predicted"], zorder=3, label=f"({regime['sample']})", **look)
    deepest = native["indentation"].index(max(native["indentation"]))
    turning = native["indentation"][deepest], native["force"][deepest]
    shift = CROWDED.get(regime["sample"], (5, 0))
    leader = {"arrowstyle": "-", "linewidth": 0.5, "shrinkB": 3} if regime["sample"] in CROWDED else None
    drawing.note(axes, f"({regime['sample']})", turning, shift, va="center", color=color, arrowprops=leader)


def figure_6(canonical_regimes: Any) -> Figure:
    """Figure 6: force against indentation of the twelve canonical protocols, by solver and surrogate.

    The surrogate has one marker throughout, and each sample a shade. The number of a sample is at its turning point.
    """
    regimes = {one["sample"]: one for one in canonical_regimes["regimes"]}
    shades = drawing.tints(models_style.color(canonical_regimes["config"]["model"]), 3)
    drawn, panels = drawing.panels(2, 2, height=5.2)
    for axes, samples in zip(panels, PANELS, strict=True):
        drawing.zero_line(axes)
        for sample, color in zip(samples, shades, strict=True):
            draw_regime(axes, regimes[sample], canonical_regimes["config"]["model"], color)
        axes.margins(x=0.12)
        tabor = regimes[samples[0]]["protocol"]["tabor"]
        dwell = "long" if max(regimes[sample]["protocol"]["dwell_time"] for sample in samples) > 0.1 else "short"
        axes.set_title(rf"$\mu = {tabor:g}$, {dwell} dwell", loc="right")
        axes.set(xlabel=drawing.INDENTATION, ylabel=drawing.FORCE)
        solver = axes.plot([], [], color=drawing.BLACK, linewidth=0.9)[0]
        marks, numbers = axes.get_legend_handles_labels()
        names = [f"{canonical_regimes['config']['model']} {number}" for number in numbers]
        axes.legend([solver, *marks], ["solver", *names], loc="best")
    return drawn


SAMPLE = 5


def draw_model(axes: Axes, regime: dict[str, Any], errors: dict[str, Any]) -> None:
    """The model between two arrows, with its median errors and times below."""
    drawing.blank(axes, 10.0, 8.0)
    name = errors["config"]["model"]
    tabor = regime["protocol"]["tabor"]
    drawing.arrow(axes, (0.2, 4.6), (1.7, 4.6), lw=1.6)
    drawing.arrow(axes, (8.3, 4.6), (9.8, 4.6), lw=1.6)
    drawing.box(axes, 5.0, 4.6, f"{name}\nsequence to\nsequence", drawing.LSTM_FILL, width=6.4, height=3.0, size=8)
    drawing.arrow(axes, (5.0, 7.4), (5.0, 6.15), lw=1.2, linestyle=":", color=drawing.RED)
    axes.text(5.0, 7.5, rf"Tabor parameter $\mu = {tabor:g}$", ha="center", color=drawing.RED)
    overall = errors["overall"]
    milliseconds = {name: number(1e3 * seconds, 2) for name, seconds in regime["seconds"].items()}
    text = (
        f"median error on {errors['trajectories']} unseen protocols\n"
        f"pull-off force {overall['pull_off_force_percent']['median']:.2g} %, "
        f"hysteresis {overall['hysteresis_percent']['median']:.2g} %\n"
        f"{milliseconds['predictor']} ms a prediction, solver {milliseconds['solver']} ms"
    )
    axes.text(5.0, 1.4, text, ha="center", va="center")


def draw_force(axes: Axes, regime: dict[str, Any], name: str) -> None:
    """Predicted and simulated force over indentation."""
    native, steps = regime["native"], regime["steps"]
    drawing.zero_line(axes)
    axes.plot(native["indentation"], native["force"], color=drawing.BLACK, linewidth=1.0, label="solver")
    axes.plot(steps["indentation"], steps["predicted"], label=name, **models_style.step_marker(name))
    axes.set(xlabel=drawing.INDENTATION, ylabel=drawing.FORCE, title="force, predicted and simulated")
    axes.legend(loc="lower left")


def graphical_abstract(canonical_regimes: Any, error_statistics: Any) -> Figure:
    """The graphical abstract: protocol, surrogate, and predicted force, with cost and error of the prediction."""
    regime = next(one for one in canonical_regimes["regimes"] if one["sample"] == SAMPLE)
    drawn = drawing.figure(height=2.5)
    first, second, third = drawn.subplots(1, 3)
    depths = regime["steps"]["indentation"]
    first.plot(np.arange(1, len(depths) + 1), depths, color=drawing.BLACK, linewidth=1.6)
    first.set(xlabel="measurement step", ylabel=drawing.INDENTATION, title="indentation history")
    draw_model(second, regime, error_statistics)
    draw_force(third, regime, canonical_regimes["config"]["model"])
    return drawn


COLORS = (drawing.ORANGE, drawing.BLUE, drawing.VIOLET, drawing.GREEN, drawing.SKY, drawing.RED)
"""Of the numbers of measurement steps, in their order."""


def draw_sample(axes: Axes, sample: dict[str, Any], model: str) -> None:
    """Draw the solver's force as a line, and each prediction as the model's markers in its own colour."""
    drawing.zero_line(axes)
    axes.plot(sample["native"]["indentation"], sample["native"]["force"], color=drawing.BLACK, label="solver")
    for (total, found), color in zip(sample["predictions"].items(), COLORS, strict=False):
        look = models_style.step_marker(model) | {"markersize": 4.2, "color": color, "markeredgecolor": color}
        axes.plot(found["indentation"], found["predicted"], label=f"$N = {total}$", **look)
    axes.set(xlabel=drawing.INDENTATION, ylabel=drawing.FORCE)
    axes.set_title(f"sample ({sample['sample']})", loc="right")
    axes.legend(loc="best")


def draw_test_set(axes: Axes, test_set: dict[str, Any], color: str) -> None:
    """Draw median and 90th percentile of the force NMAE over the held-out set, for each number of steps."""
    totals = list(test_set["errors"])
    places = np.arange(len(totals))
    for shift, (name, text, shade) in enumerate((("median", "median", 1.0), ("p90", "90th percentile", 0.45))):
        heights = [test_set["errors"][total]["nmae_percent"][name] for total in totals]
        bars = axes.bar(places + 0.38 * (shift - 0.5), heights, 0.36, color=color, alpha=shade, label=text)
        axes.bar_label(bars, labels=[f"{height:#.2g}".rstrip(".") for height in heights], padding=1)
    axes.set_xticks(places, totals)
    axes.set(xlabel="measurement steps $N$", ylabel="force NMAE (%)")
    axes.set_title(f"{test_set['trajectories']} held-out trajectories", loc="right")
    axes.margins(y=0.2)
    axes.legend(loc="upper center")


def figure_fms_transfer(fms_transfer: Any) -> Figure:
    """FMS transfer: one trajectory predicted at other numbers of measurement steps, and errors over the held-out set.

    The paper shows one trajectory only; the second panel is additional.
    """
    drawn, (first, second) = drawing.panels(1, 2, height=2.7)
    model = fms_transfer["config"]["model"]
    draw_sample(first, fms_transfer["sample"], model)
    draw_test_set(second, fms_transfer["test_set"], models_style.color(model))
    return drawn


COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Sample": lambda one: f"({one['sample']})",
    **{head: lambda one, name=name: number(one["protocol"][name]) for name, head in QUANTITIES.items()},
    "BEM, paper (s)": lambda one: number(one["paper_seconds"]["solver"], 4),
    "BEM, here (s)": lambda one: number(one["seconds"]["solver"], 2),
    "M1-concat, paper (s)": lambda one: number(one["paper_seconds"]["surrogate"], 2),
    "Keras call (s)": lambda one: number(one["seconds"]["keras_call"], 2),
    "predictor (s)": lambda one: number(one["seconds"]["predictor"], 2),
    "predictor in a batch (s)": lambda one: number(one["seconds"]["predictor_batch"], 2),
    "pull-off error (%)": lambda one: number(one["errors_percent"]["pull_off_force"], 2),
    "hysteresis error (%)": lambda one: number(one["errors_percent"]["hysteresis"], 2),
}
"""Column heads, and functions that write the cell of one protocol."""


def table_protocols_canonical(canonical_regimes: Any) -> Table:
    """Table: the twelve canonical protocols, with the seconds of solver and surrogate, here and in the paper."""
    words = caption("protocols-canonical", config=canonical_regimes["config"], times=canonical_regimes["times"])
    return Table.of(COLUMNS, canonical_regimes["regimes"], words)


CRACKS = {
    "unloading_rate": r"$\hat v_U$",
    "crack_velocity": r"$\tilde v_c$, paper",
    "own_crack_velocity": r"$\tilde v_c$, solver",
    "theory": "theory at the paper's",
    "theory_at_own_velocity": "theory at the solver's",
    "solver": "solver",
    "surrogate": "surrogate",
}


def table_persson_brener(persson_brener: Any) -> Table:
    """Table: crack velocities and amplifications of the fourteen protocols of the relaxed short-range limit."""
    found = persson_brener["summary"]
    deviations = ", ".join(
        f"{text} {found[f'{name}_median_percent']:.1f} % and {found[f'{name}_largest_percent']:.1f} %"
        for name, text in (
            ("solver_against_theory", "solver"),
            ("solver_against_theory_at_own_velocity", "solver at its own velocity"),
            ("surrogate_against_theory", "surrogate"),
        )
    )
    first = persson_brener["points"][0]["protocol"]
    words = caption("persson-brener", first=first, found=found, deviations=deviations)
    rows = [[str(one["point"]), *(number(one[name]) for name in CRACKS)] for one in persson_brener["points"]]
    return Table(["Point", *CRACKS.values()], rows, words)
