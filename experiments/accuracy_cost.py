"""What accuracy costs in time: every tool of this repository on the same held-out protocols, on one core.

Tools: the solver at nine accuracies, the paper's discretisation (`bem.baseline`) at four resolutions, every published
surrogate by plain Keras call, by ONNX Runtime one at a time and in a batch, and closed forms. Errors are against a
solution refined beyond `reference`: of the pull-off force relative to itself, of the force as sum |dP| / sum |P| over
the measurement steps. Surrogates and closed forms know the measurement steps only; the row "measurement steps"
is what those alone cost. The baseline is slow, so that it gets the first `baseline_count` of the protocols.

Seconds are per trajectory; each is the median of `repeats` runs, and `run_totals` are the sums of the runs.

Usage: `python -m experiments.accuracy_cost [--count N] [--baseline-count N] [--repeats N] [--out FILE]`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from joblib import Parallel, delayed
from rich.progress import track

from bem import Trajectory
from bem.accuracy import NAMED_TARGETS
from bem.baseline import simulate_paper_method
from bem.materials import StandardLinearSolid
from bem.measurement import measurement_times
from bem.protocol import LoadingProtocol
from bem.reference_solutions import hereditary_hertz, hertz, jkr
from bem.scene import Scene
from experiments.measuring import MEASUREMENTS, plain, spread
from experiments.solver_sample import MODULUS_RATIO, TRUTH_TARGET, Case, measured, relative_errors
from experiments.studies import DATASET, MODELS, write_result
from experiments.surrogate_cost import surrogate_tools

OUT = MEASUREMENTS / "accuracy_cost.json"
TRUTHS = Path("results/accuracy_cost")
TARGETS = (5e-2, 1.7e-2, 8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.5e-4)
RESOLUTIONS = (50, 100, 200, 400)
FIRST_UNLOADING = 69  # the peak, last point of the dwell
NAMES = {target: name for name, target in NAMED_TARGETS.items()}


def held_out(count: int, dataset: Path) -> list[Case]:
    """The first protocols of the data set's test part."""
    from surrogate.dataset import TrajectoryDataset

    data = TrajectoryDataset.load(dataset)
    chosen = data.split(0).test[:count]
    columns = {name: values[chosen] for name, values in data.protocols.items()}
    cases = []
    for i in range(len(chosen)):
        quantities = {name: float(values[i]) for name, values in columns.items()}
        scene = Scene(quantities.pop("tabor"), StandardLinearSolid(MODULUS_RATIO))
        cases.append(Case(scene, LoadingProtocol(**quantities)))
    return cases


def refined(cases: list[Case], jobs: int) -> np.ndarray:
    """Refined solutions (count, 123) as `solver_sample.measured`; kept, since they take a second each."""
    path = TRUTHS / f"truth-{len(cases)}-{TRUTH_TARGET:g}.npy"
    if path.is_file():
        return np.load(path)
    rows = Parallel(n_jobs=jobs, return_as="generator")(delayed(measured)(case, TRUTH_TARGET) for case in cases)
    table = np.array(list(track(rows, "refined solutions", total=len(cases))))
    path.parent.mkdir(parents=True, exist_ok=True)
    np.save(path, table)
    return table


def numbers(case: Case, trajectory: Trajectory) -> np.ndarray:
    """Pull-off force, hysteresis, seconds and force at the measurement steps (123,)."""
    if not trajectory.completed:
        return np.full(123, np.nan)
    scalars = [trajectory.pull_off_force, trajectory.hysteresis, trajectory.stats.seconds]
    return np.concatenate([scalars, case.force_history(trajectory)])


def simulated(cases: list[Case], solve: Callable[[Case], Trajectory], repeats: int, label: str) -> list[np.ndarray]:
    """Tables (count, 123) of each repeat, after one run that is not counted."""
    solve(cases[0])
    return [np.array([numbers(case, solve(case)) for case in track(cases, label)]) for _ in range(repeats)]


def report(kind: str, setting: str, tables: list[np.ndarray], exact: np.ndarray, **more: Any) -> dict[str, Any]:
    """One tool: errors, failures, seconds."""
    seconds = np.array([table[:, 2] for table in tables])
    found = relative_errors(tables[0], exact[: len(tables[0])])
    known = np.isfinite(tables[0][:, 3])
    return {
        "kind": kind,
        "setting": setting,
        "protocols": len(tables[0]),
        "failures": int(np.sum(~known)),
        "seconds": spread(np.median(seconds, axis=0)),
        "run_totals": np.nansum(seconds, axis=1).tolist(),
        "errors": {name: spread(values) for name, values in found.items()},
        **more,
    }


