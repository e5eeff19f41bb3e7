"""Figure: seconds per trajectory against error, for every tool on the same held-out protocols.

Markers are medians over the protocols. Thin lines extend to the 95th percentile of the error, and over the quartiles of
the seconds. Open markers are tools measured on fewer protocols than the others. Errors beyond the axis are drawn on its
upper edge, with an arrow. Labels name the closed forms, the named accuracies of the solver, and, of the surrogates
called in batches, the reference model, the best and the worst. The figure reads the measurement of
`experiments.measurements.accuracy_cost`.
"""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from paper_figures.style import drawing, models_style
from paper_figures.style.cost_style import FORCE_ERROR, KINDS, kind_of, mark_paper
from paper_figures.style.models_style import REFERENCE

PANELS = {"pull_off_force": "error of the pull-off force (%)", "force": FORCE_ERROR}
PLACES = {
    "pull_off_force": {"DMT": "below", "Maugis-Dugdale": "far right", "Persson-Brener": "far above"},
    "force": {"Maugis-Dugdale": "far right", "Hertz, rubbery": "above left"},
}
"""Where closed forms are named in each panel, when not to the left of their marker."""
OFFSETS = {
    "beside": ((-5, 0), "right", "center"),
    "below": ((0, -5), "center", "top"),
    "above left": ((-4, 2), "right", "bottom"),
    "far above": ((2, 50), "right", "center"),
    "far right": ((21, 4), "left", "center"),
}
"""Offset of a name, in points, and its alignment; a line joins those far away."""
LEADER = {"arrowstyle": "-", "linewidth": 0.4, "patchA": None, "shrinkA": 1, "shrinkB": 2}
"""Line from a name that lies far from its marker."""
ROW = 1.6
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
        axes.plot(seconds if curve else [], errors if curve else [], color=style["color"], linewidth=1.0, zorder=2)
        axes.plot([], [], linestyle="-" if curve else "", label=kind, markersize=4, linewidth=1.0, **style)
        for tool, second, error in zip(points, seconds, errors, strict=True):
            shade = models_style.color(tool["model"]) if "model" in tool else style["color"]
            thin = {"color": shade, "linewidth": 0.5, "alpha": 0.7}
            if tool.get("model", REFERENCE) != REFERENCE:
                # The spread of one surrogate stands for those of all, which would cover each other.
                thin["linewidth"] = 0.0
            axes.plot([second, second], [error, min(100.0 * tool["errors"][quantity]["p95"], LARGEST)], **thin)
            axes.plot([tool["seconds"]["low"], tool["seconds"]["high"]], [error, error], **thin)
            inside = shade if tool["protocols"] == most else "white"
            mark = "^" if _percent(tool, quantity) > LARGEST else style["marker"]
            axes.plot(
                second,
                error,
                mark,
                color=shade,
                markersize=2.8 if tool.get("model") else 4,
                markerfacecolor=inside,
                zorder=3,
                clip_on=False,
            )
            if tool["setting"] in named:
                text, side = named[tool["setting"]]
                at = tool["seconds"]["low"] if kind == "solver" else second
                _annotate(axes, text, side, (at, error), style["color"])
    floor = next((tool for tool in tools if tool["kind"] == "measurement steps"), None)
    if floor and _percent(floor, quantity):
        level = _percent(floor, quantity)
        axes.axhline(level, color="0.6", linewidth=0.7, linestyle="--", zorder=0)
        axes.annotate(
            "120 steps",
            (0.735, level),
            xycoords=("axes fraction", "data"),
            xytext=(0, 1),
            textcoords="offset points",
            color="0.4",
            ha="center",
            va="bottom",
        )
    axes.set(xscale="log", yscale="log", xlabel="time a trajectory, one core (s)", ylabel=PANELS[quantity])
    axes.set_xlim(axes.get_xlim()[0] / 400.0, 2000.0)
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
            text = tool["setting"] if forms.count(form) > 1 else form
            named[tool["setting"]] = (text, PLACES[quantity].get(text, "beside"))
    return named


def name_surrogates(axes: Axes, tools: list[dict[str, Any]], quantity: str) -> None:
    """Write names below the surrogates called in batches, with a line to each, since their markers are crowded."""
    ranked = [tool for tool in tools if kind_of(tool) == "ONNX batch" and _percent(tool, quantity) is not None]
    if not ranked:
        return
    ranked.sort(key=lambda tool: _percent(tool, quantity))
    words = {ranked[-1]["model"]: "worst: ", ranked[0]["model"]: "best: "}
    named = [tool for tool in ranked if tool["model"] in {*words, REFERENCE}]
    left = min(tool["seconds"]["median"] for tool in tools if tool.get("way") == "ONNX batch") / 1.7
    for row, tool in enumerate(reversed(named), start=1):
        axes.annotate(
            words.get(tool["model"], "") + tool["model"],
            (tool["seconds"]["median"], _percent(tool, quantity)),
            xytext=(left, _percent(ranked[0], quantity) / ROW**row),
            ha="right",
            va="center",
            color=models_style.color(tool["model"]),
            arrowprops=LEADER | {"relpos": (1.0, 0.5), "color": models_style.color(tool["model"]), "shrinkA": 0},
        )


def _annotate(axes: Axes, text: str, side: str, place: tuple[float, float], color: str) -> None:
    offset, across, up = OFFSETS[side]
    leader = LEADER | {"color": color, "relpos": (1.0, 0.0) if across == "right" else (0.0, 0.5)}
    axes.annotate(
        text,
        place,
        xytext=offset,
        textcoords="offset points",
        ha=across,
        va=up,
        color=color,
        path_effects=[withStroke(linewidth=1.5, foreground="white")],
        arrowprops=leader if side.startswith("far") else None,
    )


def _percent(tool: dict[str, Any], quantity: str) -> float | None:
    value = tool["errors"][quantity]["median"]
    return 100.0 * value if value else None


def compose(accuracy_cost: Any) -> Figure:
    """Draw the figure."""
    drawn = drawing.figure(height=4.7)
    panels = drawn.subplots(1, 2)
    for axes, quantity, name in zip(panels, PANELS, "ab", strict=True):
        draw(axes, accuracy_cost["tools"], quantity)
        drawing.letter(axes, name)
    handles = [*panels[1].get_legend_handles_labels()[0], *models_style.family_handles()]
    words = (
        "thin lines: up to the 95th percentile of the error, quartiles of the time; of the surrogates, for "
        f"{REFERENCE}; open: fewer protocols"
    )
    drawn.legend(handles=handles, loc="outside lower center", ncols=6, title=words)
    return drawn
