"""Figure 4, and the diagrams of the 18 models."""

import textwrap
from typing import Annotated, Any

import typer
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from bem._support.outputs import plain_name
from paper_figures.style import drawing
from paper_figures.style.drawing import arrow, box, elbow, line, node
from surrogate.architectures.naming import CONDITIONINGS, FAMILIES, PAPER_FAMILIES, paper_names


def draw_lstm(axes: Axes) -> None:
    """Panel (a): one step of an LSTM cell."""
    drawing.blank(axes, 10.0, 6.0)
    axes.add_patch(
        drawing.FancyBboxPatch(
            (1.2, 0.9), 7.6, 4.2, boxstyle="round,pad=0,rounding_size=0.3", fc=drawing.PLAIN_FILL, ec="0.5", lw=0.6
        )
    )
    gates = (
        (2.2, r"$\sigma_g$", "$f_j$"),
        (3.7, r"$\sigma_g$", "$i_j$"),
        (5.2, "tanh", r"$\tilde c_j$"),
        (6.7, r"$\sigma_g$", "$o_j$"),
    )
    line(axes, (0.2, 1.4), (6.7, 1.4))
    for x, text, name in gates:
        box(axes, x, 2.2, text, drawing.LSTM_FILL, width=1.0, height=0.6)
        arrow(axes, (x, 1.4), (x, 1.9))
        axes.text(x + 0.12, 2.72, name, ha="left", va="center")
    for x, y, text in ((2.2, 4.5, r"$\times$"), (4.45, 3.4, r"$\times$"), (4.45, 4.5, "$+$"), (6.7, 3.4, r"$\times$")):
        node(axes, x, y, text, 0.24)
    arrow(axes, (0.2, 4.5), (1.96, 4.5))
    arrow(axes, (2.44, 4.5), (4.21, 4.5))
    arrow(axes, (4.69, 4.5), (9.8, 4.5))
    arrow(axes, (2.2, 2.5), (2.2, 4.26))
    elbow(axes, (3.7, 2.5), (3.7, 3.4), (4.21, 3.4))
    elbow(axes, (5.2, 2.5), (5.2, 3.4), (4.69, 3.4))
    arrow(axes, (4.45, 3.64), (4.45, 4.26))
    arrow(axes, (6.7, 2.5), (6.7, 3.16))
    line(axes, (8.0, 4.5), (8.0, 4.1))
    box(axes, 8.0, 3.8, "tanh", drawing.LSTM_FILL, width=0.9, height=0.55)
    elbow(axes, (8.0, 3.52), (8.0, 3.4), (6.94, 3.4))
    elbow(axes, (6.7, 3.64), (6.7, 3.95), (7.3, 3.95), (7.3, 1.4), (9.8, 1.4))
    arrow(axes, (1.6, 0.2), (1.6, 1.4))
    for x, y, text, ha in (
        (0.15, 4.75, "$c_{j-1}$", "left"),
        (9.85, 4.75, "$c_j$", "right"),
        (0.15, 1.65, "$h_{j-1}$", "left"),
        (9.85, 1.65, "$h_j$", "right"),
        (1.75, 0.4, "$x_j$", "left"),
    ):
        axes.text(x, y, text, ha=ha)


def draw_tcn(axes: Axes) -> None:
    """Panel (b): a residual block of two dilated causal convolutions."""
    drawing.blank(axes, 10.0, 6.0)
    conv, plain = drawing.CONV_FILL, drawing.PLAIN_FILL
    stages = (("causal Conv, 3 points\ndilation $d$", conv), ("LayerNorm, ReLU", plain), ("Dropout 0.1", plain))
    height, gap, y = 0.64, 0.2, 0.9
    for _ in range(2):
        for text, fill in stages:
            box(axes, 4.0, y, text, fill, width=3.4, height=height)
            arrow(axes, (4.0, y - 0.5 * height - gap), (4.0, y - 0.5 * height))
            y += height + gap
    node(axes, 4.0, y + 0.02, "$+$", 0.22)
    line(axes, (4.0, y - 0.52), (4.0, y - 0.2))
    arrow(axes, (4.0, y + 0.24), (4.0, 6.5))
    line(axes, (4.0, 0.05), (4.0, 0.5))
    line(axes, (4.0, 0.25), (8.0, 0.25), (8.0, 2.45))
    box(axes, 8.0, 2.9, "identity, or Conv 1 point\nwhere the width changes", plain, width=3.5, height=0.9)
    elbow(axes, (8.0, 3.35), (8.0, y + 0.02), (4.22, y + 0.02))
    axes.text(3.6, 0.05, r"$z^{(l-1)}$", ha="right")
    axes.text(3.6, 6.05, r"$z^{(l)}$", ha="right")
    axes.set_ylim(0.0, 6.5)


