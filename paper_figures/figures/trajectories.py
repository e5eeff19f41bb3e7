"""Figures 1 to 3 and their tables: the contact, its protocol and force, and the data set."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from matplotlib.ticker import MultipleLocator, PercentFormatter

from bem._support.validation import FloatArray
from bem.dataset.file import Dataset, load_dataset
from bem.dataset.measurement_steps import FMS
from experiments.paper.dataset_statistics import force_ratio
from paper_figures.style import drawing
from paper_figures.style.writing import Table, caption, number

SUBSTRATE, SPHERE = "#dfeaf2", "#e9e4dc"
WIDTH, HEIGHT = 10.0, 7.4


def surface(x: np.ndarray, contact: float, radius: float, depth: float) -> np.ndarray:
    """Height of the sketched surface: the sphere inside the contact, and a decaying neck outside it; shape of `x`."""
    sphere = radius - np.sqrt(radius**2 - np.minimum(np.abs(x), contact) ** 2) - depth
    return sphere * np.exp(-np.maximum(np.abs(x) - contact, 0.0) / 0.35)


def draw_substrate(axes: Axes, level: float, shape: np.ndarray, x: np.ndarray) -> None:
    """Draw the half-space below a surface."""
    outline = np.column_stack([x, level + shape])
    axes.add_patch(Polygon([(x[0], 0.0), *outline, (x[-1], 0.0)], facecolor=SUBSTRATE, edgecolor="none"))
    axes.plot(x, level + shape, color="0.3", linewidth=1.0)


def draw_contact(axes: Axes) -> None:
    """Panel (a): sphere, half-space, and motion of the sphere."""
    drawing.blank(axes, WIDTH, HEIGHT)
    centre, level, radius = 5.0, 3.4, 3.0
    x = np.linspace(0.0, WIDTH, 400)
    depth = 0.75
    draw_substrate(axes, level, surface(x - centre, 1.75, radius, depth), x)
    bottom = level - depth + 0.04
    axes.add_patch(Circle((centre, bottom + radius), radius, facecolor=SPHERE, edgecolor="0.3", lw=1.0, zorder=2))
    drawing.arrow(axes, (centre, bottom + radius), (centre + radius * 0.94, bottom + radius * 0.66), zorder=3)
    axes.text(centre + 1.5, bottom + radius - 0.35, "$R$", zorder=4)
    axes.text(centre, bottom + 1.0, "rigid sphere", ha="center", zorder=4)
    axes.text(centre, 0.55, "adhesive viscoelastic half-space", ha="center")
    down, up = {"color": drawing.BLUE}, {"color": drawing.GREEN}
    drawing.arrow(axes, (0.9, 6.9), (0.9, 5.3), lw=1.4, **down)
    axes.text(1.15, 6.0, "$v_L$", **down)
    drawing.arrow(axes, (9.1, 5.3), (9.1, 6.9), lw=1.4, **up)
    axes.text(8.85, 6.0, "$v_U$", ha="right", **up)
    drawing.line(axes, (0.0, level), (WIDTH, level), linestyle=":", linewidth=0.6)


def draw_gap(axes: Axes) -> None:
    """Panel (b): the components of the gap at a radius, h = -delta + h0 + r^2 / (2 R) + u."""
    drawing.blank(axes, WIDTH, HEIGHT)
    level, foot, at = 4.2, 1.0, 6.6
    radius = np.linspace(0.0, 8.4, 200)
    profile = 0.075 * radius**2
    depth, spacing = 2.2, 0.55
    dent = 2.0 * np.exp(-((radius / 4.6) ** 2))
    sphere = level - depth + spacing + profile
    x = foot + radius
    axes.add_patch(Polygon([(foot, 0.0), *np.column_stack([x, level - dent]), (x[-1], 0.0)], facecolor=SUBSTRATE))
    axes.plot(x, level - dent, color="0.3", linewidth=1.0)
    axes.plot(x[sphere < HEIGHT], sphere[sphere < HEIGHT], color="0.3", linewidth=1.0)
    drawing.line(axes, (foot, 0.2), (foot, HEIGHT - 0.2), linestyle="-.", linewidth=0.6)
    drawing.line(axes, (foot - 0.4, level), (9.8, level), linestyle=":", linewidth=0.7)
    lowest = level - depth + spacing
    drawing.line(axes, (foot - 0.4, level - depth), (foot + 0.9, level - depth), linestyle=":", linewidth=0.7)
    drawing.line(axes, (foot, lowest), (at + 0.3, lowest), linestyle=":", linewidth=0.7)

    def measure(
        place: float, low: float, high: float, text: str, color: str, side: float = 0.12, share: float = 0.5
    ) -> None:
        drawing.arrow(axes, (place, low), (place, high), arrowstyle="<|-|>", color=color, mutation_scale=5)
        ha = "left" if side > 0 else "right"
        axes.text(place + side, low + share * (high - low), text, color=color, va="center", ha=ha, fontsize=7.5)

    measure(foot - 0.25, level - depth, level, r"$\delta$", drawing.BLUE, -0.12)
    measure(foot + 0.35, level - depth, lowest, "", drawing.ORANGE)
    axes.text(foot + 0.35, level - depth - 0.08, "$h_0$", color=drawing.ORANGE, va="top", ha="center", fontsize=7.5)
    rise = float(np.interp(at - foot, radius, profile))
    measure(at, lowest, lowest + rise, r"$r^2/(2R)$", drawing.GREEN, share=0.85)
    measure(
        at - 1.9, level - float(np.interp(at - 1.9 - foot, radius, dent)), level, "$u_z$", drawing.VIOLET, -0.12, 0.8
    )
    place = at - 0.75
    gap = float(np.interp(place - foot, x - foot, sphere))
    ground = level - float(np.interp(place - foot, radius, dent))
    measure(place, ground, gap, "$h$", drawing.RED, 0.1, 0.3)
    drawing.arrow(axes, (foot, 0.55), (at, 0.55), color="0.3")
    axes.text(0.5 * (foot + at), 0.75, "$r$", ha="center")
    axes.text(foot + 0.2, HEIGHT - 0.7, r"$h=-\delta+h_0+r^2/(2R)+u_z$", fontsize=7.5)


def draw_protocol(axes: Axes, example: dict[str, Any]) -> None:
    """Panel (c): indentation over time."""
    times = example["phase_times"]
    depths = np.interp(times, example["native"]["time"], example["native"]["indentation"])
    for begin, color in enumerate(drawing.PHASES.values()):
        axes.plot(times[begin : begin + 2], depths[begin : begin + 2], color=color, linewidth=1.6)
    drawing.zero_line(axes)
    axes.set_xticks(times, [rf"$\hat t_{index}$" for index in range(4)])
    axes.set_yticks([depths[0], 0.0, depths[1]], [r"$\hat\delta_0$", "0", r"$\hat\delta_l$"])
    for index, (name, color) in enumerate(drawing.PHASES.items()):
        middle = 0.5 * (times[index] + times[index + 1])
        height = 0.5 * (depths[index] + depths[index + 1])
        text = {"loading": r"$\hat v_L$", "dwell": r"$\hat t_D$", "unloading": r"$\hat v_U$"}[name]
        place, ha = ((0, 4), "center") if name == "dwell" else ((-5 if name == "loading" else 5, 2), None)
        ha = ha or ("right" if name == "loading" else "left")
        drawing.note(axes, text, (middle, height), place, color=color, ha=ha, fontsize=8)
    axes.margins(y=0.14)
    axes.set(xlabel=drawing.TIME, ylabel=drawing.INDENTATION)


def draw_force(axes: Axes, example: dict[str, Any]) -> None:
    """Panel (d): the computed force, coloured by phase, with pull-off and largest compression."""
    time, force = (np.array(example["native"][name]) for name in ("time", "force"))
    results = example["results"]
    drawing.by_phase(axes, time, force, example["phase_times"])
    drawing.zero_line(axes)
    peak, low = (results["pull_off_time"], results["pull_off_force"]), int(np.argmin(force))
    axes.plot(*peak, "o", color=drawing.RED)
    axes.plot(time[low], force[low], "s", color=drawing.BLACK)
    drawing.note(axes, r"$\hat P_\mathrm{po}$", peak, (-4, 5), ha="right", color=drawing.RED)
    drawing.note(axes, r"$\hat P_\mathrm{mc}$", (time[low], force[low]), (7, -3))
    axes.plot([peak[0], peak[0]], [force[low], peak[1]], color=drawing.RED, linestyle=":", linewidth=0.8)
    drawing.note(axes, r"$\hat t_\mathrm{po}$", (peak[0], force[low]), (3, 0), color=drawing.RED)
    axes.margins(y=0.14)
    axes.set(xlabel=drawing.TIME, ylabel=drawing.FORCE)


def figure_1(dataset_examples: Any) -> Figure:
    """Figure 1: the contact, the components of the gap, the protocol, and a computed force response.

    Panels (a) and (b) are sketches. Panels (c) and (d) show the protocol and the force of the trajectory of figure 3.
    """
    example = dataset_examples["mapping"]
    drawn, panels = drawing.panels(2, 2, height_ratios=(1.15, 1.0), height=5.4)
    draw_contact(panels[0])
    draw_gap(panels[1])
    draw_protocol(panels[2], example)
    draw_force(panels[3], example)
    return drawn


BINS_PER_DECADE = 5


def draw_example(axes: Axes, example: dict[str, Any]) -> None:
    """Force over time, with the dwell shaded, and pull-off and largest compression marked."""
    native, results = example["native"], example["results"]
    _, t1, t2, t3 = example["phase_times"]
    axes.axhline(0.0, color="0.75", linewidth=0.6, zorder=0)
    # The edge keeps a dwell visible that is short beside the whole.
    axes.axvspan(t1, t2, facecolor=(drawing.ORANGE, 0.35), edgecolor=drawing.ORANGE, linewidth=0.8, label="dwell")
    axes.plot(native["time"], native["force"], color=drawing.BLACK)
    lowest = int(np.argmin(native["force"]))
    style = {"linestyle": "", "clip_on": False, "zorder": 3}
    peak = results["pull_off_time"], results["pull_off_force"]
    axes.plot(*peak, marker="o", color=drawing.RED, label=r"$\hat P_\mathrm{po}$", **style)
    bottom = native["time"][lowest], native["force"][lowest]
    axes.plot(*bottom, marker="s", color=drawing.BLUE, label=r"$\hat P_\mathrm{mc}$", **style)
    axes.set_xlim(0.0, 1.03 * t3)
    axes.margins(y=0.12)
    protocol = example["protocol"]
    axes.set_title(rf"$\mu={protocol['tabor']:g}$, $\hat\delta_l={protocol['peak_indentation']:g}$", loc="right")
    axes.set_xlabel(drawing.TIME)
    axes.set_ylabel(r"force $\hat P$")


def draw_histogram(axes: Axes, values: FloatArray, label: str) -> None:
    """Share of trajectories in bins of equal width on a logarithmic axis."""
    low = np.floor(np.log10(values.min()))
    high = max(np.ceil(np.log10(values.max())), low + 1.0)
    bins = np.logspace(low, high, int(BINS_PER_DECADE * (high - low)) + 1)
    share = np.full(len(values), 1.0 / len(values))
    axes.hist(values, bins=bins, weights=share, color="0.6", edgecolor="white", linewidth=0.4)
    axes.set_xscale("log")
    axes.set_xlabel(label)
    axes.set_ylabel("share of trajectories")
    axes.yaxis.set_major_locator(MultipleLocator(0.05 if axes.get_ylim()[1] > 0.12 else 0.02))
    axes.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0, symbol=" %"))


def mark(axes: Axes, value: float, text: str, color: str, *, height: float, shift: float) -> None:
    """Draw a vertical line with text beside it, at a share of the panel's height."""
    axes.axvline(value, color=color, linewidth=1.0)
    drawing.beside(axes, value, text, height=height, shift=shift, color=color)


