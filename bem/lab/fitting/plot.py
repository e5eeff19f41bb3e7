"""The picture of a fit: measurement and model against indentation, and residuals against time."""

from __future__ import annotations

from pathlib import Path

from bem._support.validation import FloatArray
from bem.lab.curve import ForceCurve
from bem.plots import COLOURS, PULL_OFF, ZERO


def plot_fit(
    path: str | Path,
    measured: ForceCurve,
    model: ForceCurve,
    residuals: FloatArray,
    contact_point: float | None,
    force_offset: float | None,
) -> None:
    """Draw a fit into an image file; the suffix chooses the format.

    Args:
        path: of the image.
        measured, model: the curves, of n points each.
        residuals: model minus measurement in tension, in N, shape (n,).
        contact_point, force_offset: indentation (m) and force (N) of what was fitted; `None` for what was not.
    """
    # Drawing without a display, and without touching a caller's pyplot state.
    from matplotlib.figure import Figure
    from matplotlib.ticker import EngFormatter, MaxNLocator

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    loop, history = figure.subplots(1, 2)
    loop.plot(measured.indentation, measured.force, ".", color="0.6", markersize=3, label="measured")
    loop.plot(model.indentation, model.force, color=COLOURS["solver"], linewidth=1.2, label="fit")
    if contact_point is not None:
        loop.axvline(contact_point, color=PULL_OFF, linewidth=0.8, label="contact point")
    named = None if force_offset is None else "force offset"
    loop.axhline(force_offset or 0.0, color="0.8", linewidth=0.8, label=named)
    loop.set_xlabel("indentation")
    loop.set_ylabel(f"force, {measured.force_sign} positive")
    loop.xaxis.set_major_formatter(EngFormatter("m"))
    loop.xaxis.set_major_locator(MaxNLocator(5))
    loop.legend(frameon=False)
    history.axhline(0.0, **ZERO)
    history.plot(measured.time, residuals, ".", color="0.4", markersize=3)
    history.set_xlabel("time")
    history.set_ylabel("model minus measurement, in tension")
    history.xaxis.set_major_formatter(EngFormatter("s"))
    for axes in (loop, history):
        axes.yaxis.set_major_formatter(EngFormatter("N"))
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)