def draw_readout(axes: Axes, layers: dict[str, Any]) -> None:
    """Panel (c): the dense readout, the same at every step."""
    drawing.blank(axes, 10.0, 6.0)
    hidden, force = layers["readout_hidden"], layers["force"]
    for x, step in ((1.7, "1"), (4.4, "j"), (8.0, "N")):
        box(axes, x, 1.9, f"Dense {hidden['width']}\nReLU", drawing.DENSE_FILL, width=1.9, height=0.95)
        box(axes, x, 3.7, f"Dense {force['width']}", drawing.DENSE_FILL, width=1.9, height=0.75)
        arrow(axes, (x, 0.75), (x, 1.42))
        arrow(axes, (x, 2.38), (x, 3.32))
        arrow(axes, (x, 4.08), (x, 4.8))
        axes.text(x, 0.6, rf"$z_{{{step}}}$", ha="center", va="top", fontsize=7.5)
        axes.text(x, 4.9, rf"$\hat P_{{{step}}}$", ha="center", va="bottom", fontsize=7.5)
    for x in (3.05, 6.2):
        axes.text(x, 2.8, r"$\cdots$", ha="center", va="center", fontsize=9)
    axes.text(5.0, 5.75, "same weights at every step", ha="center", color="0.35")


def draw_m1(axes: Axes, graph: dict[str, Any], channels: list[str]) -> None:
    """Panel (d): M1-concat from input to force, with the widths and parameter counts of the Keras model."""
    drawing.blank(axes, 10.0, 6.0)
    layers = [layer for layer in graph["layers"] if layer["kind"] != "InputLayer"]
    physical = [name for name in channels if name not in ("time", "indentation")]
    box(axes, 1.35, 4.4, "time $\\hat t$\nindentation $\\hat\\delta$", drawing.PLAIN_FILL, width=2.5, height=1.0)
    box(axes, 1.35, 2.7, "physical features\n" + ", ".join(physical), drawing.PLAIN_FILL, width=2.5, height=1.0)
    box(axes, 1.35, 1.0, "Tabor\nparameter $\\mu$", drawing.TABOR_FILL, width=2.5, height=0.9)
    fills = {"AppendTabor": drawing.TABOR_FILL, "LSTM": drawing.LSTM_FILL, "Dense": drawing.DENSE_FILL}
    x, bottom, top = 5.5, 0.5, 5.5
    step = (top - bottom) / (len(layers) - 1)
    arrow(axes, (1.35, 3.9), (1.35, 3.2))
    elbow(axes, (2.6, 4.4), (3.1, 4.4), (3.1, bottom + 0.1), (x - 1.5, bottom + 0.1))
    line(axes, (2.6, 2.7), (3.1, 2.7))
    corner = (2.75, bottom - 0.15)
    elbow(axes, (2.6, 1.0), (2.75, 1.0), corner, (x - 1.5, corner[1]), linestyle=":", color=drawing.RED)
    for index, layer in enumerate(layers):
        y = bottom + index * step
        box(axes, x, y, layer["label"], fills.get(layer["kind"], drawing.PLAIN_FILL), width=3.0, height=0.66)
        note = f"width {layer['width']}"
        if layer["parameters"]:
            note += f"\n{layer['parameters']:,} parameters"
        axes.text(x + 1.65, y, note, va="center", color="0.35", linespacing=1.0)
        if index:
            arrow(axes, (x, y - step + 0.33), (x, y - 0.33))
    arrow(axes, (x, top + 0.33), (x, top + 0.75))
    axes.text(x + 0.15, top + 0.5, r"$\hat P$", fontsize=7.5)
    axes.set_ylim(0.0, 6.4)


def figure_4(architecture_graphs: Any) -> Figure:
    """Figure 4: the building blocks, and the M1-concat model with widths and parameter counts from the Keras model."""
    graph = architecture_graphs["models"]["M1-concat"]
    layers = {layer["name"]: layer for layer in graph["layers"]}
    drawn = drawing.figure(height=4.9)
    panels = drawn.subplots(2, 2)
    draw_lstm(panels[0, 0])
    draw_tcn(panels[0, 1])
    draw_readout(panels[1, 0], layers)
    draw_m1(panels[1, 1], graph, architecture_graphs["channels"])
    titles = ("LSTM cell", "residual TCN block", "dense readout", f"M1-concat, {graph['parameters']:,} parameters")
    for axes, name, title in zip(panels.flat, "abcd", titles, strict=True):
        axes.set_title(f"({name}) {title}", loc="left", fontweight="bold")
    return drawn


