"""Diagrams of the 18 paper models, drawn from the graphs of the Keras models.

There is one panel for each family, with its conditionings side by side. Solid arrows carry sequences, dotted arrows the
Tabor parameter. Two boxes side by side have the same input. With `--family`, a user-defined family is drawn alone.
"""

import textwrap
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from bem._support.outputs import plain_name
from paper_figures.style import drawing, schematics
from surrogate.architectures.naming import CONDITIONINGS, FAMILIES, PAPER_FAMILIES, paper_names

TABOR = "tabor"
FILL = {
    "InputLayer": schematics.PLAIN_FILL,
    "LSTM": schematics.LSTM_FILL,
    "LayerNormalization": "#C5C5C5",
    **dict.fromkeys(("Conv1D", "ResidualBlock"), schematics.CONV_FILL),
    "EncoderBlock": "#F1D47D",
    "Dense": schematics.DENSE_FILL,
    **dict.fromkeys(("AppendTabor", "FiLM", "TaborGate"), schematics.TABOR_FILL),
    "Add": "#ffffff",
}
LEGEND = {
    "LSTM": schematics.LSTM_FILL,
    "convolution": schematics.CONV_FILL,
    "attention": FILL["EncoderBlock"],
    "dense layer": schematics.DENSE_FILL,
    "normalisation": FILL["LayerNormalization"],
    r"Tabor parameter $\mu$ enters": schematics.TABOR_FILL,
}
BOX_WIDTH, BOX_HEIGHT, COLUMN_STEP = 0.9, 0.66, 1.24


def ranks(layers: list[dict[str, Any]]) -> dict[str, int]:
    """Row of each layer, counted from the input: one below the lowest of the layers that it reads."""
    rows: dict[str, int] = {}
    for layer in layers:
        above = [rows[name] for name in layer["inputs"] if name != TABOR]
        rows[layer["name"]] = 1 + max(above) if above else 0
    return rows


def places(layers: list[dict[str, Any]]) -> dict[str, tuple[float, float]]:
    """Centre of each box: rows go downwards, boxes of one row are side by side. The Tabor parameter has none."""
    rows = ranks(layers)
    by_row: dict[int, list[str]] = {}
    for layer in layers:
        if layer["name"] != TABOR:
            by_row.setdefault(rows[layer["name"]], []).append(layer["name"])
    centres = {}
    for row, members in by_row.items():
        for index, name in enumerate(members):
            centres[name] = (0.56 * (index - 0.5 * (len(members) - 1)), -float(row))
    return centres


def draw_arrow(axes: Axes, begin: tuple[float, float], end: tuple[float, float], **style: Any) -> None:
    """Draw an arrow between two points, smaller than in the other figures."""
    schematics.arrow(axes, begin, end, **{"lw": 0.6, "mutation_scale": 5} | style)


def draw_input(axes: Axes, source: str, where: dict[str, tuple[float, float]], name: str) -> None:
    """Draw the arrow from an input of a layer to the layer: straight from the row above, otherwise around boxes."""
    x, y = where[name]
    half, side = 0.5 * BOX_HEIGHT, 0.5 * BOX_WIDTH
    if source == TABOR:
        begin = (x - side - 0.16, y)
        draw_arrow(axes, begin, (x - side, y), linestyle=":", lw=0.8, color=drawing.RED)
        axes.text(begin[0], y + 0.05, r"$\mu$", color=drawing.RED, ha="center", va="bottom")
        return
    x0, y0 = where[source]
    if y0 - y < 1.5:
        draw_arrow(axes, (x0, y0 - half), (x, y + half))
    else:
        draw_arrow(axes, (x0 + side, y0), (x + side, y), connectionstyle="arc3,rad=-0.4")


def box_text(layer: dict[str, Any]) -> str:
    """Text of a box, on one or two lines."""
    if layer["kind"] == "InputLayer":
        return f"history\n{layer['width']} channels"
    return layer["label"].replace(", ", "\n", 1)


