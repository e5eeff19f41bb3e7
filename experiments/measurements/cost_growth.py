"""How the cost grows with the size of the problem: nodes, steps, Tabor parameter, peak indentation, unloading rate.

Nodes and steps of the solver are varied on a fixed scene by one control of its accuracy each: the nodes by the spacing
at the contact edge, the steps by the difference allowed between prediction and solution in one step. Nodes and steps of
the paper's discretisation are its own arguments. The three physical quantities are varied around one protocol, for the
solver at standard accuracy, and for the paper's discretisation with a spacing and a time step that resolve what the
solver resolves, so that its nodes and steps grow as its accuracy demands. The data set gives exponents over the whole
box, by least squares of log seconds over the logarithms of all five quantities.

Times are processor seconds, medians of at least three runs: of one step where nodes are varied, of the whole call
elsewhere. The iterations per step are fitted too; they are N_iter in the paper's cost O(N_s^2 N_t N_iter). The paper's
method factorises in every iteration, which costs N_s^3 for large systems, and sums over the history, which costs N_t^2
for long histories. The solver remembers by recursion and factorises seldom, and has neither cost.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
import typer

from bem import LoadingProtocol, Scene, StandardLinearSolid, Trajectory, simulate
from bem.accuracy import Accuracy, resolve_accuracy
from bem.dataset.designs import PAPER_RANGES
from bem.dataset.file import load_dataset
from bem.discretisation.cohesive_zone import edge_width, largest_contact_radius
from bem.solver.paper_method import FAR_GAP, RESOLVED, simulate_paper_method
from experiments.measurements.cases import Case
from experiments.measurements.harness import progress, timed
from experiments.measurements.statistics import exponent, spread

SCENE = Scene(tabor=3.2, material=StandardLinearSolid(0.1))
PROTOCOL = LoadingProtocol(peak_indentation=15.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
CONTROLS = {
    "nodes": ("edge_spacing", np.geomspace(2.0, 0.1, 9)),
    "steps": ("prediction", np.geomspace(4.0, 0.01, 9)),
}
"""Control of the accuracy that is varied, and its factors. Below these, the residual would decide the steps."""
CENTRE = dict(zip(PAPER_RANGES, (1.0, 10.0, 10.0, 0.1, 10.0), strict=True))
RANGES = {
    "tabor": np.geomspace(0.2, 3.2, 7),
    "peak_indentation": np.geomspace(2.0, 100.0, 7),
    "unloading_rate": np.geomspace(0.1, 1000.0, 9),
}
BASELINE_NODES = (50, 100, 200, 400)
BASELINE_STEPS = (50, 100, 200, 400, 800)
LEAST_REPEATS = 3
LARGEST_BASELINE = (500, 4000)  # nodes, steps of one segment


def point(run: Callable[[], Trajectory], repeats: int) -> dict[str, Any]:
    """Cost of a simulation; the first run, which counts too, gives its sizes."""
    runs: list[Trajectory] = []
    seconds = timed(lambda: runs.append(run()), repeats, first=False)
    stats = runs[0].stats
    return {
        "seconds": spread(seconds),
        **{name: getattr(stats, name) for name in ("nodes", "grid_nodes", "steps", "iterations", "factorisations")},
        "iterations_per_step": stats.iterations / stats.steps,
        "completed": runs[0].completed,
    }


def controlled(repeats: int, **factors: float) -> dict[str, Any]:
    """Cost of the fixed scene, with some controls of standard accuracy multiplied by factors.

    Raises:
        RuntimeError: The simulation did not complete.
    """
    usual = resolve_accuracy("standard").controls()
    controls = usual._replace(**{name: factor * getattr(usual, name) for name, factor in factors.items()})
    # `simulate` accepts a target error, not single controls.
    with patch.object(Accuracy, "controls", return_value=controls):
        found = point(lambda: simulate(SCENE, PROTOCOL), repeats)
    if not found.pop("completed"):
        raise RuntimeError(f"the simulation must complete; it did not with {factors}")
    return {**factors, **found}


def solver_seconds(quantities: dict[str, float], repeats: int) -> dict[str, Any]:
    """Cost of the solver at standard accuracy."""
    return point(lambda: Case.of(quantities).run("standard"), repeats)


def resolution(quantities: dict[str, float]) -> tuple[int, int]:
    """Nodes and steps of equal size that resolve the contact edge and the path as the solver does."""
    tabor, depth = quantities["tabor"], quantities["peak_indentation"]
    radius = largest_contact_radius(depth, tabor)
    spacing = resolve_accuracy("standard").line_controls().edge_spacing * edge_width(radius, tabor)
    nodes = math.ceil(math.sqrt(radius**2 + 2.0 * FAR_GAP / tabor) / spacing)
    steps = math.ceil((depth + np.pi ** (2.0 / 3.0) * tabor) / 0.1)
    return min(nodes, LARGEST_BASELINE[0]), min(max(steps, int(RESOLVED / 0.1)), LARGEST_BASELINE[1])


def baseline_seconds(quantities: dict[str, float], nodes: int, steps: int, repeats: int) -> dict[str, Any]:
    """Cost of the paper's discretisation at one resolution."""
    case, size = Case.of(quantities), {"nodes": nodes, "steps": steps}
    return point(lambda: simulate_paper_method(case.scene, case.protocol, **size, most_work=1e14), repeats)


