"""What all figures share: sizes, colours, panel letters, the paper's values, writing PDF and PNG."""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from experiments.paper_numbers import paper_values as paper_values

HERE = Path(__file__).parent
COLUMN, DOUBLE_COLUMN = 90 / 25.4, 190 / 25.4
"""Widths of Elsevier's single and double column in inches."""

BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
    "#000000",
)
PHASES = {"loading": BLUE, "dwell": ORANGE, "unloading": GREEN}
PAPER = "#882255"
"""The colour of everything that is the paper's, and of nothing else."""


def figure(*, width: float = DOUBLE_COLUMN, height: float) -> Figure:
    """An empty figure in the paper's style; width and height in inches."""
    plt.style.use(HERE / "paper.mplstyle")
    return plt.figure(figsize=(width, height))


def letter(axes: Axes, name: str) -> None:
    """Put the panel letter above the left corner of a panel."""
    axes.set_title(f"({name})", loc="left", fontweight="bold")


def log_labels(axis: Axis) -> None:
    """Label a logarithmic axis so that labels never collide: decades, and 2 and 5 where it spans fewer than two."""
    low, high = axis.get_view_interval()
    short = np.log10(high / low) < 2.0
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if short else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: _power(value)))
    axis.set_minor_formatter(NullFormatter())


def _power(value: float) -> str:
    exponent = int(np.floor(np.log10(value) + 1e-9))
    factor = value / 10.0**exponent
    if -2 <= exponent <= 2:
        return f"{value:g}"
    return rf"$10^{{{exponent}}}$" if factor < 1.001 else rf"${factor:.0f}\times10^{{{exponent}}}$"


def save(drawn: Figure, name: str, folder: Path) -> None:
    """Write a figure as PDF and PNG, the same bytes for the same content."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn.savefig(folder / f"{name}.pdf", metadata={"CreationDate": None})
    drawn.savefig(folder / f"{name}.png", metadata={"Software": None})
    plt.close(drawn)
