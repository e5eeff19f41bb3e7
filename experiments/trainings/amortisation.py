"""When a surrogate pays for itself: core seconds of data set, training and queries against the number of queries.

The study measures nothing. It reads the core seconds of the data set, the core seconds of the training of each
published model (those of its batches on one machine, where `experiments.trainings.training_speed` measured them), and
the seconds of one query from `experiments.measurements.accuracy_cost`. Each surrogate, in each way of calling it, is
compared with the solver at its named accuracies. The paper's lines use the paper's own numbers. A model that was
published or retrained after the measurement is listed by name; its seconds are not estimated.
"""

from pathlib import Path
from typing import Any

from bem.dataset.file import load_dataset
from experiments.measurements.tools import absent, published
from experiments.paper.model_comparison import read_model
from experiments.paper_numbers import paper_values
from surrogate.prediction.files import weights_sha256


def line(name: str, kind: str, fixed: float, query: float, **more: Any) -> dict[str, Any]:
    """One tool: its fixed cost and its cost per query, in core seconds."""
    return {"name": name, "kind": kind, "fixed_seconds": fixed, "query_seconds": query, **more}


def break_even(surrogate: dict[str, Any], solver: dict[str, Any]) -> float | None:
    """Number of queries above which the surrogate costs less than the solver; `None` if it never does."""
    saved = solver["query_seconds"] - surrogate["query_seconds"]
    return (surrogate["fixed_seconds"] - solver["fixed_seconds"]) / saved if saved > 0.0 else None


def study(accuracy_cost: Any, dataset: Path, models: Path, training_speed: Any = None) -> dict[str, Any]:
    """Collect the costs and the break-even numbers of queries."""
    tools, data = accuracy_cost["tools"], load_dataset(dataset)
    data_seconds = float(data.scalars["solver_seconds"].sum())
    solver = [
        line(f"solver, {tool['setting']}", "solver", 0.0, tool["seconds"]["mean"], errors=tool["errors"])
        for tool in tools
        if tool["kind"] == "solver" and tool["setting"] in ("draft", "standard", "reference")
    ]
    surrogates: list[dict[str, Any]] = []
    others: dict[str, list[str]] = {"unmeasured": [], "retrained": []}
    for name in published(models):
        training = read_model(models / name, training_speed)["core_seconds"]
        calls = [tool for tool in tools if tool.get("model") == name]
        current = [tool for tool in calls if tool.get("weights_sha256") == weights_sha256(models / name)]
        if not current:
            others["retrained" if calls else "unmeasured"].append(name)
        for tool in current:
            more = {"errors": tool["errors"], "training_seconds": training, "way": tool["way"]}
            query = tool["seconds"]["mean"]
            surrogates.append(line(tool["setting"], "surrogate", data_seconds + training, query, **more))
    theirs, cost = paper_values("dataset"), paper_values("cost")
    total = 3600.0 * theirs["cpu_hours"]
    paper = line("paper's solver", "paper", 0.0, total / theirs["trajectories"])
    fixed = total + 3600.0 * cost["training_hours"]
    trained = line("paper's surrogate", "paper", fixed, cost["surrogate_seconds"])
    crossings = [
        {"surrogate": one["name"], "solver": other["name"], "queries": break_even(one, other)}
        for one, others in [*((s, solver) for s in surrogates), (trained, [paper, *solver])]
        for other in others
    ]
    return {
        "data_set_seconds": data_seconds,
        "data_set_trajectories": len(data),
        "lines": [*solver, *surrogates, paper, trained],
        "break_even": crossings,
        **others,
        **absent(models, dataset),
    }
