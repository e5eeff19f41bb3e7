"""One training run, from the data set to the model directory (`surrogate.training.model_directory`)."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import keras
import numpy as np

from bem._support.outputs import write_whole
from bem._support.provenance import host
from surrogate.architectures import build
from surrogate.architectures.registry import source_of
from surrogate.backend import versions
from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.examples import Part, fitted_scaling, joined_examples, scaled_examples
from surrogate.data.metrics import summary
from surrogate.data.scaling import Scaling
from surrogate.export.keras_layers import NotExportableError
from surrogate.export.onnx_file import ONNX_NAME
from surrogate.prediction.networks import KerasNetwork
from surrogate.training.evaluation import evaluate, write_errors
from surrogate.training.exporting import folder_content
from surrogate.training.fitting import fit, started, with_weights
from surrogate.training.identity import TrainingIdentity
from surrogate.training.model_directory import model_name, publish
from surrogate.training.recipe import Recipe
from surrogate.training.run_folder import Progress, Report, locked

__all__ = ["RUN_FORMAT", "Run", "execute", "extra_indices", "fit_scaling", "publish"]

RUN_FORMAT = "viscoelastic-contact-surrogate"


@dataclass(frozen=True)
class Run:
    """An architecture, the data it is trained on, and how.

    Args:
        architecture: Name of an architecture, one of `surrogate.names()`.
        dataset: The data set with the training, validation and test sets.
        split: The split of `dataset`.
        recipe: How to train.
        features: The feature set, `"A"` to `"D"`.
        extra: A second data set, of the same material and measurement steps. Its completed trajectories join the
            training set, except those whose protocols are in the validation or test set.
        label: Name to publish the model under; the name of the architecture by default.
        epochs_given: Whether the number of epochs was given instead of taken from the recipe.

    Raises:
        ValueError: the name is not plain, or the second data set has another material or other measurement steps.
    """

    architecture: str
    dataset: TrajectoryDataset
    split: Split
    recipe: Recipe
    features: str = "D"
    extra: TrajectoryDataset | None = None
    label: str = ""
    epochs_given: bool = False

    def __post_init__(self) -> None:
        model_name(self.name)
        if self.extra is None:
            return
        for name, words in (("modulus_ratio", "modulus ratio"), ("points_per_phase", "measurement steps")):
            wanted, found = getattr(self.dataset, name), getattr(self.extra, name)
            if found != wanted:
                raise ValueError(f"Expected an extra data set with the {words} {wanted}. Received: {found}")

    @property
    def name(self) -> str:
        """The name to publish under."""
        return self.label or self.architecture

    @property
    def training(self) -> list[Part]:
        """The data sets to train on, and the trajectories of each."""
        own = (self.dataset, self.split.train)
        return [own] if self.extra is None else [own, (self.extra, extra_indices(self))]

    @property
    def identity(self) -> TrainingIdentity:
        """The identity of the training: all that decides its result."""
        return TrainingIdentity.of(
            self.architecture,
            self.dataset,
            self.split,
            self.recipe,
            features=self.features,
            extra=self.extra,
            backend=keras.backend.backend(),
        )


def fit_scaling(run: Run) -> Scaling:
    """Return the scaling: the statistics of the run's training set, with the trajectories of the extra data set."""
    protocols = [dataset.protocols_of(rows) for dataset, rows in run.training]
    ranges = {name: np.concatenate([part[name] for part in protocols]) for name in protocols[0]}
    if run.dataset.modulus_ratio is not None:
        ranges["modulus_ratio"] = np.array([run.dataset.modulus_ratio])
    return fitted_scaling(run.training, run.features, ranges, run.dataset.sha256)


def extra_indices(run: Run) -> np.ndarray:
    """Return the trajectories of the extra data set that join the training set, shape `(n,)`.

    They are completed, and their protocols are not in the validation or test set.
    """
    completed = run.extra.completed
    held_out = set(_protocols(run.dataset, np.concatenate([run.split.validation, run.split.test])))
    return completed[np.array([row not in held_out for row in _protocols(run.extra, completed)], dtype=bool)]


