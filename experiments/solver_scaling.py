"""How the cost of the solver grows with nodes and with steps.

Nodes: only the spacing at the contact edge is varied, on a fixed scene; reported are seconds per step against the mean
number of nodes. Steps: only the difference of prediction and solution allowed in one step is varied; reported are
seconds against steps. Both are medians over repetitions of wall seconds, the clock of every other measurement.

Usage: `python -m experiments.solver_scaling [--repetitions N] [--out FILE]`.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from threadpoolctl import threadpool_limits

from bem import LoadingProtocol, Scene, StandardLinearSolid
from bem.accuracy import resolve_accuracy
from bem.command import run_main
from bem.contact import COUNTS
from bem.march import COMPLETED, march
from bem.provenance import provenance
from bem.simulate import MOST_STEPS
from bem.simulate import _discretise as discretise  # `simulate` offers targets only, not single controls
from experiments.measuring import exponent, progress

OUT = Path("results/solver/scaling.json")
SCENE = Scene(tabor=3.2, material=StandardLinearSolid(0.1))
PROTOCOL = LoadingProtocol(peak_indentation=15.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
EDGE_FACTORS = np.geomspace(2.0, 0.1, 9)
PREDICTION_FACTORS = np.geomspace(4.0, 0.01, 9)  # below, the residual of an equilibrium is what steps would follow


def measure(repetitions: int, **factors: float) -> dict[str, Any]:
    """Nodes, steps, iterations and wall seconds with some controls of accuracy standard multiplied by factors."""
    usual = resolve_accuracy("standard").controls()
    controls = usual._replace(**{name: factor * getattr(usual, name) for name, factor in factors.items()})
    history = PROTOCOL.history(SCENE.tabor)
    seconds = []
    for _ in range(repetitions):
        started = time.perf_counter()
        problem, mesh = discretise(SCENE, PROTOCOL.peak_indentation, controls, None)
        with threadpool_limits(limits=1, user_api="blas"):
            *_, counts, _, outcome = march(
                problem, mesh, np.array(history.times), np.array(history.indentations), False, MOST_STEPS
            )
        seconds.append(time.perf_counter() - started)
    if outcome != COMPLETED:
        raise RuntimeError(f"the simulation must complete; received outcome {outcome} with {factors}")
    found = {name: float(value) for name, value in zip(COUNTS, counts, strict=True)}
    return {
        **factors,
        "nodes": found["nodes"] / found["steps"],
        "grid_nodes": float(problem.grid.size),
        "steps": found["steps"],
        "iterations": found["iterations"],
        "factorisations": found["factorisations"],
        "seconds": float(np.median(seconds)),
        "runs": seconds,
    }


def main(
    repetitions: Annotated[int, typer.Option(help="Simulations of each setting; the median counts.")] = 5,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Measure both and write them with the fitted exponents."""
    measure(1)
    nodes: list[dict[str, Any]] = [
        measure(repetitions, edge_spacing=float(factor)) for factor in progress(EDGE_FACTORS, "nodes")
    ]
    steps: list[dict[str, Any]] = [
        measure(repetitions, prediction=float(factor)) for factor in progress(PREDICTION_FACTORS, "steps")
    ]
    content = {
        "nodes": nodes,
        "steps": steps,
        "exponent_in_nodes": exponent([p["nodes"] for p in nodes], [p["seconds"] / p["steps"] for p in nodes])[0],
        "exponent_in_steps": exponent([p["steps"] for p in steps], [p["seconds"] for p in steps])[0],
        **provenance(f"python -m experiments.solver_scaling --repetitions {repetitions}"),
    }
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    for name in ("nodes", "steps"):
        print(f"cost grows as the power {content[f'exponent_in_{name}']:.2f} of {name}")


if __name__ == "__main__":
    run_main(main)
