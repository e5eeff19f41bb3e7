"""Figure: core time of data set, training and queries against the number of queries, with break-even counts.

Reads the result of `experiments.cost.amortisation`.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.command_line import run_main
from paper_figures.style import drawing
from paper_figures.style.writing import TABLES, number, write_table

RESULT = Path("published/measurements/amortisation.json")
REFERENCE_MODEL = "M1-concat"
QUERIES = np.geomspace(1.0, 1e8, 400)
STYLES = {
    "solver, draft": (drawing.SKY, "-"),
    "solver, standard": (drawing.BLUE, "-"),
    "solver, reference": (drawing.BLACK, "-"),
    f"{REFERENCE_MODEL}, Keras call": (drawing.PURPLE, "--"),
    f"{REFERENCE_MODEL}, ONNX single": (drawing.GREEN, "--"),
    f"{REFERENCE_MODEL}, ONNX batch": (drawing.ORANGE, "--"),
    "paper's solver": (drawing.PAPER, "-"),
    "paper's surrogate": (drawing.PAPER, "--"),
}


def totals(line: dict[str, Any]) -> np.ndarray:
    """Core hours for each number of queries."""
    return (line["fixed_seconds"] + QUERIES * line["query_seconds"]) / 3600.0


def rows_of(content: dict[str, Any]) -> list[list[str]]:
    """One row for each pair of surrogate and solver, with the median error of the force of both."""
    lines = {line["name"]: line for line in content["lines"]}

    def error(name: str) -> str:
        errors = lines.get(name, {}).get("errors")
        return "-" if errors is None else number(100.0 * errors["force"]["median"], 2)

    return [
        [
            one["surrogate"],
            error(one["surrogate"]),
            one["solver"],
            error(one["solver"]),
            "never" if one["queries"] is None else number(one["queries"]),
        ]
        for one in content["break_even"]
    ]


def main(
    result: Annotated[Path, typer.Option(help="Result file of the amortisation.")] = RESULT,
    folder: Annotated[Path, typer.Option(help="Where the figure goes.")] = drawing.FIGURES,
    tables: Annotated[Path, typer.Option(help="Where the table goes.")] = TABLES,
) -> None:
    """Draw the figure and write the table of break-even counts."""
    content = drawing.read_result(result, "make measure-amortisation")
    lines = {line["name"]: line for line in content["lines"]}
    drawn = drawing.figure(width=drawing.COLUMN * 1.6, height=3.2)
    axes = drawn.subplots()
    for name, (color, style) in STYLES.items():
        if name in lines:
            axes.loglog(QUERIES, totals(lines[name]), color=color, linestyle=style, label=name)
    for one in content["break_even"]:
        if one["surrogate"] in STYLES and one["solver"] in STYLES and one["queries"]:
            at = one["queries"]
            height = (lines[one["solver"]]["query_seconds"] * at) / 3600.0
            color = STYLES[one["surrogate"]][0]
            axes.plot(
                at, height, "o", color=color, markersize=4, markeredgecolor="white", markeredgewidth=0.5, zorder=4
            )
    axes.axvline(content["data_set_trajectories"], color="0.7", linewidth=0.7, zorder=0)
    axes.annotate(
        "size of the data set",
        (content["data_set_trajectories"], 0.98),
        xycoords=("data", "axes fraction"),
        rotation=90,
        fontsize=5.5,
        color="0.4",
        xytext=(-2, 0),
        textcoords="offset points",
        ha="right",
        va="top",
    )
    axes.set(xlabel="queries", ylabel="core time in all (h)", xlim=(1, 1e8))
    axes.set_ylim(bottom=1e-5)
    drawn.legend(loc="outside right upper", fontsize=6)
    if f"{REFERENCE_MODEL}, Keras call" not in lines:
        known = REFERENCE_MODEL in [*content["unmeasured"], *content["retrained"]]
        words = "published but not measured" if known else "not published yet"
        axes.set_title(f"{REFERENCE_MODEL} is {words}", loc="right", color="0.4")
    drawing.save(drawn, "figure-amortisation", folder)
    said = {
        "missing": "Not published yet",
        "unmeasured": "Published but not measured",
        "retrained": "Trained anew since they were measured",
        "outdated": "Trained otherwise than those compared",
    }
    left_out = "".join(f" {word}: {', '.join(content[key])}." for key, word in said.items() if content.get(key))
    write_table(
        "amortisation",
        ["Surrogate", "Its force error (%)", "Instead of", "Its force error (%)", "Break-even (queries)"],
        rows_of(content),
        "Queries from which data set, training and prediction by a surrogate cost less core time than the solver "
        f"alone. Our data set took {number(content['data_set_seconds'] / 60.0)} core minutes; the paper's lines are "
        f"its own numbers. Where the solver's query is the cheaper one, the answer is never.{left_out}",
        tables,
    )


if __name__ == "__main__":
    run_main(main)
