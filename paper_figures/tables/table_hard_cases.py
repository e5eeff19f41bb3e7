"""Table: the solver over the paper's box, far beyond it, at named extremes, and in the soak.

The table reads the measurement of `experiments.robustness.hard_case_map`, and the soak of
`experiments.robustness.random_scenes` if there is one.
"""

from collections.abc import Callable
from typing import Any

from bem.results.trajectory import is_completed
from paper_figures.style.writing import Table, caption, number, percent


def _extreme(rows: list[dict[str, Any]], key: str, worst: Callable[[list[float]], float] = max) -> float:
    values = [row[key] for row in rows if row[key] is not None]
    return float(worst(values)) if values else float("nan")


def _counted(rows: list[dict[str, Any]], key: str) -> str:
    if len(rows) == 1:
        return rows[0][key]
    return f"{sum(is_completed(row[key]) for row in rows)} of {len(rows)} completed"


def _coarse(rows: list[dict[str, Any]], accuracy: str) -> str:
    if len(rows) > 1 or "coarse" not in rows[0]:
        return "-"
    run = rows[0]["coarse"][accuracy]
    return percent(run["change"]) if is_completed(run["status"]) else run["status"]


COLUMNS: dict[str, Callable[[list[dict[str, Any]]], str]] = {
    "Status": lambda rows: _counted(rows, "status"),
    "Status, refined": lambda rows: _counted(rows, "refined_status"),
    "Jumps": lambda rows: number(_extreme(rows, "jumps")),
    "Change of pull-off force (%)": lambda rows: percent(_extreme(rows, "change")),
    "Change, draft (%)": lambda rows: _coarse(rows, "draft"),
    "Change, 0.05 (%)": lambda rows: _coarse(rows, "0.05"),
    "Change of work (%)": lambda rows: percent(_extreme(rows, "work_change")),
    "Work over turnover": lambda rows: number(_extreme(rows, "energy", min), 2),
    "End over pull-off force": lambda rows: number(_extreme(rows, "end_over_pull_off"), 2),
    "Steps": lambda rows: number(_extreme(rows, "steps"), 5),
    "Time (s)": lambda rows: number(_extreme(rows, "seconds"), 2),
}
"""Column heads, and functions that write the cell of one case, or of the worst of several."""
HEADER = ["Case", *COLUMNS]


def row_of(name: str, rows: list[dict[str, Any]]) -> list[str]:
    """One row of the table."""
    return [name, *(cell(rows) for cell in COLUMNS.values())]


def soak_rows(soak: dict[str, Any]) -> list[list[str]]:
    """Rows of the soak; the columns of a refinement stay empty."""
    rows = []
    for where, label in (("inside", "inside the box"), ("beyond", "beyond the box"), ("stiff", "of stiff contacts")):
        if where not in soak:
            continue
        group = soak[where]
        growth = group["memory_growth"]
        memory = "not measured" if growth is None else f"{percent(growth)} %"
        spikes = f"{group['spikes']} with a lone spike"
        if group["spikes"]:
            spikes += f" ({number(group['largest_spike_share'], 1)} of the range of the force at most)"
        name = (
            f"soak {label}: {group['raised']} exceptions, {group['silent']} silent non-finite, "
            f"{spikes}, memory growth {memory}"
        )
        completed = sum(times for status, times in group["statuses"].items() if is_completed(status))
        status = f"{completed} of {group['protocols']} completed"
        rows.append([name, status, *["-"] * (len(HEADER) - 3), number(group["slowest_seconds"], 2)])
    return rows


def compose(hard_case_map: Any, soak: Any = None) -> Table:
    """Write the worst of the random protocols, the extremes, and the soak."""
    cases = hard_case_map
    groups = {where: [row for row in cases["map"] if row["where"] == where] for where in ("inside", "beyond")}
    rows = [row_of(f"{where} the box, worst of {len(group)}", group) for where, group in groups.items() if group]
    rows += [row_of(row["name"], [row]) for row in cases["extremes"]]
    soaked = " `make measure-soak` has not been run."
    if soak is not None:
        rows += soak_rows(soak)
        soaked = f" The soak ran at {soak['accuracy']} accuracy on {soak['host']}; its time is that of the slowest."
    return Table(
        HEADER,
        rows,
        caption("hard-cases", soaked=soaked, **{name: cases[name] for name in ("accuracy", "refinement", "host")}),
    )
