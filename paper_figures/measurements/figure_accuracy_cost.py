"""Figure: seconds per trajectory against error, for every tool on the same held-out protocols.

Markers are medians over the protocols. Thin lines extend to the 95th percentile of the error, and over the quartiles of
the seconds. Open markers are tools measured on fewer protocols than the others. Errors beyond the axis are drawn on its
upper edge, with an arrow. Labels name the closed forms, the named accuracies of the solver, and, of the surrogates
called in batches, the reference model, the best and the worst. The figure reads the measurement of
`experiments.cost.accuracy_cost`.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from paper_figures.style import drawing
from paper_figures.style.cost_style import FORCE_ERROR, KINDS, kind_of, mark_paper
from paper_figures.style.models_style import REFERENCE

PANELS = {"pull_off_force": "error of the pull-off force (%)", "force": FORCE_ERROR}
PLACES = {
    "pull_off_force": {
        "DMT": "below",
        "JKR": "beside",
        "Maugis-Dugdale": "below left",
        "Persson-Brener": "far above",
    },
    "force": {"DMT": "below", "JKR": "beside", "Maugis-Dugdale": "on the line"},
}
"""Where closed forms are named in each panel, when not to the left of their marker."""
OFFSETS = {
    "left": ((-4, -3), "right", "top"),
    "beside": ((-5, 0), "right", "center"),
    "below": ((0, -5), "center", "top"),
    "below left": ((-4, -3), "center", "top"),
    "far above": ((3, 15), "right", "center"),
    "on the line": ((0, 2), "center", "bottom"),
}
"""Offset of a name, in points, and its alignment; "on the line" counts from the 95th percentile of the error."""
LEADER = {"arrowstyle": "-", "relpos": (0.9, 0.0), "linewidth": 0.4, "patchA": None, "shrinkA": 1, "shrinkB": 2}
"""Line from a name that lies far from its marker."""
ROW = 1.55
"""Factor between the rows of names."""
LARGEST = 100.0
"""Larger errors, in percent, are drawn at the upper edge."""


def draw(axes: Axes, tools: list[dict[str, Any]], quantity: str) -> None:
    """Draw all tools in one panel; the solver and the paper's discretisation are curves."""
    most = max(tool["protocols"] for tool in tools)
    named = names_of(tools, quantity)
    name_surrogates(axes, tools, quantity)
    for kind, style in KINDS.items():
        points = [tool for tool in tools if kind_of(tool) == kind and _percent(tool, quantity) is not None]
        if not points:
            continue
        curve = kind in ("solver", "paper's discretisation")
        errors = [min(_percent(tool, quantity), LARGEST) for tool in points]
        seconds = [tool["seconds"]["median"] for tool in points]
        axes.plot(seconds, errors, linestyle="-" if curve else "", color=style["color"], linewidth=1.0, zorder=2)
        axes.plot([], [], linestyle="-" if curve else "", label=kind, markersize=4, linewidth=1.0, **style)
        for tool, second, error in zip(points, seconds, errors, strict=True):
            thin = {"color": style["color"], "linewidth": 0.5, "alpha": 0.7}
            if tool.get("model", REFERENCE) != REFERENCE:
                # The spread of one surrogate stands for those of all, which would cover each other.
                thin["linewidth"] = 0.0
            axes.plot([second, second], [error, min(100.0 * tool["errors"][quantity]["p95"], LARGEST)], **thin)
            axes.plot([tool["seconds"]["low"], tool["seconds"]["high"]], [error, error], **thin)
            inside = style["color"] if tool["protocols"] == most else "white"
            mark = "^" if _percent(tool, quantity) > LARGEST else style["marker"]
            axes.plot(
                second,
                error,
                mark,
                color=style["color"],
                markersize=2.8 if tool.get("model") else 4,
                markerfacecolor=inside,
                zorder=3,
                clip_on=False,
            )
            if tool["setting"] in named:
                text, side = named[tool["setting"]]
                at = tool["seconds"]["low"] if kind == "solver" else second
                up = min(100.0 * tool["errors"][quantity]["p95"], LARGEST) if side == "on the line" else error
                _annotate(axes, text, side, (at, up), style["color"])
    floor = next((tool for tool in tools if tool["kind"] == "measurement steps"), None)
    if floor and _percent(floor, quantity):
        level = _percent(floor, quantity)
        axes.axhline(level, color="0.6", linewidth=0.7, linestyle="--", zorder=0)
        axes.annotate(
            "120 measurement steps",
            (0.735, level),
            xycoords=("axes fraction", "data"),
            xytext=(0, 1),
            textcoords="offset points",
            fontsize=5,
            color="0.4",
            ha="center",
            va="bottom",
        )
    axes.set(xscale="log", yscale="log", xlabel="time a trajectory, one core (s)", ylabel=PANELS[quantity])
    axes.set_xlim(axes.get_xlim()[0] / 25.0, 1000.0)
    axes.set_ylim(top=1.3 * LARGEST)
    mark_paper(axes, height=0.44)


