"""What the published model directories hold: errors, learning curves, costs, and which of them can be compared.

Only models trained in the same way are compared: on the data set, with the split and the recipe of the reference model;
the seed may differ.
"""

from pathlib import Path
from typing import Any

from bem._support.text_files import read_json
from experiments.common import ended_by_recipe
from experiments.paper_numbers import PAPER_RECIPE, paper_values
from experiments.run_folders import read_table
from surrogate.architectures.naming import paper_names
from surrogate.training.identity import ALIKE, HELD_OUT, TrainingIdentity, differences, read_identity

METRICS = ("mse", "mae", "dtw_rmse")
REMOVED = "program_removed"
"""Key of `run.json`: the program of its command is no longer part of the repository, and where its history is."""
REFERENCE = "M1-concat"
"""The reference model: the others must be trained as it was."""
PAPER_TRAINED = {name: PAPER_RECIPE.format(name) for name in paper_names()}
"""Labels of the models trained by the paper's recipe."""
PAPER_TRAINED_INPUTS = {features: PAPER_RECIPE.format(f"{REFERENCE}-inputs-{features}") for features in "ABC"}
PAPER_TRAINED_INPUTS["D"] = PAPER_TRAINED[REFERENCE]
"""The same of the reference model, by its input representation."""
WORDED = f"{REFERENCE}-as-worded"
"""Label of the reference model trained by the paper's words, without Keras's threshold of the plateau."""
PAPER_TRAINED_CONTENDERS = PAPER_TRAINED | {f"features-{name}": label for name, label in PAPER_TRAINED_INPUTS.items()}
"""Both, by their names in the rankings."""


def by_recipe(model: str, models: Path) -> dict[str, str]:
    """Labels under which a model is published: of the training that the recipe `paper` ended, then that by `swift`.

    Raises:
        FileNotFoundError: There is neither.
    """
    labels = {"paper": PAPER_RECIPE.format(model)} if ended_by_recipe(models / PAPER_RECIPE.format(model)) else {}
    labels |= {"swift": model} if (models / model / "run.json").is_file() else {}
    if not labels:
        raise FileNotFoundError(f"model {model!r} not found in {str(models)!r}; `make model-paper-recipe` trains it")
    return labels


def read_history(folder: Path) -> dict[str, list[float]]:
    """Epochs, learning rates, errors and core seconds of a model directory, as columns."""
    table, names = (
        read_table(folder, "history"),
        ("epoch", "learning_rate", "train_mse", "validation_mse", "cpu_seconds"),
    )
    return {name: table[name].tolist() for name in names}


def minutes_to(history: dict[str, list[float]], mse: float) -> float | None:
    """Core minutes until the validation MSE is at most `mse` for the first time; `None` if it never is."""
    pairs = zip(history["cpu_seconds"], history["validation_mse"], strict=True)
    return next((seconds / 60.0 for seconds, error in pairs if error <= mse), None)


def paper_mse() -> float:
    """The paper's held-out MSE of its best model."""
    return float(paper_values("reference_model")["mse"])


def epoch_seconds(speed: Any, recipe: dict[str, Any], architecture: str, trajectories: int) -> float | None:
    """Core seconds of the batches of an epoch, where the study `training_speed`, of this result, has timed them."""
    if speed is None:
        return None
    ours = {name: record["seconds_per_batch"] for name, record in speed["models"].items()}
    timed = {speed["recipe"]: ours, "paper": speed.get("by_paper_recipe", {})}
    batch = timed.get(recipe["name"], {}).get(architecture)
    return batch and -(-trajectories // recipe["batch_size"]) * batch["median"]


def read_model(folder: Path, speed: Any = None) -> dict[str, Any]:
    """Training and held-out errors of a model directory.

    Core seconds are those of the training's batches on one machine, where the study `training_speed`, of the result
    `speed`, has timed them. Otherwise they are as recorded, and `None` if a GPU (`device`) trained it.
    """
    metrics, run = (read_json(folder / f"{name}.json") for name in ("metrics", "run"))
    history, recipe = read_history(folder), run["recipe"]
    seconds_per_epoch = epoch_seconds(speed, recipe, run["architecture"], run["training_trajectories"])
    if seconds_per_epoch is not None:
        history["cpu_seconds"] = [epoch * seconds_per_epoch for epoch in history["epoch"]]
    recorded = None if run.get("device") else metrics["cpu_seconds"]
    seconds = recorded if seconds_per_epoch is None else history["cpu_seconds"][-1]
    return {
        **{name: metrics[name] for name in ("parameters", "test", "epochs", "best_epoch")},
        **{name: metrics["test"][name]["mean"] for name in METRICS},
        **{name: run[name] for name in ("backend", "versions", "training_trajectories")},
        "ended_by": run.get("ended_by"),
        "device": run.get("device", "processor"),
        "removed": run.get(REMOVED),
        "validation_mse": min(history["validation_mse"]),
        "core_seconds": seconds,
        "hours": None if seconds is None else seconds / 3600.0,
        "minutes_to_paper_mse": None if seconds is None else minutes_to(history, paper_mse()),
        "recipe": recipe,
        "history": history,
    }


def published(models: Path) -> dict[str, TrainingIdentity]:
    """Identity of the training of each published model: the 18 paper models in their order, then the others."""
    folders = {path.parent.name: path.parent for path in sorted(models.glob("*/run.json"))}
    first = [name for name in paper_names() if name in folders]
    return {name: read_identity(folders[name]) for name in dict.fromkeys([*first, *folders])}


def training_differences(trained: dict[str, TrainingIdentity], dataset: str) -> dict[str, list[str]]:
    """Models that cannot be compared with the others, each with words for what differs: recipe, data set and so on.

    `dataset` is the digest of the data set on which the models must have been trained.
    """
    current = {name: trained[name] for name in paper_names() if name in trained and trained[name].dataset == dataset}
    measure = current.get(REFERENCE) or next(iter(current.values()), None)
    reasons = {}
    for name, identity in trained.items():
        if identity.dataset != dataset:
            reasons[name] = ["data set"]
        elif measure is not None:
            # A published model may be the median of several seeds.
            any_seed, reference = identity.of_any_seed(), measure.of_any_seed()
            reasons[name] = differences(any_seed, reference, ALIKE if name in paper_names() else HELD_OUT)
    return {name: differing for name, differing in reasons.items() if differing}


def outdated(trained: dict[str, TrainingIdentity], dataset: str, models: Path) -> dict[str, str]:
    """One sentence for each model that cannot be compared with the others: what differs, and what to do."""
    return {
        name: f"{name} is left out, because its {' and '.join(reasons)} is not that of the comparison: "
        f"remove {str(models / name)!r} and train it again."
        for name, reasons in training_differences(trained, dataset).items()
    }
