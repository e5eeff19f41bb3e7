"""The solver on a fixed scene with one control of its accuracy varied, for `experiments.cost.cost_growth`.

Nodes follow from the spacing at the contact edge, steps from the difference of prediction and solution allowed in one
of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from bem import LoadingProtocol, Scene, StandardLinearSolid
from bem.accuracy import resolve_accuracy
from bem.solver.problem import discretise  # `simulate` offers targets only, not single controls
from bem.solver.simulation import MOST_STEPS
from bem.solver.time_stepping import COMPLETED, march
from bem.solver.work import work_by_name
from experiments.timing import CLOCK

SCENE = Scene(tabor=3.2, material=StandardLinearSolid(0.1))
PROTOCOL = LoadingProtocol(peak_indentation=15.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
EDGE_FACTORS = np.geomspace(2.0, 0.1, 9)
PREDICTION_FACTORS = np.geomspace(4.0, 0.01, 9)  # below, the residual of an equilibrium is what steps would follow


def measure(repetitions: int, **factors: float) -> dict[str, Any]:
    """Nodes, steps, iterations and seconds of each run, with some controls of accuracy standard times a factor."""
    usual = resolve_accuracy("standard").controls()
    controls = usual._replace(**{name: factor * getattr(usual, name) for name, factor in factors.items()})
    history = PROTOCOL.history(SCENE.tabor)
    seconds = []
    for _ in range(repetitions):
        with threadpool_limits(limits=1, user_api="blas"), CLOCK:
            problem, mesh = discretise(SCENE, PROTOCOL.peak_indentation, controls, None)
            result = march(problem, mesh, np.array(history.times), np.array(history.indentations), False, MOST_STEPS)
        seconds.append(CLOCK.seconds)
    if result.outcome != COMPLETED:
        raise RuntimeError(f"the simulation must complete; received outcome {result.outcome} with {factors}")
    found = {name: float(count) for name, count in work_by_name(result.work).items()}
    return {
        **factors,
        "nodes": found["nodes"] / found["steps"],
        "grid_nodes": float(problem.grid.size),
        "steps": found["steps"],
        "iterations": found["iterations"],
        "factorisations": found["factorisations"],
        "seconds": seconds,
    }
