"""The work of a solution, counted by every kernel in one integer array.

Each constant is the position of one count in that array. Multiply-adds measure the whole: they are estimated from the
sizes of the systems, as processor time is, but do not depend on the processor. Loops without another bound look at
`is_spent` and end where the budget does.
"""

import numpy as np

from bem._support.jit import kernel

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
    "multiply_adds",
    "most_work",
)
"""What is counted, in the order of the array. Unknowns are summed over iterations, nodes over steps."""
ITERATIONS, FACTORISATIONS, UNKNOWNS, STEPS, REJECTIONS, FOLD_SOLVES, REMESHINGS, NODES, UNSTABLE = range(9)
MULTIPLY_ADDS, MOST = range(9, len(COUNTS))
MOST_WORK, MOST_OF_A_DRAFT = 3e11, 3e10
"""Budgets of one simulation, in multiply-adds: about a minute, and a few seconds, of one core."""


@kernel
def new_work(most: float = np.inf) -> np.ndarray:
    """No work yet, and a budget in multiply-adds; int64, one entry for each of `COUNTS`."""
    work = np.zeros(len(COUNTS), dtype=np.int64)
    work[MOST] = np.int64(min(most, 9e18))
    return work


@kernel
def count_factorisation(work: np.ndarray, order: int) -> None:
    """Count a factorisation of that many unknowns, and what else an iteration with it costs."""
    work[FACTORISATIONS] += 1
    work[MULTIPLY_ADDS] += order * order * (order // 3 + 4)


@kernel
def count_iteration(work: np.ndarray, nodes: int, order: int) -> None:
    """Count an iteration over that many nodes, in a linear system of `order` unknowns."""
    work[ITERATIONS] += 1
    work[UNKNOWNS] += order
    work[MULTIPLY_ADDS] += nodes * (nodes + 500) + order * order


@kernel
def is_spent(work: np.ndarray) -> bool:
    """Whether the budget is used up."""
    return work[MULTIPLY_ADDS] >= work[MOST]


def work_by_name(work: np.ndarray) -> dict[str, int]:
    """The counts as a dictionary with the names of `COUNTS`."""
    return {name: int(count) for name, count in zip(COUNTS, work, strict=True)}
