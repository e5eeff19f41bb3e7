"""What accuracy costs in time: every tool of this repository on the same held-out protocols, on one core.

The tools are the solver at nine accuracies, the paper's discretisation (`bem.methods.paper_method`) at three
resolutions, every published surrogate (by plain Keras call, by ONNX Runtime one trajectory at a time, and by ONNX
Runtime in a batch), the pretrained models of any solid, and closed forms. Errors are those of
`statistics.answer_errors`, against a solution refined beyond `reference`. The paper's surrogates and closed forms give
forces at the measurement steps only; the row "measurement steps" is the error of the steps alone. A fine discretisation
of the paper (`BASELINE`) is measured on the first protocols only, and a closed form on those of its regime; each row
states the number. Single calls of a surrogate are timed on the first `SINGLE_CALLS` protocols: every trajectory has the
same number of steps, so that all calls take the same time.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem.methods.version import SOLVER_VERSION
from bem.problem.accuracy import NAMED_TARGETS
from experiments.cases import Case, held_out
from experiments.common import DATASET, MODELS, Dataset, Models, without_extrapolation_warnings
from experiments.harness import Count, Jobs, Repeats, progress, run, timed
from experiments.measurements import tools
from experiments.measurements.closed_forms import FORMS
from experiments.measurements.statistics import answer_errors, spread

TARGETS = (5e-2, 1.7e-2, 8e-3, 4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.5e-4)
BASELINE = {50: 1.0, 100: 0.5, 200: 0.1}
"""Share of the protocols for each resolution of the paper's discretisation: nodes, and least steps of a segment."""
NAMES = {target: name for name, target in NAMED_TARGETS.items()}
BATCH, BATCH_REPEATS, SINGLE_CALLS = 1024, 5, 40


def report(
    group: str, setting: str, answers: np.ndarray, seconds: np.ndarray, exact: np.ndarray, **more: Any
) -> dict[str, Any]:
    """One tool of a kind: its errors, failures and times.

    Answers and exact answers have the shape (count, 122), seconds (runs, calls); there may be fewer calls than answers.
    """
    return {
        "kind": group,
        "setting": setting,
        "protocols": len(answers),
        "repeats": len(seconds),
        "failures": int(np.sum(np.all(np.isnan(answers), axis=1))),
        "seconds": spread(np.median(seconds, axis=0)),
        "run_totals": np.sum(seconds, axis=1).tolist(),
        "errors": {name: spread(values) for name, values in answer_errors(answers, exact).items()},
        **more,
    }


def solver_and_closed_forms(cases: list[Case], exact: np.ndarray, repeats: int, finest: int) -> list[dict[str, Any]]:
    """The solver, the paper's discretisation and the closed forms; a form without a case of its regime is left out."""
    every = np.arange(len(cases))
    listed = [
        ("solver", NAMES.get(target, f"{target:g}"), tools.solver_at(target), every, {"target": target})
        for target in TARGETS
    ]
    for size in (size for size in BASELINE if size <= finest):
        few, setting = every[: max(1, round(BASELINE[size] * len(cases)))], f"{size} nodes, {size} steps"
        listed.append(("paper's discretisation", setting, tools.paper_method_at(size), few, {"resolution": size}))
    for form in FORMS:
        chosen = np.array([i for i, case in enumerate(cases) if form.meant_for(case)], dtype=int)
        listed += [("closed form", form.name, form.answer, chosen, {})] if chosen.size else []
    return [
        report(kind, setting, *run(tool, [cases[i] for i in rows], repeats, f"{kind}, {setting}"), exact[rows], **more)
        for kind, setting, tool, rows, more in listed
    ]


def surrogates(
    cases: list[Case], models: Path, exact: np.ndarray, repeats: int, old: list[str]
) -> list[dict[str, Any]]:
    """Every published model in each way of calling it, and the models of any solid; `old` are marked."""
    rows = []
    for name in progress([*tools.complete(models), *tools.NAMES], "surrogates"):
        if name in tools.NAMES:
            group, before, more = name, "", {}
            calls = {"NumPy": tools.pretrained(name)}
        else:
            calls, more = tools.ways_to_call(name, models)
            group, before, more["outdated"] = "surrogate", f"{name}, ", name in old
        for way, (answers, seconds) in timed_calls(calls, cases, repeats, name).items():
            rows.append(report(group, f"{before}{way}", answers, seconds, exact, way=way, **more))
    return rows


def timed_calls(
    calls: dict[str, tools.Answers], cases: list[Case], repeats: int, name: str
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Answers and seconds of each way to call a model: on one case at a time, and by the predictor in a batch."""
    runs = {}
    for way, answers in calls.items():
        single = way if way == "Keras call" else f"{way} single"
        _, seconds = run(lambda case: answers([case])[0], cases[:SINGLE_CALLS], repeats, name)  # noqa: B023
        runs[single] = answers(cases), seconds
    many = [cases[i % len(cases)] for i in range(BATCH)]
    batches = np.array(timed(lambda: answers(many), BATCH_REPEATS)) / BATCH
    runs[f"{way} batch"] = runs[single][0], np.repeat(batches[:, np.newaxis], len(cases), axis=1)
    return runs


def study(
    dataset: Dataset = DATASET,
    models: Models = MODELS,
    *,
    count: Count = 200,
    repeats: Repeats = 3,
    finest: Annotated[int, typer.Option(help="Finest resolution of the paper's discretisation.")] = max(BASELINE),
    jobs: Jobs = 2,
) -> dict[str, Any]:
    """Measure all tools."""
    cases = held_out(count, dataset)
    exact = tools.refined(cases, jobs)
    steps = tools.from_steps(exact[:, 2:], np.array([case.grid()[1] for case in cases]))
    absent = tools.absent(models, dataset)
    rows = [report("measurement steps", "", steps, np.full((1, len(cases)), np.nan), exact)]
    with without_extrapolation_warnings():
        rows += solver_and_closed_forms(cases, exact, repeats, finest)
        rows += surrogates(cases, models, exact, repeats, absent["outdated"])
    return {
        "protocols": len(cases),
        "repeats": repeats,
        "truth_target": tools.EXACT_TARGET,
        "solver": SOLVER_VERSION,
        "tools": rows,
        **absent,
    }