def draw_cost(axes: Axes, dataset: Dataset, paper: dict[str, Any]) -> None:
    """Distribution of the solver's seconds, with its mean and that of the paper."""
    seconds = dataset.scalars["solver_seconds"][dataset.completed]
    draw_histogram(axes, seconds, r"solver time $t_\mathrm{CPU}$ (s)")
    total, hours = float(seconds.sum()), paper["cpu_hours"]
    theirs = 3600.0 * hours / paper["trajectories"]
    axes.set(xlim=(None, 3e3), ylim=(0.0, 1.25 * axes.get_ylim()[1]))
    mark(axes, theirs, f"paper: {hours} h\nmean {theirs:.0f} s", drawing.PAPER, height=0.6, shift=-3)
    ours = f"here: {total / 60.0:.1f} min\nmean {1e3 * seconds.mean():.1f} ms"
    mark(axes, float(seconds.mean()), ours, drawing.BLACK, height=0.98, shift=3)


def figure_2(dataset_examples: Any, dataset: Path) -> Figure:
    """Figure 2: force over time of six trajectories, and distributions of pull-off time, force ratio and cost.

    The histograms show shares of the completed trajectories; trajectories that are never compressed have no force
    ratio. The paper marks no cost in its panel (i). The line drawn here is its mean: its CPU-hours over its
    trajectories.
    """
    content = dataset_examples["examples"]
    data = load_dataset(dataset)
    rows, scalars = data.completed, data.scalars
    drawn, panels = drawing.panels(3, 3, height=6.2)
    for axes, example in zip(panels[:6], content, strict=True):
        draw_example(axes, example)
    panels[1].legend(loc="lower right")
    draw_histogram(panels[6], scalars["pull_off_time"][rows], r"pull-off time $\hat t_\mathrm{po}$")
    ratio = force_ratio(data)
    draw_histogram(panels[7], ratio, r"force ratio $\hat P_\mathrm{po}/|\hat P_\mathrm{mc}|$")
    panels[7].set_ylim(top=1.3 * panels[7].get_ylim()[1])
    text = f"without {len(rows) - len(ratio)} never compressed"
    panels[7].annotate(text, (0.97, 0.97), xycoords="axes fraction", ha="right", va="top")
    draw_cost(panels[8], data, drawing.paper_values("dataset"))
    return drawn