def from_steps(force: np.ndarray, indentations: np.ndarray, seconds: np.ndarray | float) -> np.ndarray:
    """A table (count, 123) from forces and indentations (count, 120) at the measurement steps alone."""
    pull_off = force[:, FIRST_UNLOADING:].max(axis=1)
    loop = np.abs(np.trapezoid(force, indentations, axis=1))
    return np.column_stack([pull_off, loop, np.broadcast_to(seconds, pull_off.shape), force])


def closed_forms(cases: list[Case], exact: np.ndarray, repeats: int) -> list[dict[str, Any]]:
    """Rubbery Hertz, Lee and Radok (nothing after the peak), JKR's pull-off force."""
    import time

    def hertzian(case: Case, times: np.ndarray) -> np.ndarray:
        depth = case.protocol.history(case.scene.tabor).indentation_at(times)
        return hertz.force_from_indentation(depth, case.scene.tabor)

    def hereditary(case: Case, times: np.ndarray) -> np.ndarray:
        history = case.protocol.history(case.scene.tabor)
        force = hereditary_hertz.force(case.scene, history, times)
        return np.where(history.indentation_at(times) > 0.0, force, 0.0)

    def adhesive(case: Case, times: np.ndarray) -> np.ndarray:
        depth = case.protocol.history(case.scene.tabor).indentation_at(times)
        return np.nan_to_num(jkr.force_from_indentation(depth, case.scene.tabor), nan=0.0)

    rows = []
    for setting, formula in (("Hertz, rubbery", hertzian), ("Lee and Radok", hereditary), ("JKR, rubbery", adhesive)):
        tables = []
        formula(cases[0], np.zeros(1))
        for _ in range(repeats):
            table = []
            for case in cases:
                times = measurement_times(case.protocol, case.scene.tabor)
                started = time.perf_counter()
                force = formula(case, times)
                depths = case.protocol.history(case.scene.tabor).indentation_at(times)
                table.append(from_steps(force[None], depths[None], time.perf_counter() - started)[0])
            tables.append(np.array(table))
        rows.append(report("closed form", setting, tables, exact))
    return rows


def main(
    count: Annotated[int, typer.Option(help="Held-out protocols.")] = 200,
    baseline_count: Annotated[int, typer.Option(help="How many of them by the paper's discretisation.")] = 40,
    repeats: Annotated[int, typer.Option(help="Runs of the solver, the closed forms and the surrogates.")] = 5,
    finest: Annotated[int, typer.Option(help="Finest resolution of the paper's discretisation.")] = RESOLUTIONS[-1],
    jobs: Annotated[int, typer.Option(help="Processes for the refined solutions, which are not timed.")] = 2,
    dataset: Annotated[Path, typer.Option(help="Data set file.")] = DATASET,
    models: Annotated[Path, typer.Option(help="Where trained models are.")] = MODELS,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Measure all tools and write the result."""
    cases = held_out(count, dataset)
    exact = refined(cases, jobs)
    depths = np.array(
        [c.protocol.history(c.scene.tabor).indentation_at(measurement_times(c.protocol, c.scene.tabor)) for c in cases]
    )
    tools = [report("measurement steps", "", [from_steps(exact[:, 3:], depths, np.nan)], exact)]
    for target in TARGETS:
        tables = simulated(cases, lambda case, at=target: case.run(at), repeats, f"solver at {target:g}")
        tools.append(report("solver", NAMES.get(target, f"{target:g}"), tables, exact, target=target))
    few = cases[:baseline_count]
    for size in (size for size in RESOLUTIONS if size <= finest):
        tables = simulated(
            few,
            lambda case, n=size: simulate_paper_method(case.scene, case.protocol, nodes=n, steps=n),
            1,
            f"paper's discretisation, {size} nodes",
        )
        tools.append(report("paper's discretisation", f"{size} nodes, {size} steps", tables, exact, resolution=size))
    tools += closed_forms(cases, exact, repeats)
    measured_tools, missing = surrogate_tools(cases, models, repeats)
    for tool in measured_tools:
        force = tool.pop("force")
        tables = [from_steps(force, depths, seconds) for seconds in tool.pop("seconds")]
        tools.append(report("surrogate", tool.pop("setting"), tables, exact, **tool))
    content = {
        "protocols": count,
        "baseline_protocols": baseline_count,
        "repeats": repeats,
        "truth_target": TRUTH_TARGET,
        "tools": tools,
        "missing": missing,
    }
    command = f"accuracy_cost --count {count} --baseline-count {baseline_count} --repeats {repeats}"
    write_result(out, command, plain(content))
    print(f"missing: {', '.join(missing) or 'nothing'}")


if __name__ == "__main__":
    typer.run(main)