def a_step(point: dict[str, Any]) -> dict[str, Any]:
    """The point with its seconds divided by its steps."""
    seconds = {key: value / (1.0 if key == "count" else point["steps"]) for key, value in point["seconds"].items()}
    return {**point, "seconds": seconds}


def fitted(points: list[dict[str, Any]], name: str) -> dict[str, Any]:
    """The points with exponents, in one quantity, of median seconds and iterations per step, and standard errors."""
    places = [point[name] for point in points]
    slope, error = exponent(places, [point["seconds"]["median"] for point in points])
    iterations, doubt = exponent(places, [point["iterations_per_step"] for point in points])
    found = {"exponent": slope, "error": error, "iterations": iterations, "iterations_error": doubt}
    return {"points": points, **found}


def over_the_data_set(path: Path) -> dict[str, Any]:
    """Exponents of the solver's seconds in the five quantities, fitted together over the data set."""
    dataset = load_dataset(path)
    rows = dataset.completed
    columns = [np.log(dataset.protocols[name][rows]) for name in PAPER_RANGES]
    matrix = np.column_stack([*columns, np.ones(len(rows))])
    wanted = np.log(dataset.scalars["solver_seconds"][rows])
    found, *_ = np.linalg.lstsq(matrix, wanted, rcond=None)
    explained = 1.0 - np.var(wanted - matrix @ found) / np.var(wanted)
    exponents = dict(zip(PAPER_RANGES, found[:-1].tolist(), strict=True))
    return {"exponents": exponents, "explained": float(explained), "trajectories": len(rows)}


def study(
    dataset: Path, *, repeats: Annotated[int, typer.Option(min=LEAST_REPEATS, help="Runs of each point.")] = 7
) -> dict[str, Any]:
    """Measure all growth curves; medians of the runs count."""
    over_data_set = over_the_data_set(dataset)
    controlled(1)
    solver_seconds(CENTRE, 1)
    baseline_seconds(CENTRE, 20, 20, 1)

    def curve(name: str, values: Iterable[Any], point: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        return fitted([point(value) for value in progress(list(values), name)], name)

    def resolved(quantities: dict[str, float]) -> dict[str, Any]:
        return quantities | baseline_seconds(quantities, *resolution(quantities), LEAST_REPEATS)

    solver = {
        name: curve(name, factors.tolist(), lambda factor, control=control: controlled(repeats, **{control: factor}))
        for name, (control, factors) in CONTROLS.items()
    }
    solver["nodes"] = fitted([a_step(point) for point in solver["nodes"]["points"]], "nodes")
    baseline = {
        "nodes": curve(
            "nodes", BASELINE_NODES, lambda nodes: a_step(baseline_seconds(CENTRE, nodes, 100, LEAST_REPEATS))
        ),
        "steps": curve("steps", BASELINE_STEPS, lambda steps: baseline_seconds(CENTRE, 50, steps, LEAST_REPEATS)),
    }
    for name, values in RANGES.items():
        places = [CENTRE | {name: value} for value in values.tolist()]
        solver[name] = curve(name, places, lambda quantities: quantities | solver_seconds(quantities, repeats))
        baseline[name] = curve(name, places, resolved)
    return {"centre": CENTRE, "solver": solver, "baseline": baseline, "data_set": over_data_set}
