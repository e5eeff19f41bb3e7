"""What accuracy costs in time: every tool of this repository on the same held-out protocols, on one core.

The tools are the solver at nine accuracies, the paper's discretisation (`bem.solver.paper_method`) at three
resolutions, every published surrogate (by plain Keras call, by ONNX Runtime one trajectory at a time, and by ONNX
Runtime in a batch), and closed forms. Errors are measured against a solution refined beyond `reference`: those of
pull-off force and hysteresis relative to their exact values, that of the force as `timing.force_error` at the
measurement steps. Surrogates and closed forms give forces at the measurement steps only; the row "measurement steps" is
the error of the steps alone. A fine discretisation of the paper (`BASELINE`) is measured on the first protocols only,
and a closed form on those of its regime; each row states the number.

Times are processor seconds of a whole call on one thread, from the protocol to pull-off force, hysteresis and the
forces at the measurement steps: for each protocol the median of the repeats. A tool is run at least once, and again
while `BUDGET` allows.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated, Any

import numpy as np
import typer
from threadpoolctl import threadpool_limits

from bem import simulate_paper_method
from bem.accuracy import NAMED_TARGETS
from bem.solver.version import SOLVER_VERSION
from experiments.common import DATASET, MODELS
from experiments.cost.cases import Case, answered, held_out, solver_at
from experiments.cost.closed_form_tools import FORMS, depths_of
from experiments.cost.surrogate_cost import from_steps, missing, outdated, surrogate_tools
from experiments.solver import solver_processes
from experiments.timing import (
    CLOCK,
    MEASUREMENTS,
    Busy,
    DatasetFile,
    Models,
    Out,
    force_error,
    progress,
    publish,
    spread,
)

OUT = MEASUREMENTS / "accuracy_cost.json"
TARGETS = (5e-2, 1.7e-2, 8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.5e-4)
BASELINE = {50: 1.0, 100: 0.5, 200: 0.1}
"""Share of the protocols for each resolution of the paper's discretisation: nodes, and least steps of a segment."""
BUDGET = 240.0  # seconds in all runs of a tool, beyond which it is not run again
NAMES = {target: name for name, target in NAMED_TARGETS.items()}
Answers = tuple[np.ndarray, np.ndarray]


def paper_method_at(size: int) -> Callable[[Case], np.ndarray]:
    """The paper's discretisation with `size` nodes and at least `size` steps in each segment."""
    return lambda case: answered(
        case, lambda asked: simulate_paper_method(asked.scene, asked.protocol, nodes=size, steps=size)
    )


def run(cases: Sequence[Case], answer: Callable[[Case], np.ndarray], repeats: int, label: str) -> Answers:
    """Answers (count, 122) of the first run and seconds (repeats, count), after one call that is not counted."""
    answer(cases[0])
    table, runs, spent = np.empty((len(cases), 122)), [], 0.0
    while not runs or (len(runs) < repeats and spent + spent / len(runs) <= BUDGET):
        seconds = np.empty(len(cases))
        for i, case in enumerate(progress(cases, f"{label}, run {len(runs) + 1} of {repeats}")):
            with CLOCK:
                found = answer(case)
            seconds[i] = CLOCK.seconds
            if not runs:
                table[i] = found
        runs.append(seconds)
        spent += float(seconds.sum())
    return table, np.array(runs)


def report(kind: str, setting: str, answers: Answers, exact: np.ndarray, **more: Any) -> dict[str, Any]:
    """One tool: its errors, failures and times.

    Args:
        kind: Kind of tool.
        setting: The tool among those of its kind.
        answers: Answers of shape (count, 122), and seconds of shape (repeats, calls). `calls` may be less than `count`.
        exact: Exact answers, of shape (count, 122).
        **more: Further entries of the result.
    """
    table, seconds = answers
    relative = np.abs(table[:, :2] / exact[:, :2] - 1.0)
    found = {"pull_off_force": relative[:, 0], "hysteresis": relative[:, 1]}
    found["force"] = force_error(table[:, 2:], exact[:, 2:])
    each = np.median(seconds, axis=0)
    return {
        "kind": kind,
        "setting": setting,
        "protocols": len(table),
        "repeats": len(seconds),
        "failures": int(np.sum(np.all(np.isnan(table), axis=1))),
        "seconds": spread(each),
        "seconds_each": [float(f"{value:.4g}") for value in each],
        "run_totals": np.sum(seconds, axis=1).tolist(),
        "errors": {name: spread(values) for name, values in found.items()},
        **more,
    }


