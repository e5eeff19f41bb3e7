"""Processor seconds of the paper's own method beside the solver, so that algorithm and machine can be told apart.

Both run here, on one thread, in turns: on the twelve protocols of the paper's timing table, and on the first held-out
protocols of the data set, whose mean stands for all of its trajectories. Each time is the least of the repetitions.
"""

from functools import partial
from typing import Any

import numpy as np

from experiments.cases import Case, held_out
from experiments.common import Dataset
from experiments.harness import progress, timed
from experiments.measurements.tools import paper_method_at, solver_at
from experiments.paper_numbers import paper_rows, stated

SIZE = 200
"""Nodes, and steps in each segment; pull-off forces are then within one percent of the solver's."""
COUNT, REPEATS = 40, 3


def study(dataset: Dataset) -> dict[str, Any]:
    """Time both methods."""
    rows = paper_rows("canonical_protocols")
    cases = [*map(Case.of, rows), *held_out(COUNT, dataset)]
    methods = {"solver": solver_at("standard"), "paper_method": paper_method_at(SIZE)}
    seconds = []
    for case in progress(cases, "protocols"):
        turns = [[timed(partial(tool, case), first=False)[0] for tool in methods.values()] for _ in range(REPEATS)]
        seconds.append(dict(zip(methods, np.min(turns, axis=0).tolist(), strict=True)))
    mean = {name: float(np.mean([row[name] for row in seconds[len(rows) :]])) for name in methods}
    theirs = 3600.0 * stated("dataset:cpu_hours") / stated("dataset:trajectories")
    return {
        "size": SIZE,
        "protocols": {str(int(row["sample"])): times for row, times in zip(rows, seconds, strict=False)},
        "data_set": {
            "protocols": COUNT,
            "mean_seconds": mean,
            "hours_by_paper_method": mean["paper_method"] * stated("dataset:trajectories") / 3600.0,
            "algorithm": mean["paper_method"] / mean["solver"],
            "machine_and_language": theirs / mean["paper_method"],
        },
    }
