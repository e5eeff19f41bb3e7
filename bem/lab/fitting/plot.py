"""The picture of a fit: measurement and model against indentation, and residuals against time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bem.lab.fitting.result import FitResult


def plot_fit(result: FitResult, path: str | Path) -> None:
    """Draw a fit into an image file; the suffix chooses the format."""
    # Drawing without a display, and without touching a caller's pyplot state.
    from matplotlib.figure import Figure
    from matplotlib.ticker import EngFormatter, MaxNLocator

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    loop, history = figure.subplots(1, 2)
    measured, model = result.measured, result.curve
    loop.plot(measured.indentation, measured.force, ".", color="0.6", markersize=3, label="measured")
    loop.plot(model.indentation, model.force, color="#0072B2", linewidth=1.4, label="fit")
    offset = result.values.get("force_offset", 0.0)
    if "contact_point" in result.values:
        # The contact point is that of the stage; the offset of the force bends the spring of a measured indentation.
        bent = 0.0 if result.setup.stiffness is None else offset / result.setup.stiffness
        touched = result.values["contact_point"] + (bent if measured.force_sign == "tension" else -bent)
        loop.axvline(touched, color="#D55E00", linewidth=0.8, label="contact point")
    loop.axhline(offset, color="0.8", linewidth=0.8, label="force offset" if "force_offset" in result.values else None)
    loop.set_xlabel("indentation")
    loop.set_ylabel(f"force, {measured.force_sign} positive")
    loop.xaxis.set_major_formatter(EngFormatter("m"))
    loop.xaxis.set_major_locator(MaxNLocator(5))
    loop.legend(frameon=False)
    history.axhline(0.0, color="0.8", linewidth=0.8)
    history.plot(measured.time, result.residuals, ".", color="#009E73", markersize=3)
    history.set_xlabel("time")
    history.set_ylabel("model minus measurement, in tension")
    history.xaxis.set_major_formatter(EngFormatter("s"))
    for axes in (loop, history):
        axes.yaxis.set_major_formatter(EngFormatter("N"))
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)