def names_of(tools: list[dict[str, Any]], quantity: str) -> dict[str, tuple[str, str]]:
    """Text beside a marker and its position, by setting."""
    named = {name: (name, "beside") for name in ("draft", "standard", "reference")}
    shown = [tool for tool in tools if tool["kind"] == "closed form" and _percent(tool, quantity) is not None]
    forms = [tool["setting"].split(",")[0] for tool in shown]
    for tool in tools:
        if tool["kind"] == "closed form":
            form = tool["setting"].split(",")[0]
            if forms.count(form) > 1:
                named[tool["setting"]] = (tool["setting"].replace(", ", ",\n"), "beside")
            else:
                named[tool["setting"]] = (form.replace("-D", "-\nD"), PLACES[quantity].get(form, "left"))
    return named


def name_surrogates(axes: Axes, tools: list[dict[str, Any]], quantity: str) -> None:
    """Write names below the surrogates called in batches, with a line to each, since their markers are crowded."""
    ranked = [tool for tool in tools if tool.get("way") == "ONNX batch" and _percent(tool, quantity) is not None]
    if not ranked:
        return
    ranked.sort(key=lambda tool: _percent(tool, quantity))
    words = {ranked[-1]["model"]: "worst: ", ranked[0]["model"]: "best: "}
    named = [tool for tool in ranked if tool["model"] in {*words, REFERENCE}]
    left = min(tool["seconds"]["median"] for tool in ranked) / 1.4
    for row, tool in enumerate(reversed(named), start=1):
        axes.annotate(
            words.get(tool["model"], "") + tool["model"],
            (tool["seconds"]["median"], _percent(tool, quantity)),
            xytext=(left, _percent(ranked[0], quantity) / ROW**row),
            fontsize=5,
            ha="right",
            va="center",
            color=KINDS["ONNX batch"]["color"],
            arrowprops={
                "arrowstyle": "-",
                "relpos": (1.0, 0.5),
                "linewidth": 0.4,
                "color": KINDS["ONNX batch"]["color"],
                "shrinkA": 0,
            },
        )


def _annotate(axes: Axes, text: str, side: str, place: tuple[float, float], color: str) -> None:
    offset, across, up = OFFSETS[side]
    axes.annotate(
        text,
        place,
        xytext=offset,
        textcoords="offset points",
        fontsize=5,
        ha=across,
        va=up,
        color=color,
        path_effects=[withStroke(linewidth=1.5, foreground="white")],
        arrowprops=LEADER | {"color": color} if side == "far above" else None,
    )


def _percent(tool: dict[str, Any], quantity: str) -> float | None:
    value = tool["errors"][quantity]["median"]
    return 100.0 * value if value else None


def compose(accuracy_cost: Any) -> Figure:
    """Draw the figure."""
    drawn = drawing.figure(height=3.3)
    panels = drawn.subplots(1, 2)
    for axes, quantity, name in zip(panels, PANELS, "ab", strict=True):
        draw(axes, accuracy_cost["tools"], quantity)
        drawing.letter(axes, name)
    handles, labels = panels[1].get_legend_handles_labels()
    drawn.legend(
        handles,
        labels,
        loc="outside lower center",
        ncol=6,
        title="thin lines: up to the 95th percentile of the error, quartiles of the time; "
        f"of the surrogates, for {REFERENCE}; open: fewer protocols",
        title_fontsize=6,
    )
    return drawn