def _protocols(dataset: TrajectoryDataset, indices: np.ndarray) -> list[tuple[float, ...]]:
    """Return protocols in single precision, in which they compare equal although processors round differently."""
    columns = dataset.protocols_of(indices).values()
    return list(zip(*(values.astype(np.float32).tolist() for values in columns), strict=True))


def execute(
    run: Run,
    folder: Path,
    *,
    should_stop: Callable[[], bool] = lambda: False,
    report: Report = lambda *_: None,
    log: Callable[[str], None] = lambda _: None,
    command: str = "",
) -> Progress:
    """Train in `folder`, or resume the training there. When it is finished, write the model directory `folder/model`.

    Args:
        run: What to train.
        folder: Directory of the run.
        should_stop: Called after each epoch; `True` ends the training early, and a later call resumes it.
        report: See `surrogate.training.run_folder.Report`.
        log: Called with messages, one line of text each.
        command: The command line, recorded in `run.json`.

    Returns:
        The progress; its `finished` tells whether the model directory is written.

    Raises:
        ValueError: `folder` holds a damaged checkpoint, or one of another training or of more epochs than the recipe,
            or another process is training there.
        FloatingPointError: the validation error is not finite.
    """
    model = started(lambda: build(run.architecture, features=run.features), run.recipe.seed)
    scaling = fit_scaling(run)
    training = joined_examples(run.training, scaling)
    facts = run.identity.fingerprint
    with locked(folder, facts):
        validation = scaled_examples(run.dataset, run.split.validation, scaling)
        examples = training, validation
        progress = fit(model, *examples, run.recipe, folder, facts=facts, should_stop=should_stop, report=report)
        if progress.finished:
            _write_model(
                run, folder, KerasNetwork(model, scaling), progress, examples=len(training), command=command, log=log
            )
    return progress


def _write_model(
    run: Run,
    folder: Path,
    trained: KerasNetwork,
    progress: Progress,
    *,
    examples: int,
    command: str,
    log: Callable[[str], None],
) -> None:
    target = folder / "model"
    target.mkdir(exist_ok=True)
    # A new model has no optimizer, whose state Keras would write into the weights file.
    with_weights(build(run.architecture, features=run.features), trained.model).save_weights(
        target / "model.weights.h5"
    )
    trained.scaling.save(target / "scaling.json")
    run.split.save(target / "split.json")
    shutil.copyfile(folder / "history.csv", target / "history.csv")
    (target / "recipe.toml").write_text(run.recipe.to_toml(), encoding="utf-8")

    parts = {"validation": run.split.validation, "test": run.split.test}
    errors = {part: evaluate(trained, run.dataset, indices) for part, indices in parts.items()}
    write_errors(target / "test_errors.csv", run.split.test, errors["test"])
    cost = {"epochs": progress.epoch, "best_epoch": progress.best_epoch}
    cost |= {"seconds": progress.seconds, "cpu_seconds": progress.cpu_seconds}
    _write_json(
        target / "metrics.json",
        {
            "parameters": trained.model.count_params(),
            **cost,
            **{part: summary(values) for part, values in errors.items()},
        },
    )
    content = {
        "format": RUN_FORMAT,
        "format_version": 1,
        "name": run.name,
        "architecture": run.architecture,
        "features": run.features,
        "command": command,
        "backend": keras.backend.backend(),
        "versions": versions(),
        "host": host(),
        "seed": run.recipe.seed,
        # Early stopping ends a training before its last epoch.
        "ended_by": "--epochs" if run.epochs_given and progress.epoch == run.recipe.epochs else "recipe",
        "training_trajectories": examples,
        **cost,
        "dataset_sha256": run.dataset.sha256,
        "dataset_forces_sha256": run.dataset.forces_sha256,
        "extra_dataset_sha256": run.extra.sha256 if run.extra else None,
    }
    if source := source_of(run.architecture):
        content["architecture_file"] = asdict(source)
    _write_json(target / "run.json", content)
    try:
        write_whole(target / ONNX_NAME, folder_content(target))
    except NotExportableError as error:
        (target / ONNX_NAME).unlink(missing_ok=True)
        log(f"{run.name}: no {ONNX_NAME} is written, so the model predicts with backend='keras' only. {error}")


def _write_json(path: Path, content: dict) -> None:
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
