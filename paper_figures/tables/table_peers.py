"""Table: seconds and errors on the same elastic sphere, for the solver and other software.

`make docs-numbers` also writes the table into docs/cost.md. It reads the measurement of
`experiments.measurements.peers`.
"""

from typing import Any

from paper_figures.style.writing import Table, caption, number

PROBLEMS = {"tabor 1": "Tension, Tabor 1", "tabor 3": "Tension, Tabor 3", "Hertz": "Compression, no adhesion"}
TOOLS = ("closed form", "solver", "paper's discretisation", "Adhesion", "tamaas")


def compose(peers: Any) -> Table:
    """Write the table, with a row for each tool and setting, coarse before fine: error in percent, and time."""
    cells: dict[tuple[str, str], dict[str, str]] = {}
    for run in peers["runs"]:
        cell = f"{number(100.0 * run['error'], 2)} % in {number(run['seconds'], 2)} s"
        cells.setdefault((run["tool"], run["setting"]), {})[run["problem"]] = cell
    sizes = {key: int(size) if (size := key[1].split()[0]).isdigit() else 0 for key in cells}
    ordered = sorted(cells, key=lambda key: (TOOLS.index(key[0]), sizes[key]))
    packages = ", ".join(f"{name} {version}" for name, version in peers["packages"].items())
    return Table(
        ["Tool", "Setting", *PROBLEMS.values()],
        [[*key, *(cells[key].get(problem, "-") for problem in PROBLEMS)] for key in ordered],
        caption("peers", start=number(peers["start"]), packages=packages, host=peers["host"]),
    )


def page_text(peers: Any) -> str:
    """The table for docs/cost.md."""
    return compose(peers).page()