def figure_3(dataset_examples: Any) -> Figure:
    """Figure 3: a trajectory at the solver's own time steps, and the same trajectory at the 120 measurement steps."""
    content = dataset_examples["mapping"]
    native = {name: np.array(values) for name, values in content["native"].items()}
    steps = {name: np.array(values) for name, values in content["steps"].items()}
    index, ends = np.arange(1, len(steps["time"]) + 1), np.cumsum((0, *FMS))
    drawn = drawing.figure(height=4.4)
    upper, lower = drawn.subfigures(2, 1)
    first, second = upper.subplots(1, 2), lower.subplots(1, 3)
    ticks = {"color": "0.3", "markersize": 5, "markeredgewidth": 0.4, "clip_on": False}
    labels = {"indentation": drawing.INDENTATION, "time": drawing.TIME, "force": drawing.FORCE}
    for axes, quantity in zip(first, ("indentation", "force"), strict=True):
        drawing.by_phase(axes, native["time"], native[quantity], content["phase_times"])
        # The solver's time steps as ticks along the bottom.
        low = np.full_like(native["time"], 0.04)
        axes.plot(native["time"], low, "|", transform=axes.get_xaxis_transform(), **ticks)
        axes.margins(y=0.15)
        axes.set(xlabel=drawing.TIME, ylabel=labels[quantity])
    for axes, quantity in zip(second, labels, strict=True):
        for boundary in np.cumsum(FMS)[:2] + 0.5:
            axes.axvline(boundary, color="0.8", linewidth=0.6, zorder=0)
        for begin, end, color in zip(ends[:-1], ends[1:], drawing.PHASES.values(), strict=True):
            axes.plot(index[begin:end], steps[quantity][begin:end], ".", markersize=3.2, color=color)
        axes.set(xlabel=r"measurement step $j$", ylabel=labels[quantity])
    drawing.letters([*first, *second])
    marks = [
        Line2D([], [], color=color, marker=".", label=f"{phase}, {count} steps")
        for (phase, color), count in zip(drawing.PHASES.items(), FMS, strict=True)
    ]
    rug = f"the solver's {len(np.unique(native['time']))} instants"
    marks.append(Line2D([], [], color="0.3", marker="|", markersize=5, linestyle="", label=rug))
    upper.legend(handles=marks, loc="outside upper center", ncols=4)
    return drawn


