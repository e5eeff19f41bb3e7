"""Table: the twelve canonical protocols, with the seconds of solver and surrogate, here and in the paper."""

from collections.abc import Callable
from typing import Any

from paper_figures.style import models_style
from paper_figures.style.writing import Table, caption, number
from paper_figures.tables.table_protocols_dataset import QUANTITIES

COLUMNS: dict[str, Callable[[dict[str, Any]], str]] = {
    "Sample": lambda regime: f"({regime['sample']})",
    **{head: lambda regime, name=name: number(regime["protocol"][name]) for name, head in QUANTITIES.items()},
    "BEM, paper (s)": lambda regime: number(regime["paper_seconds"]["solver"], 4),
    "BEM, here (s)": lambda regime: number(regime["seconds"]["solver"], 2),
    "M1-concat, paper (s)": lambda regime: number(regime["paper_seconds"]["surrogate"], 2),
    "Keras call (s)": lambda regime: number(regime["seconds"]["keras_call"], 2),
    "predictor (s)": lambda regime: number(regime["seconds"]["predictor"], 2),
    "predictor in a batch (s)": lambda regime: number(regime["seconds"]["predictor_batch"], 2),
}
ERRORS = {"pull_off_force": "pull-off error", "hysteresis": "hysteresis error"}
"""Column heads, and functions that write the cell of one protocol."""


def compose(canonical_regimes: Any) -> Table:
    """Write the table."""
    note = caption("protocols-canonical", config=canonical_regimes["config"], times=canonical_regimes["times"])
    regimes = canonical_regimes["regimes"]
    shown = [(recipe, error) for recipe in models_style.recipes(regimes[0]["predicted"]) for error in ERRORS]
    rows = [
        [cell(regime) for cell in COLUMNS.values()]
        + [number(regime["predicted"][recipe]["errors_percent"][error], 2) for recipe, error in shown]
        for regime in regimes
    ]
    words = {"paper": "paper's recipe", "swift": "swift"}
    heads = [f"{ERRORS[error]}, {words[recipe]} (%)" for recipe, error in shown]
    return Table([*COLUMNS, *heads], rows, note)
