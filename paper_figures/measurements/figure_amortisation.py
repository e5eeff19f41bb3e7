"""Figure and table: core time of data set, training and queries against the number of queries, with break-even numbers.

The figure reads the result of `experiments.trainings.training_costs`.
"""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bem.results.plots import COLOURS
from paper_figures.style import drawing
from paper_figures.style.models_style import REFERENCE, color
from paper_figures.style.writing import Table, caption, left_out, number, percent

QUERIES = np.geomspace(1.0, 1e8, 400)
STYLES = {
    "solver, draft": (COLOURS["draft"], "-"),
    "solver, standard": (drawing.BLACK, "-"),
    "solver, reference": (drawing.BLACK, ":"),
    f"{REFERENCE}, Keras call": (color(REFERENCE), ":"),
    f"{REFERENCE}, ONNX single": (color(REFERENCE), "--"),
    f"{REFERENCE}, ONNX batch": (color(REFERENCE), "-"),
    "paper's solver": (drawing.PAPER, "-"),
    "paper's surrogate": (drawing.PAPER, "--"),
}


def totals(line: dict[str, Any]) -> np.ndarray:
    """Core hours for each number in `QUERIES`, of the same shape."""
    return (line["fixed_seconds"] + QUERIES * line["query_seconds"]) / 3600.0


def compose(amortisation: Any) -> dict[str, Figure | Table]:
    """Draw the figure and write the table of break-even numbers."""
    lines = {line["name"]: line for line in amortisation["lines"]}
    drawn = drawing.figure(height=3.0)
    axes = drawn.subplots()
    for name, (shade, style) in STYLES.items():
        if name in lines:
            axes.loglog(QUERIES, totals(lines[name]), color=shade, linestyle=style, label=name)
    for crossing in amortisation["break_even"]:
        if crossing["surrogate"] in STYLES and crossing["solver"] in STYLES and crossing["queries"]:
            at = crossing["queries"]
            height = (lines[crossing["solver"]]["query_seconds"] * at) / 3600.0
            edge = {"markersize": 4, "markeredgecolor": "white", "markeredgewidth": 0.5}
            axes.plot(at, height, "o", color=STYLES[crossing["surrogate"]][0], zorder=4, **edge)
    size = amortisation["data_set_trajectories"]
    axes.axvline(size, color="0.7", linewidth=0.7, zorder=0)
    drawing.beside(axes, size, "size of the data set", height=1.0, shift=-2, rotation=90, color="0.4")
    axes.set(xlabel="queries", ylabel="core time in all (h)", xlim=(1, 1e8))
    axes.set_ylim(bottom=1e-5)
    axes.legend(loc="upper left", ncols=2)
    phrases = {
        "missing": "Not published yet",
        "unmeasured": "Published but not measured",
        "retrained": "Retrained since the measurement",
        "outdated": "Trained differently from those compared",
    }
    errors = {name: percent(line["errors"]["force"]["median"]) for name, line in lines.items() if line.get("errors")}
    rows = [
        [
            *(word for name in (crossing["surrogate"], crossing["solver"]) for word in (name, errors.get(name, "-"))),
            "never" if crossing["queries"] is None else number(crossing["queries"]),
        ]
        for crossing in amortisation["break_even"]
    ]
    minutes = number(amortisation["data_set_seconds"] / 60.0)
    table = Table(
        ["Surrogate", "Its force error (%)", "Instead of", "Its force error (%)", "Break-even (queries)"],
        rows,
        caption("amortisation", minutes=minutes, left_out=left_out(amortisation, phrases)),
    )
    return {"figure-amortisation": drawn, "amortisation": table}
