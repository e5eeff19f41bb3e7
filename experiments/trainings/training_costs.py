"""What training costs and achieves, and when a surrogate pays for itself.

`training_speed` times the 18 paper models by our recipe and the paper's, batch after batch on one core of one machine.
The record of a published model states what its training took on its own processor, and these processors differ; some
were trained on a GPU. Here all 18 are timed on batches of the data set's size, one after another. The hours of a
training are those of its batches, without the validation after each epoch. A block holds as many batches as lie between
two refinements of the optimizer's bases, which cost more than the batches between them. The environment variable
`KERAS_BACKEND` selects another backend.

`training_cost` collects errors against core minutes of training, from the published models. The record of a training
holds validation errors only; the held-out error is measured once, at its end. The learning curve of a training
therefore shows its validation error. The test error over core minutes is one point for each training of the reference
architecture: the published model, and those trained for shorter and longer, by the paper's recipe, or on more data.

`amortisation` collects core seconds of data set, training and queries against the number of queries. The seconds of a
query are those of `experiments.measurements.accuracy_cost`. Each surrogate, in each way of calling it, is compared with
the solver at its named accuracies. The paper's lines use the paper's own numbers. A model that was published or
retrained after the measurement is listed by name; its seconds are not estimated.

Seconds of a training are those of its batches on one machine, where `training_speed` measured them.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem._support.text_files import read_json
from bem.dataset.file import load_dataset
from bem.dataset.measurement_steps import FMS
from experiments.common import DATASET, Dataset, Models, Result, dataset_digest
from experiments.harness import Repeats, progress, timed
from experiments.measurements.statistics import spread
from experiments.measurements.tools import absent, complete
from experiments.paper_numbers import paper_values
from experiments.published_models import REFERENCE, outdated, paper_mse, published, read_model
from surrogate.architectures.naming import names
from surrogate.backend import import_keras, limit_threads, versions
from surrogate.data.dataset import Split
from surrogate.files import weights_sha256

BLOCK = 10  # batches in a block if the optimizer has no bases
BUDGETS = (
    *(f"M1-concat-{epochs}-epochs" for epochs in (8, 15, 60)),
    *("M1-concat-paper", "M1-concat-inputs-C", "M1-concat-large"),
)
"""Further trainings of the reference architecture, which `make more-models` publishes."""


def seconds_of_batches(name: str, recipe: Any, batches: int, repeats: int) -> list[float]:
    """Seconds of one batch: the mean over each of `repeats` blocks, after one block that is not counted.

    The recipe sets batch size and optimizer, the batches in an epoch the schedule of the learning rate.
    """
    import keras

    import surrogate
    from surrogate.training.fitting import compile_by
    from surrogate.training.torch_lstm import with_fused_lstm

    keras.utils.clear_session()
    model = with_fused_lstm(surrogate.build(name))
    compile_by(recipe, model, batches)
    draw, size, steps = np.random.default_rng(0), recipe.batch_size, sum(FMS)
    shapes = (size, steps, model.input_shape[0][-1]), (size, 1), (size, steps, 1)
    sequence, tabor, force = (draw.normal(size=shape).astype(np.float32) for shape in shapes)
    length = getattr(model.optimizer, "basis_every", BLOCK)

    def block() -> None:
        for _ in range(length):
            model.train_on_batch([sequence, tabor], force)

    return [seconds / length for seconds in timed(block, repeats)]


def study_training_speed(
    dataset: Dataset = DATASET,
    *,
    recipe: Annotated[str, typer.Option(help="Name of a recipe, or its file.")] = "swift",
    only: Annotated[list[str] | None, typer.Option(help="Time this model only and write nothing; repeatable.")] = None,
    repeats: Repeats = 3,
) -> dict[str, Any] | None:
    """Measure every architecture; the size of the data set sets the batches of an epoch."""
    limit_threads(1)
    import_keras()
    from surrogate.data.dataset import TrajectoryDataset
    from surrogate.training.recipe import Recipe

    chosen, theirs = Recipe.load(recipe), Recipe.load("paper")
    size = len(TrajectoryDataset.load(dataset).split(chosen.seed).train)

    def measured(by: Recipe) -> dict[str, Any]:
        speeds = {}
        for name in progress(only or names(), f"architectures by {by.name}"):
            speeds[name] = spread(seconds_of_batches(name, by, -(-size // by.batch_size), repeats))
            print(f"{name:10} {1e3 * speeds[name]['median']:6.0f} ms a batch")
        return speeds

    batches, seconds = -(-size // chosen.batch_size), measured(chosen)
    if only:
        return None
    hours = {name: speed["median"] * batches * chosen.epochs / 3600.0 for name, speed in seconds.items()}
    models = {name: {"seconds_per_batch": speed, "hours": hours[name]} for name, speed in seconds.items()}
    longest = max(models, key=lambda name: models[name]["hours"])
    return {
        "recipe": chosen.name,
        "epochs": chosen.epochs,
        "batches": batches,
        "models": models,
        "by_paper_recipe": measured(theirs),
        "longest_training": longest,
        "longest_training_hours": models[longest]["hours"],
        "backend": versions(),
    }


def trained(folder: Path, speed: Any) -> dict[str, Any]:
    """One published model: its learning curve, and its held-out error at the end."""
    model = read_model(folder, speed)
    history = model["history"]
    return {
        "name": folder.name,
        "recipe": model["recipe"]["name"],
        "epochs": model["epochs"],
        "training_trajectories": model["training_trajectories"],
        "core_minutes": model["core_seconds"] / 60.0,
        "test_mse": model["mse"],
        "minutes_to_paper_mse": model["minutes_to_paper_mse"],
        "history": {
            "core_minutes": [seconds / 60.0 for seconds in history["cpu_seconds"]],
            "best_mse": np.minimum.accumulate(history["validation_mse"]).tolist(),
        },
    }


def study_training_cost(dataset: Dataset, models: Models, training_speed: Result = None) -> dict[str, Any]:
    """What the published trainings cost, and which are missing."""
    lineages = published(models)
    old = outdated(lineages, dataset_digest(dataset), models)
    shown = [name for name in lineages if name in (*names(), *BUDGETS) and name not in old]
    runs = {name: trained(models / name, training_speed) for name in shown}
    return {
        "paper_mse": paper_mse(),
        "core_minutes": {name: run["core_minutes"] for name, run in runs.items()},
        "minutes_to_paper_mse": runs[REFERENCE]["minutes_to_paper_mse"] if REFERENCE in runs else None,
        "models": [run for name, run in runs.items() if name in names()],
        "beside": [runs[name] for name in BUDGETS if name in runs],
        "missing": [name for name in (*names(), *BUDGETS) if name not in runs],
        "outdated": old,
    }


def line(name: str, category: str, fixed: float, query: float, **more: Any) -> dict[str, Any]:
    """One tool: its fixed cost and its cost per query, in core seconds."""
    return {"name": name, "kind": category, "fixed_seconds": fixed, "query_seconds": query, **more}


def seconds_before_use(name: str, published: Path, trajectory: float) -> float:
    """Core seconds of data and training of a published model: `trajectory` times those it needs, and its training."""
    pretrained = published / "pretrained" / name / "run.json"
    if pretrained.is_file():
        run = read_json(pretrained)
        return run["training_trajectories"] * trajectory + run["cpu_seconds"]
    folder = published / "models" / name
    count = sum(map(len, Split.of(folder).parts.values()))
    return count * trajectory + read_json(folder / "metrics.json")["cpu_seconds"]


def break_even(surrogate: dict[str, Any], solver: dict[str, Any]) -> float | None:
    """Number of queries above which the surrogate costs less than the solver; `None` if it never does."""
    saved = solver["query_seconds"] - surrogate["query_seconds"]
    return (surrogate["fixed_seconds"] - solver["fixed_seconds"]) / saved if saved > 0.0 else None


def study_amortisation(
    accuracy_cost: Result, dataset: Dataset, models: Models, training_speed: Result = None
) -> dict[str, Any]:
    """After how many queries data set, training and predictions cost less than the solver."""
    tools, data = accuracy_cost["tools"], load_dataset(dataset)
    data_seconds = float(data.scalars["solver_seconds"].sum())
    solver = [
        line(f"solver, {tool['setting']}", "solver", 0.0, tool["seconds"]["mean"], errors=tool["errors"])
        for tool in tools
        if tool["kind"] == "solver" and tool["setting"] in ("draft", "standard", "reference")
    ]
    surrogates: list[dict[str, Any]] = []
    left_out: dict[str, list[str]] = {"unmeasured": [], "retrained": []}
    for name in complete(models):
        training = read_model(models / name, training_speed)["core_seconds"]
        calls = [tool for tool in tools if tool.get("model") == name]
        current = [tool for tool in calls if tool.get("weights_sha256") == weights_sha256(models / name)]
        if not current:
            left_out["retrained" if calls else "unmeasured"].append(name)
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
        {"surrogate": surrogate["name"], "solver": alternative["name"], "queries": break_even(surrogate, alternative)}
        for surrogate, alternatives in [*((s, solver) for s in surrogates), (trained, [paper, *solver])]
        for alternative in alternatives
    ]
    return {
        "data_set_seconds": data_seconds,
        "data_set_trajectories": len(data),
        "lines": [*solver, *surrogates, paper, trained],
        "break_even": crossings,
        **left_out,
        **absent(models, dataset),
    }
