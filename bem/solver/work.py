"""The work of a solution, counted by every kernel in one integer array.

Each constant is the position of one count in that array.
"""

import numpy as np

from bem._numerics.jit import kernel

COUNTS = (
    "iterations",
    "factorisations",
    "unknowns",
    "steps",
    "rejections",
    "fold_solves",
    "remeshings",
    "nodes",
    "unstable",
)
"""What is counted, in the order of the array. Unknowns are summed over iterations, nodes over steps."""
ITERATIONS, FACTORISATIONS, UNKNOWNS, STEPS, REJECTIONS, FOLD_SOLVES, REMESHINGS, NODES, UNSTABLE = range(len(COUNTS))


@kernel
def new_work() -> np.ndarray:
    """No work yet; int64, one entry for each of `COUNTS`."""
    return np.zeros(len(COUNTS), dtype=np.int64)


def work_by_name(work: np.ndarray) -> dict[str, int]:
    """The counts as a dictionary with the names of `COUNTS`."""
    return {name: int(count) for name, count in zip(COUNTS, work, strict=True)}
