"""Table of the twelve canonical protocols: parameters, seconds of solver and surrogate, the paper's beside ours."""

from typing import Any

from paper_figures.style.writing import Table, number
from paper_figures.tables.table_protocols_dataset import QUANTITIES

HEADER = [
    "Sample",
    *QUANTITIES.values(),
    "BEM, paper (s)",
    "BEM, here (s)",
    "M1-concat, paper (s)",
    "Keras call (s)",
    "predictor (s)",
    "predictor in a batch (s)",
    "pull-off error (%)",
    "hysteresis error (%)",
]


def row(regime: dict[str, Any]) -> list[str]:
    """One protocol."""
    seconds, paper, errors = regime["seconds"], regime["paper_seconds"], regime["errors_percent"]
    return [
        f"({regime['sample']})",
        *(number(regime["protocol"][name]) for name in QUANTITIES),
        number(paper["solver"], 4),
        number(seconds["solver"], 2),
        number(paper["surrogate"], 2),
        *(number(seconds[name], 2) for name in ("keras_call", "predictor", "predictor_batch")),
        *(number(errors[name], 2) for name in ("pull_off_force", "hysteresis")),
    ]


def compose(canonical_regimes: Any) -> Table:
    """Write the table."""
    config, times = canonical_regimes["config"], canonical_regimes["times"]
    caption = (
        f"Protocols of figure 6 and what they cost: processor seconds of one thread, {times['host']}. Solver at "
        f"accuracy {config['accuracy']}; surrogate by the plain Keras call, by our predictor, and by our predictor per "
        f"trajectory of a batch of {times['config']['batch']}. Errors of {config['model']} on the measurement steps."
    )
    return Table(HEADER, [row(regime) for regime in canonical_regimes["regimes"]], caption)
