"""Table: seconds and errors on the same elastic sphere, for the solver and other software.

`tools/fill.py` also writes the table into docs/cost.md. The table reads the measurement of `experiments.peers.peers`.
"""

from typing import Any

from paper_figures.style.writing import Table, number

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


def caption_of(content: dict[str, Any]) -> str:
    """Caption: what is shown, and where it was measured."""
    packages = ", ".join(f"{name} {version}" for name, version in content["packages"].items())
    return (
        f"Largest tension of an elastic sphere unloaded from an indentation of {number(content['start'])}, and its "
        "compression there without adhesion: error and processor seconds. Solver and paper's discretisation: the whole "
        "history; Adhesion: from that indentation to the largest tension; tamaas: one state. "
        f"{packages}, one core of {content['host']}."
    )


def page_text(content: dict[str, Any]) -> str:
    """The table as Markdown, for docs/cost.md."""
    table = "\n".join("| " + " | ".join(row) + " |" for row in (HEADER, ["---"] * len(HEADER), *rows_of(content)))
    return f"{table}\n\n{caption_of(content)}"


def compose(peers: Any) -> Table:
    """Write the table."""
    return Table(HEADER, rows_of(peers), caption_of(peers))
