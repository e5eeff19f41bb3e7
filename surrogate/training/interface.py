"""`surrogate.train`: the checks before a training, the training, and the publication of its model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from surrogate.architectures.naming import split_name
from surrogate.backend import import_keras
from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.training.identity import Run, trained_otherwise
from surrogate.training.model_directory import publish, require_place
from surrogate.training.recipe import Recipe
from surrogate.training.run_folder import Report, print_epoch

RUNS = Path("results/training")


def train(
    name: str,
    dataset: str | Path | TrajectoryDataset,
    *,
    out: str | Path,
    recipe: str | Path | Recipe = "swift",
    seed: int | None = None,
    epochs: int | None = None,
    features: str = "D",
    split: Split | None = None,
    extra: str | Path | TrajectoryDataset | None = None,
    runs: str | Path = RUNS,
    replace: bool = False,
    should_stop: Callable[[], bool] = lambda: False,
    report: Report = print_epoch,
    log: Callable[[str], None] = print,
    command: str = "surrogate.train",
) -> bool:
    """Train a model, or resume its training, and publish it as a folder that `surrogate.load` reads.

    A call that was interrupted continues after its last complete epoch when it is repeated. If the same training is
    published in `out` already, nothing is done.

    Args:
        name: Name of an architecture, one of `surrogate.names()`.
        dataset: A data set, or its file.
        out: Path of the folder; its name is that of the model.
        recipe: A recipe, its name or its TOML file (`surrogate.training.recipe`).
        seed: Seed of weights, batches and dropout instead of the recipe's.
        epochs: Number of epochs instead of the recipe's.
        features: Feature set of the inputs, `"A"` to `"F"`.
        split: The training, validation and test sets; `dataset.split()` by default.
        extra: A second data set or its file, of the same material and steps, for training only.
        runs: Directory in which the folder of the run is kept, under the model's name.
        replace: Whether to replace another model in `out`.
        should_stop: Called after each epoch; `True` ends the training early.
        report: Called after each epoch with the progress and the number of epochs.
        log: Called with messages, one line of text each.
        command: What `run.json` records as the command.

    Returns:
        Whether the training is finished and its model published; `False` if it was stopped.

    Raises:
        FileNotFoundError: a file does not exist.
        ModuleNotFoundError: Keras is not installed.
        ValueError: a name is unknown or not plain, a file is damaged, `out` holds something else than a model, or
            another model and `replace` is false, or the folder of the run holds another training.
        FloatingPointError: the training diverged.

    Examples:
        >>> surrogate.train("M1-concat", "published/dataset.h5", out="models/mine")  # doctest: +SKIP
    """
    out = Path(out)
    require_place(out)
    own = recipe if isinstance(recipe, Recipe) else Recipe.load(recipe)
    chosen = own.with_overrides(epochs=epochs, seed=seed)
    split_name(name)
    data = _loaded(dataset)
    run = Run(
        architecture=name,
        dataset=data,
        split=split or data.split(),
        recipe=chosen,
        features=features,
        extra=None if extra is None else _loaded(extra),
        label=out.name,
        epochs_given=chosen.epochs != own.epochs,
    )
    if out.exists() and not replace:
        if why := trained_otherwise(out, run.identity):
            raise ValueError(
                f"out must be a path without a model (--label NAME), or replace must be true (--replace); received "
                f"{out}, a published model {why}"
            )
        log(f"{run.name}: already published in {out}; --replace trains it again")
        return True
    import_keras()
    from surrogate.training.runs import execute

    folder = Path(runs) / run.name
    progress = execute(run, folder, should_stop=should_stop, report=report, log=log, command=command)
    if not progress.finished:
        log(f"{run.name}: stopped after epoch {progress.epoch}; the same command resumes it")
        return False
    publish(folder, out)
    log(f"{run.name}: published in {out}")
    return True


def _loaded(dataset: str | Path | TrajectoryDataset) -> TrajectoryDataset:
    return dataset if isinstance(dataset, TrajectoryDataset) else TrajectoryDataset.load(dataset)