ORDER = ("loading_rate", "dwell_time", "unloading_rate", "tabor", "peak_indentation")
QUANTITIES = {name: drawing.SYMBOLS[name] for name in ORDER}
"""Symbols of the quantities, in the order of the paper's tables."""
RESULTS = {
    "pull_off_force": r"$\hat P_\mathrm{po}$",
    "pull_off_time": r"$\hat t_\mathrm{po}$",
    "max_compression": r"$\hat P_\mathrm{mc}$",
    "hysteresis": r"$\hat A_\mathrm{hys}$",
    "end_force": r"$\hat P(t_3)$",
}


def summary_rows(found: dict[str, Any], paper: dict[str, Any]) -> list[list[str]]:
    """One row for each quantity: its name, the paper's value and ours."""
    seconds, floor = found["solver_seconds"], found["resolution_floor"]["pull_off_force"]
    ranges = {name: paper["ranges"][name] for name in QUANTITIES}
    mean = 3600.0 * paper["cpu_hours"] / paper["trajectories"]
    unknown, hosts, memory = "not stated", found["host"], found["peak_memory"]
    return [
        ["trajectories", str(paper["trajectories"]), str(found["trajectories"])],
        ["of these completed", unknown, str(found["completed"])],
        ["distinct protocols", unknown, str(found["distinct_protocols"])],
        *(
            [symbol, *(" to ".join(map(number, bounds)) for bounds in (ranges[name], found["ranges"][name]))]
            for name, symbol in QUANTITIES.items()
        ),
        ["solver time in all", f"{paper['cpu_hours']} CPU-hours", f"{seconds['sum'] / 60.0:.2f} CPU-minutes"],
        ["solver time, mean", f"{mean:.0f} s", f"{1e3 * seconds['mean']:.1f} ms"],
        ["solver time, median", unknown, f"{1e3 * seconds['median']:.1f} ms"],
        ["wall time", unknown, f"{found['wall_seconds'] / 60.0:.2f} minutes"],
        ["workers' time on trajectories over solver time", unknown, f"{found['trajectories_over_solver']:.3f}"],
        ["whole run over solver time", unknown, f"{found['run_over_solver']:.3f}"],
        ["parallel efficiency", unknown, f"{found['parallel_efficiency']:.3f}"],
        ["peak memory", unknown, f"{memory / 1e6:.0f} MB" if memory else "not recorded"],
        ["hardware", paper["hardware"], "; ".join([hosts] if isinstance(hosts, str) else hosts)],
        ["trajectories never compressed", unknown, str(found["never_compressed"])],
        ["trajectories with a jump", unknown, f"{100 * found['with_jumps']:.1f} %"],
        ["still attached at the end", unknown, f"{100 * found['still_attached']:.1f} %"],
        ["end force above half the pull-off force", unknown, f"{100 * found['end_force_above_half_pull_off']:.1f} %"],
        *(
            [f"resolution floor of the pull-off force, {label}", unknown, f"{100 * floor[name]:.2g} %"]
            for name, label in (("median", "median"), ("p90", "90th percentile"), ("p99", "99th percentile"))
        ),
        ["resolution floor above 20 %", unknown, f"{100 * found['floor_above_20_percent']:.1f} % of trajectories"],
    ]


def table_protocols_dataset(dataset_examples: Any, dataset_statistics: Any) -> dict[str, Table]:
    """Tables: the protocols of figure 2 with their results, and the data set compared with the paper's."""
    rows = [
        [
            f"({example['name']})",
            *(number(example["protocol"][name]) for name in QUANTITIES),
            *(number(example["results"][name], 4) for name in RESULTS),
            str(example["jumps"]),
        ]
        for example in dataset_examples["examples"]
    ]
    first = Table(
        ["Panel", *QUANTITIES.values(), *RESULTS.values(), "Jumps"],
        rows,
        caption("protocols-dataset", accuracy=dataset_examples["accuracy"]),
    )
    second = Table(
        ["Quantity", "Paper", "Here"],
        summary_rows(dataset_statistics, drawing.paper_values("dataset")),
        caption("dataset-summary", accuracy=dataset_statistics["accuracy"], workers=dataset_statistics["workers"]),
    )
    return {"protocols-dataset": first, "dataset-summary": second}