def draw_model(axes: Axes, graph: dict[str, Any], left: float) -> None:
    """Draw one model as a column of boxes, `left` data units from the left."""
    layers = [layer for layer in graph["layers"] if layer["name"] != TABOR]
    where = {name: (x + left, y) for name, (x, y) in places(graph["layers"]).items()}
    heights = [y for _, y in where.values()]
    for layer in layers:
        for source in layer["inputs"]:
            draw_input(axes, source, where, layer["name"])
        crowded = heights.count(where[layer["name"]][1]) > 1
        fill = FILL.get(layer["kind"], "#ffffff")
        text = box_text(layer).replace(" ", "\n") if crowded else box_text(layer)
        size = {"width": 0.5 if crowded else BOX_WIDTH, "height": BOX_HEIGHT}
        schematics.box(axes, *where[layer["name"]], text, fill, **size, rounding=0.08, lw=0.5, linespacing=1.1)


def draw_family(axes: Axes, graphs: dict[str, Any], family: str, deepest: int) -> None:
    """Draw the models of one family side by side, in a panel of `deepest` rows."""
    for column, conditioning in enumerate(name for name in CONDITIONINGS if f"{family}-{name}" in graphs):
        graph, x = graphs[f"{family}-{conditioning}"], column * COLUMN_STEP
        draw_model(axes, graph, x)
        axes.text(x, 0.5, conditioning, ha="center", fontweight="bold")
        last = max(ranks(graph["layers"]).values())
        count = f"{graph['parameters']:,}\nparameters"
        axes.text(x, -last - 0.72, count, ha="center", va="center", linespacing=0.95)
    axes.set(xlim=(-0.65, 2 * COLUMN_STEP + 0.75), ylim=(-deepest - 1.1, 0.8))
    axes.axis("off")


def draw_own(architectures: dict[str, Any], family: str) -> Figure:
    """Draw the models of one family.

    Raises:
        ValueError: The result holds no family of that name.
    """
    families = architectures["families"]
    if family not in families:
        raise ValueError(f"family must be one of {', '.join(families)}; received {family!r}")
    graphs = {name: graph for name, graph in architectures["models"].items() if name.rpartition("-")[0] == family}
    deepest = max(row for graph in graphs.values() for row in ranks(graph["layers"]).values())
    drawn = drawing.figure(width=drawing.COLUMN, height=0.34 * (deepest + 2))
    axes = drawn.subplots()
    draw_family(axes, graphs, family, deepest)
    axes.set_title(f"{family}: {families[family]}", loc="left", fontweight="bold")
    return drawn


def compose(architecture_graphs: Any, family: str | None = None) -> Figure | dict[str, Figure]:
    """Draw the 18 paper models, or one family."""
    if family is not None:
        return {f"figure-architecture-{plain_name(family, 'a --family')}": draw_own(architecture_graphs, family)}
    graphs = architecture_graphs["models"]
    deepest = max(row for name in paper_names() for row in ranks(graphs[name]["layers"]).values())
    drawn = drawing.figure(height=9.0)
    panels = drawn.subplots(2, 3)
    for axes, name, code in zip(panels.flat, "abcdef", PAPER_FAMILIES, strict=True):
        draw_family(axes, graphs, code, deepest)
        guessed = "; sizes are a guess" * (drawing.paper_values("structure")["sizes"][code]["how"] == "guessed")
        title = textwrap.fill(f"({name}) {code}: {FAMILIES[code].description}{guessed}", 36)
        axes.set_title(title, loc="left", fontweight="bold", fontsize=6.5)
    marks = [Patch(facecolor=color, edgecolor="0.35", linewidth=0.6, label=name) for name, color in LEGEND.items()]
    drawn.legend(handles=marks, loc="outside lower center", ncols=len(marks))
    return drawn
