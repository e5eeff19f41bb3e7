"""The picture of a fit: measurement and model against indentation, and residuals against time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bem.lab.fit_result import FitResult


def plot_fit(result: FitResult, path: str | Path) -> None:
    """Draw a fit into an image file; the suffix chooses the format."""
    # Drawing without a display, and without touching a caller's pyplot state.
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    FigureCanvasAgg(figure)
    loop, history = figure.subplots(1, 2)
    measured, model = result.measured, result.curve
    loop.plot(1e6 * measured.indentation, 1e6 * measured.force, ".", color="0.6", markersize=3, label="measured")
    loop.plot(1e6 * model.indentation, 1e6 * model.force, color="#0072B2", linewidth=1.4, label="fit")
    if "contact_point" in result.values:
        loop.axvline(1e6 * result.values["contact_point"], color="#D55E00", linewidth=0.8, label="contact point")
    loop.axhline(1e6 * result.values.get("force_offset", 0.0), color="0.8", linewidth=0.8)
    loop.set_xlabel("indentation (µm)")
    loop.set_ylabel(f"force (µN), {measured.force_sign} positive")
    loop.legend(frameon=False)
    history.axhline(0.0, color="0.8", linewidth=0.8)
    history.plot(measured.time, 1e6 * result.residuals, ".", color="#009E73", markersize=3)
    history.set_xlabel("time (s)")
    history.set_ylabel("model minus measurement (µN), in tension")
    for axes in (loop, history):
        axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)
