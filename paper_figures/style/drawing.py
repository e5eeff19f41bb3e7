"""Code shared by all figures: sizes, colours, panel letters, labels, and writing as PDF and PNG."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import Formatter, FuncFormatter, LogFormatterMathtext, LogLocator, NullFormatter

from bem.results.plots import COLOURS
from experiments.paper_numbers import paper_values as paper_values

HERE = Path(__file__).parent
COLUMN, DOUBLE_COLUMN = 88 / 25.4, 180 / 25.4
"""Widths in print of a figure of one column and of two, in inches."""

BLUE, RED, GREEN, VIOLET, ORANGE, SKY = FAMILIES = [COLOURS[f"M{number}"] for number in range(1, 7)]
"""Colours of the six families, and of what is no tool in figures without them."""
BLACK, PAPER = COLOURS["solver"], COLOURS["paper"]
PHASES = {"loading": BLUE, "dwell": ORANGE, "unloading": GREEN}
KINDS = {
    "solver": {"color": BLACK, "marker": "o"},
    "paper's discretisation": {"color": PAPER, "marker": "s"},
    "closed form": {"color": COLOURS["closed form"], "marker": "X"},
    "fast": {"color": COLOURS["fast"], "marker": "P"},
    "accurate": {"color": COLOURS["accurate"], "marker": "P"},
}
"""Looks of the tools in figures of cost."""
TIME, INDENTATION, FORCE = r"time $\hat t$", r"indentation $\hat\delta$", r"force $\hat P$, tension $> 0$"


def paper_seconds() -> dict[str, float]:
    """Mean seconds of one trajectory in the paper, by its solver and by its surrogate."""
    paper = paper_values("dataset")
    return {
        "paper's solver (mean)": 3600.0 * paper["cpu_hours"] / paper["trajectories"],
        "paper's surrogate": paper_values("cost")["surrogate_seconds"],
    }


def figure(*, width: float = DOUBLE_COLUMN, height: float) -> Figure:
    """Create an empty figure in the paper's style; width and height in inches."""
    plt.style.use(HERE / "paper.mplstyle")
    return plt.figure(figsize=(width, height))


def letters(panels: Iterable[Axes]) -> None:
    """Put the letters a, b, c, ... above the left corners of panels, in their order."""
    for axes, name in zip(panels, ascii_lowercase, strict=False):
        axes.set_title(f"({name})", loc="left", fontweight="bold")


def panels(rows: int, columns: int, *, height: float, **options: Any) -> tuple[Figure, np.ndarray]:
    """Create a figure in two columns' width and its lettered panels, row by row; options are those of `subplots`."""
    drawn = figure(height=height)
    axes = drawn.subplots(rows, columns, squeeze=False, **options).ravel()
    letters(axes)
    return drawn, axes


def zero_line(axes: Axes) -> None:
    """Draw a faint horizontal line at zero, behind the data."""
    axes.axhline(0.0, color="0.8", linewidth=0.6, zorder=0)


def by_phase(axes: Axes, time: np.ndarray, values: np.ndarray, phase_times: Sequence[float]) -> None:
    """Draw values over time, coloured by phase; the four `phase_times` are the start and the ends of the phases."""
    for begin, end, color in zip(phase_times[:-1], phase_times[1:], PHASES.values(), strict=True):
        inside = (time >= begin * (1.0 - 1e-9)) & (time <= end * (1.0 + 1e-9))
        axes.plot(time[inside], values[inside], color=color)


def written(value: float, form: str = "g") -> str:
    """A number in a format, with the same minus sign as at the ticks of an axis."""
    return Formatter.fix_minus(format(value, form))


def note(axes: Axes, text: str, at: tuple[float, float], shift: tuple[float, float], **style: Any) -> None:
    """Write text at a shift in points from a place in the data."""
    axes.annotate(text, at, shift, textcoords="offset points", **style)


def beside(axes: Axes, x: float, text: str, *, height: float, shift: float, **style: Any) -> None:
    """Write text beside a vertical line at `x`: `shift` points to its right, at a share `height` of the panel."""
    position = {"xycoords": ("data", "axes fraction"), "xytext": (shift, 0), "textcoords": "offset points"}
    axes.annotate(text, (x, height), ha="right" if shift < 0 else "left", va="top", **position, **style)


def log_labels(axis: Axis) -> None:
    """Label a logarithmic axis at decades, and also at 2 and 5 if it spans less than two, so that no labels collide."""
    low, high = axis.get_view_interval()
    short = np.log10(high / low) < 2.0
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if short else (1.0,)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: decade(value)))
    axis.set_minor_formatter(NullFormatter())


def write_decades_plainly(drawn: Figure) -> None:
    """Label logarithmic axes that have the usual powers of ten by numbers without small exponents."""
    for axes in drawn.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if isinstance(axis.get_major_formatter(), LogFormatterMathtext):
                axis.set_major_formatter(FuncFormatter(lambda value, _: decade(value)))


def decade(value: float) -> str:
    """A power of ten, or a multiple, as text: 0.001 to 1000 in full, others as 1e-4."""
    text = f"{value:g}" if 0.999e-3 <= value <= 1.001e3 else f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")
    return Formatter.fix_minus(text)


def save(drawn: Figure, name: str, folder: Path) -> None:
    """Write a figure as PDF and PNG, and close it; equal content gives equal bytes."""
    write_decades_plainly(drawn)
    folder.mkdir(parents=True, exist_ok=True)
    drawn.savefig(folder / f"{name}.pdf", metadata={"CreationDate": None})
    drawn.savefig(folder / f"{name}.png", metadata={"Software": None})
    plt.close(drawn)
