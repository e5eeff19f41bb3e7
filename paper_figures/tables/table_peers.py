"""Table: seconds and errors on the same elastic sphere, for the solver and other software.

`make docs-numbers` also writes the table into docs/cost.md. It reads the measurement of
`experiments.measurements.peers`.
"""

from typing import Any

from paper_figures.style.writing import Table, caption, number

PROBLEMS = {"tabor 1": "Tension, Tabor 1", "tabor 3": "Tension, Tabor 3", "Hertz": "Compression, no adhesion"}
HEADER = ["Tool", "Setting", *PROBLEMS.values()]


def rows_of(content: dict[str, Any]) -> list[list[str]]:
    """One row for each tool and setting: error in percent and time for each problem."""
    found: dict[tuple[str, str], dict[str, str]] = {}
    for run in content["runs"]:
        cell = f"{number(100.0 * run['error'], 2)} % in {number(run['seconds'], 2)} s"
        found.setdefault((run["tool"], run["setting"]), {})[run["problem"]] = cell
    return [
        [*key, *(cells.get(problem, "-") for problem in PROBLEMS)] for key, cells in sorted(found.items(), key=_rank)
    ]


def _rank(row: tuple[tuple[str, str], Any]) -> tuple[int, int]:
    (tool, setting), _ = row
    tools = ("closed form", "solver", "paper's discretisation", "Adhesion", "tamaas")
    size = setting.split()[0]
    return tools.index(tool), int(size) if size.isdigit() else 0


def compose(peers: Any) -> Table:
    """Write the table; its caption says what is shown, and where it was measured."""
    packages = ", ".join(f"{name} {version}" for name, version in peers["packages"].items())
    return Table(
        HEADER,
        rows_of(peers),
        caption("peers", start=number(peers["start"]), packages=packages, host=peers["host"]),
    )


def page_text(peers: Any) -> str:
    """The table for docs/cost.md."""
    return compose(peers).page()