TABOR = "tabor"
FILL = {
    "InputLayer": drawing.PLAIN_FILL,
    "LSTM": drawing.LSTM_FILL,
    "LayerNormalization": "#C5C5C5",
    **dict.fromkeys(("Conv1D", "ResidualTCNBlock"), drawing.CONV_FILL),
    "EncoderBlock": "#F1D47D",
    "Dense": drawing.DENSE_FILL,
    **dict.fromkeys(("AppendTabor", "FiLM", "TaborGate"), drawing.TABOR_FILL),
    "Add": "#ffffff",
}
LEGEND = {
    "LSTM": drawing.LSTM_FILL,
    "convolution": drawing.CONV_FILL,
    "attention": FILL["EncoderBlock"],
    "dense layer": drawing.DENSE_FILL,
    "normalisation": FILL["LayerNormalization"],
    r"Tabor parameter $\mu$ enters": drawing.TABOR_FILL,
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
    found = {}
    for row, members in by_row.items():
        for index, name in enumerate(members):
            found[name] = (0.56 * (index - 0.5 * (len(members) - 1)), -float(row))
    return found


def draw_arrow(axes: Axes, begin: tuple[float, float], end: tuple[float, float], **style: Any) -> None:
    """Draw an arrow between two points, smaller than in the other figures."""
    drawing.arrow(axes, begin, end, **{"lw": 0.6, "mutation_scale": 5} | style)


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
        drawing.box(axes, *where[layer["name"]], text, fill, **size, rounding=0.08, lw=0.5, linespacing=1.1)


def draw_family(axes: Axes, graphs: dict[str, Any], family: str, deepest: int) -> None:
    """Draw the models of one family side by side, in a panel of `deepest` rows."""
    for column, conditioning in enumerate(one for one in CONDITIONINGS if f"{family}-{one}" in graphs):
        graph, x = graphs[f"{family}-{conditioning}"], column * COLUMN_STEP
        draw_model(axes, graph, x)
        axes.text(x, 0.5, conditioning, ha="center", fontweight="bold")
        last = max(ranks(graph["layers"]).values())
        count = f"{graph['parameters']:,}\nparameters"
        axes.text(x, -last - 0.72, count, ha="center", va="center", linespacing=0.95)
    axes.set(xlim=(-0.65, 2 * COLUMN_STEP + 0.75), ylim=(-deepest - 1.1, 0.8))
    axes.axis("off")


def draw_own(content: dict[str, Any], family: str) -> Figure:
    """Draw the models of one family.

    Raises:
        ValueError: The result holds no family of that name.
    """
    known = content["families"]
    if family not in known:
        raise ValueError(f"family must be one of {', '.join(known)}; received {family!r}")
    graphs = {name: graph for name, graph in content["models"].items() if name.rpartition("-")[0] == family}
    deepest = max(row for graph in graphs.values() for row in ranks(graph["layers"]).values())
    drawn = drawing.figure(width=drawing.COLUMN, height=0.34 * (deepest + 2))
    axes = drawn.subplots()
    draw_family(axes, graphs, family, deepest)
    axes.set_title(f"{family}: {known[family]}", loc="left", fontweight="bold")
    return drawn


def figure_architectures(
    architecture_graphs: Any,
    *,
    family: Annotated[str | None, typer.Option(help="Draw this family of the graphs alone.")] = None,
) -> Figure | dict[str, Figure]:
    """Diagrams of the 18 paper models, drawn from the graphs of the Keras models.

    There is one panel for each family, with its conditionings side by side. Solid arrows carry sequences, dotted arrows
    the Tabor parameter. Two boxes side by side have the same input. With `--family`, a user-defined family is drawn
    alone.
    """
    if family is not None:
        return {f"figure-architecture-{plain_name(family, 'a --family')}": draw_own(architecture_graphs, family)}
    graphs = architecture_graphs["models"]
    deepest = max(row for name in paper_names() for row in ranks(graphs[name]["layers"]).values())
    drawn = drawing.figure(height=9.0)
    panels = drawn.subplots(2, 3)
    for axes, name, one in zip(panels.flat, "abcdef", PAPER_FAMILIES, strict=True):
        draw_family(axes, graphs, one, deepest)
        title = textwrap.fill(f"({name}) {one}: {FAMILIES[one]}", 36)
        axes.set_title(title, loc="left", fontweight="bold", fontsize=6.5)
    marks = [Patch(facecolor=color, edgecolor="0.35", linewidth=0.6, label=name) for name, color in LEGEND.items()]
    drawn.legend(handles=marks, loc="outside lower center", ncols=len(marks))
    return drawn
