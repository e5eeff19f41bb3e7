"""Table: the twelve canonical protocols, with the seconds of solver and surrogate, here and in the paper."""

from collections.abc import Callable
from typing import Any

from paper_figures.style.writing import Table, caption, number
from paper_figures.tables.table_protocols_dataset import QUANTITIES

COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Sample": lambda one: f"({one['sample']})",
    **{head: lambda one, name=name: number(one["protocol"][name]) for name, head in QUANTITIES.items()},
    "BEM, paper (s)": lambda one: number(one["paper_seconds"]["solver"], 4),
    "BEM, here (s)": lambda one: number(one["seconds"]["solver"], 2),
    "M1-concat, paper (s)": lambda one: number(one["paper_seconds"]["surrogate"], 2),
    "Keras call (s)": lambda one: number(one["seconds"]["keras_call"], 2),
    "predictor (s)": lambda one: number(one["seconds"]["predictor"], 2),
    "predictor in a batch (s)": lambda one: number(one["seconds"]["predictor_batch"], 2),
    "pull-off error (%)": lambda one: number(one["errors_percent"]["pull_off_force"], 2),
    "hysteresis error (%)": lambda one: number(one["errors_percent"]["hysteresis"], 2),
}
"""Column heads, and functions that write the cell of one protocol."""


def compose(canonical_regimes: Any) -> Table:
    """Write the table."""
    words = caption("protocols-canonical", config=canonical_regimes["config"], times=canonical_regimes["times"])
    rows = [[cell(one) for cell in COLUMNS.values()] for one in canonical_regimes["regimes"]]
    return Table(list(COLUMNS), rows, words)
