"""Table: the solver at named extremes, and random protocols over the paper's box and far beyond it in the soak.

The table reads the measurement of `experiments.robustness.hard_case_map`, and the soak of
`experiments.robustness.random_scenes` if there is one.
"""

from collections.abc import Callable
from typing import Any

from bem.trajectory import is_completed
from paper_figures.style.writing import Table, caption, number, percent


def _coarse(row: dict[str, Any], accuracy: str) -> str:
    found = row["coarse"][accuracy]
    return percent(found["change"]) if is_completed(found["status"]) else found["status"]


def _known(value: float | None) -> float:
    return float("nan") if value is None else value


COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Status": lambda row: row["status"],
    "Status, refined": lambda row: row["refined_status"],
    "Jumps": lambda row: str(row["jumps"]),
    "Change of pull-off force (%)": lambda row: percent(_known(row["change"])),
    "Change, draft (%)": lambda row: _coarse(row, "draft"),
    "Change, 0.05 (%)": lambda row: _coarse(row, "0.05"),
    "Change of work (%)": lambda row: percent(_known(row["work_change"])),
    "Work over turnover": lambda row: number(_known(row["energy"]), 2),
    "End over pull-off force": lambda row: number(_known(row["end_over_pull_off"]), 2),
    "Steps": lambda row: str(row["steps"]),
    "Time (s)": lambda row: number(row["seconds"], 2),
}
"""Column heads, and functions that write the cell of one case."""
HEADER = ["Case", *COLUMNS]


def soak_rows(soak: dict[str, Any]) -> list[list[str]]:
    """Rows of the soak; the columns of a refinement stay empty."""
    rows = []
    for where, words in (("inside", "inside the box"), ("beyond", "beyond the box"), ("stiff", "of stiff contacts")):
        if where not in soak:
            continue
        found = soak[where]
        growth = found["memory_growth"]
        memory = "not measured" if growth is None else f"{percent(growth)} %"
        spikes = f"{found['spikes']} with a lone spike"
        if found["spikes"]:
            spikes += f" ({number(found['largest_spike_share'], 1)} of the range of the force at most)"
        name = (
            f"soak {words}: {found['raised']} exceptions, {found['silent']} silent non-finite, "
            f"{spikes}, memory growth {memory}"
        )
        completed = sum(times for status, times in found["statuses"].items() if is_completed(status))
        status = f"{completed} of {found['protocols']} completed"
        rows.append([name, status, *["-"] * (len(HEADER) - 3), number(found["slowest_seconds"], 2)])
    return rows


def compose(hard_case_map: Any, soak: Any = None) -> Table:
    """Write the extremes, and the soak."""
    content = hard_case_map
    rows = [[row["name"], *(cell(row) for cell in COLUMNS.values())] for row in content["extremes"]]
    soaked = " `make measure-soak` has not been run."
    if soak is not None:
        rows += soak_rows(soak)
        soaked = f" The soak ran at {soak['accuracy']} accuracy on {soak['host']}; its time is that of the slowest."
    return Table(
        HEADER,
        rows,
        caption("hard-cases", soaked=soaked, **{name: content[name] for name in ("accuracy", "refinement", "host")}),
    )
