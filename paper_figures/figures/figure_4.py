"""Figure 4: the building blocks, and the M1-concat model with widths and parameter counts from the Keras model."""

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paper_figures.style import drawing, schematics
from paper_figures.style.schematics import arrow, box, elbow, line, node


def draw_lstm(axes: Axes) -> None:
    """Panel (a): one step of an LSTM cell."""
    schematics.blank(axes, 10.0, 6.0)
    axes.add_patch(
        schematics.FancyBboxPatch(
            (1.2, 0.9), 7.6, 4.2, boxstyle="round,pad=0,rounding_size=0.3", fc=schematics.PLAIN_FILL, ec="0.5", lw=0.6
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
        box(axes, x, 2.2, text, schematics.LSTM_FILL, width=1.0, height=0.6)
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
    box(axes, 8.0, 3.8, "tanh", schematics.LSTM_FILL, width=0.9, height=0.55)
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
    schematics.blank(axes, 10.0, 6.0)
    conv, plain = schematics.CONV_FILL, schematics.PLAIN_FILL
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
    schematics.blank(axes, 10.0, 6.0)
    hidden, force = layers["readout_hidden"], layers["force"]
    for x, step in ((1.7, "1"), (4.4, "j"), (8.0, "N")):
        box(axes, x, 1.9, f"Dense {hidden['width']}\nReLU", schematics.DENSE_FILL, width=1.9, height=0.95)
        box(axes, x, 3.7, f"Dense {force['width']}", schematics.DENSE_FILL, width=1.9, height=0.75)
        arrow(axes, (x, 0.75), (x, 1.42))
        arrow(axes, (x, 2.38), (x, 3.32))
        arrow(axes, (x, 4.08), (x, 4.8))
        axes.text(x, 0.6, rf"$z_{{{step}}}$", ha="center", va="top", fontsize=7.5)
        axes.text(x, 4.9, rf"$\hat P_{{{step}}}$", ha="center", va="bottom", fontsize=7.5)
    for x in (3.05, 6.2):
        axes.text(x, 2.8, r"$\cdots$", ha="center", va="center", fontsize=9)
    axes.text(5.0, 5.75, "same weights at every step", ha="center", color="0.35")


def draw_model(axes: Axes, graph: dict[str, Any], channels: list[str]) -> None:
    """Panel (d): M1-concat from input to force, with the widths and parameter counts of the Keras model."""
    schematics.blank(axes, 10.0, 6.0)
    layers = [layer for layer in graph["layers"] if layer["kind"] != "InputLayer"]
    physical = [name for name in channels if name not in ("time", "indentation")]
    box(axes, 1.35, 4.4, "time $\\hat t$\nindentation $\\hat\\delta$", schematics.PLAIN_FILL, width=2.5, height=1.0)
    box(axes, 1.35, 2.7, "physical features\n" + ", ".join(physical), schematics.PLAIN_FILL, width=2.5, height=1.0)
    box(axes, 1.35, 1.0, "Tabor\nparameter $\\mu$", schematics.TABOR_FILL, width=2.5, height=0.9)
    fills = {"AppendTabor": schematics.TABOR_FILL, "LSTM": schematics.LSTM_FILL, "Dense": schematics.DENSE_FILL}
    x, bottom, top = 5.5, 0.5, 5.5
    step = (top - bottom) / (len(layers) - 1)
    arrow(axes, (1.35, 3.9), (1.35, 3.2))
    elbow(axes, (2.6, 4.4), (3.1, 4.4), (3.1, bottom + 0.1), (x - 1.5, bottom + 0.1))
    line(axes, (2.6, 2.7), (3.1, 2.7))
    corner = (2.75, bottom - 0.15)
    elbow(axes, (2.6, 1.0), (2.75, 1.0), corner, (x - 1.5, corner[1]), linestyle=":", color=drawing.RED)
    for index, layer in enumerate(layers):
        y = bottom + index * step
        box(axes, x, y, layer["label"], fills.get(layer["kind"], schematics.PLAIN_FILL), width=3.0, height=0.66)
        note = f"width {layer['width']}"
        if layer["parameters"]:
            note += f"\n{layer['parameters']:,} parameters"
        axes.text(x + 1.65, y, note, va="center", color="0.35", linespacing=1.0)
        if index:
            arrow(axes, (x, y - step + 0.33), (x, y - 0.33))
    arrow(axes, (x, top + 0.33), (x, top + 0.75))
    axes.text(x + 0.15, top + 0.5, r"$\hat P$", fontsize=7.5)
    axes.set_ylim(0.0, 6.4)


def compose(architecture_graphs: Any) -> Figure:
    """Draw figure 4."""
    graph = architecture_graphs["models"]["M1-concat"]
    layers = {layer["name"]: layer for layer in graph["layers"]}
    drawn = drawing.figure(height=4.9)
    panels = drawn.subplots(2, 2)
    draw_lstm(panels[0, 0])
    draw_tcn(panels[0, 1])
    draw_readout(panels[1, 0], layers)
    draw_model(panels[1, 1], graph, architecture_graphs["channels"])
    titles = ("LSTM cell", "residual TCN block", "dense readout", f"M1-concat, {graph['parameters']:,} parameters")
    for axes, name, title in zip(panels.flat, "abcd", titles, strict=True):
        axes.set_title(f"({name}) {title}", loc="left", fontweight="bold")
    return drawn