def closed_forms(cases: list[Case], exact: np.ndarray, repeats: int) -> list[dict[str, Any]]:
    """Every closed form on the protocols of its regime; a form without such a protocol is left out."""
    rows = []
    for form in FORMS:
        chosen = [i for i, case in enumerate(cases) if form.meant_for(case)]
        if not chosen:
            continue

        def answer(case: Case, ask: Any = form.answer) -> np.ndarray:
            pull_off, force = ask(case)
            return np.concatenate([[pull_off, np.nan], force])

        mine = run([cases[i] for i in chosen], answer, repeats, form.name)
        rows.append(report("closed form", form.name, mine, exact[chosen]))
    return rows


def main(
    count: Annotated[int, typer.Option(help="Held-out protocols.")] = 200,
    repeats: Annotated[int, typer.Option(help="Runs of each tool, where its budget of time allows.")] = 3,
    finest: Annotated[int, typer.Option(help="Finest resolution of the paper's discretisation.")] = max(BASELINE),
    jobs: Annotated[int, typer.Option(help="Processes for the refined solutions, which are not timed.")] = 2,
    dataset: DatasetFile = DATASET,
    models: Models = MODELS,
    out: Out = OUT,
    busy: Busy = False,
) -> None:
    """Measure all tools. The result is written before the surrogates are measured, and again with them."""
    cases = held_out(count, dataset)
    requests = [solver_processes.request(case.scene.tabor, case.protocol) for case in cases]
    exact = solver_processes.refined(requests, solver_processes.ROOT, SOLVER_VERSION, jobs)
    depths = np.array([depths_of(case) for case in cases])
    old = outdated(models, dataset)
    unknown = np.full((1, len(cases)), np.nan)
    tools = [report("measurement steps", "", (from_steps(exact[:, 2:], depths), unknown), exact)]

    def write(absent: list[str], complete: bool) -> None:
        content = {
            "protocols": len(cases),
            "repeats": repeats,
            "truth_target": solver_processes.EXACT_TARGET,
            "solver": SOLVER_VERSION,
            "tools": tools,
            "missing": absent,
            "outdated": old,
            "complete": complete,
        }
        publish(out, f"accuracy_cost --count {count} --repeats {repeats} --finest {finest}", content, busy=busy)

    with threadpool_limits(limits=1):
        for target in TARGETS:
            mine = run(cases, solver_at(target), repeats, f"solver, {target:g}")
            tools.append(report("solver", NAMES.get(target, f"{target:g}"), mine, exact, target=target))
        for size in (size for size in BASELINE if size <= finest):
            few = max(1, round(BASELINE[size] * len(cases)))
            label = f"{size} nodes, {size} steps"
            mine = run(cases[:few], paper_method_at(size), repeats, f"paper's discretisation, {label}")
            tools.append(report("paper's discretisation", label, mine, exact[:few], resolution=size))
        tools += closed_forms(cases, exact, repeats)
        write(missing(models), complete=False)
        measured_tools, absent = surrogate_tools(cases, models, repeats)
    for tool in measured_tools:
        answers = tool.pop("answers"), np.array(tool.pop("seconds"))
        more = {**tool, "outdated": tool["model"] in old}
        tools.append(report("surrogate", more.pop("setting"), answers, exact, **more))
    write(absent, complete=True)
    print(f"missing: {', '.join(absent) or 'nothing'}; trained differently: {', '.join(old) or 'none'}")
