"""One training run from data set file to published model directory.

A model directory holds:

    model.weights.h5    the weights, readable under every backend
    model.onnx          features, scaling and network in one graph (see `surrogate.export`); missing where a
                        registered architecture has a layer unknown to `surrogate.network.lowering`
    scaling.json        the training set's statistics and ranges
    split.json          seed, and the trajectory indices of training, validation and test
    history.csv         one row per epoch, seconds accumulated
    metrics.json        errors on validation and test, summarised
    test_errors.csv     errors of every test trajectory
    recipe.toml         how it was trained
    run.json            versions, seconds, backend, seed, command, digest of the data set

`surrogate.training.publishing` copies it to the place where `surrogate.load` looks.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import keras
import numpy as np

from surrogate.architectures import build
from surrogate.architectures.registry import source_of
from surrogate.backend import has_fused_lstm, versions
from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.metrics import summary
from surrogate.data.scaling import Scaling
from surrogate.export.onnx import export_folder
from surrogate.network.lowering import NotExportableError
from surrogate.network.onnx_file import ONNX_NAME
from surrogate.training.checkpoint import Progress, require_same_run
from surrogate.training.evaluation import evaluate, physical_channels, scaled_examples, write_errors
from surrogate.training.identity import TrainingIdentity
from surrogate.training.keras_fit import fit
from surrogate.training.loop import EpochReport, Examples, train, with_fused_lstm
from surrogate.training.publishing import model_name, publish
from surrogate.training.recipe import Recipe

__all__ = ["RUN_FORMAT", "Run", "execute", "extra_indices", "fit_scaling", "publish"]

RUN_FORMAT = "viscoelastic-contact-surrogate"


@dataclass(frozen=True)
class Run:
    """What is trained on what.

    Args:
        architecture: One of the names `surrogate.names()` returns.
        dataset: The data set that holds validation and test trajectories.
        split: Its division.
        recipe: How to train.
        features: The feature set.
        extra: A second data set, of the same material and measurement steps, whose trajectories all join the training
            part, but for protocols held out.
        label: The name to publish under, one plain name; the architecture's by default.
        epochs_given: Whether the recipe's number of epochs was replaced by another.

    Raises:
        ValueError: the label is no plain name, or the second data set is of another material or has other measurement
            steps.
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
                raise ValueError(f"Expected an extra data set of the {words} {wanted}. Received: {found}")

    @property
    def name(self) -> str:
        """The name to publish under."""
        return self.label or self.architecture

    @property
    def identity(self) -> TrainingIdentity:
        """What decides its result."""
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
    """Take the statistics of the run's training trajectories, the extra ones included."""
    sources = [(run.dataset, run.split.train)]
    if run.extra:
        sources.append((run.extra, extra_indices(run)))
    protocols = [dataset.protocols_of(indices) for dataset, indices in sources]
    merged = {name: np.concatenate([part[name] for part in protocols]) for name in protocols[0]}
    if run.dataset.modulus_ratio is not None:
        merged["modulus_ratio"] = np.array([run.dataset.modulus_ratio])
    return Scaling.fit(
        np.concatenate([physical_channels(dataset, indices, run.features) for dataset, indices in sources]),
        tabor=merged["tabor"],
        force=np.concatenate([dataset.force[indices] for dataset, indices in sources]),
        features=run.features,
        protocols=merged,
        dataset_sha256=run.dataset.sha256,
    )


def extra_indices(run: Run) -> np.ndarray:
    """Return the completed trajectories of the extra data set whose protocols the run does not hold out."""
    completed = run.extra.completed
    forbidden = set(_protocols(run.dataset, np.concatenate([run.split.validation, run.split.test])))
    return completed[np.array([row not in forbidden for row in _protocols(run.extra, completed)], dtype=bool)]


def _protocols(dataset: TrajectoryDataset, indices: np.ndarray) -> list[tuple[float, ...]]:
    """Protocols as they compare between processors, whose powers differ in the last digit: in single precision."""
    columns = dataset.protocols_of(indices).values()
    return list(zip(*(values.astype(np.float32).tolist() for values in columns), strict=True))


def execute(
    run: Run,
    folder: Path,
    *,
    should_stop: Callable[[], bool] = lambda: False,
    report: Callable[[EpochReport], None] = lambda _: None,
    log: Callable[[str], None] = lambda _: None,
    command: str = "",
) -> Progress:
    """Train in `folder`, resuming what is there; when finished, leave a complete model directory in `folder/model`."""
    keras.config.set_floatx("float32")
    keras.utils.set_random_seed(run.recipe.seed)
    folder.mkdir(parents=True, exist_ok=True)
    model = with_fused_lstm(build(run.architecture, features=run.features))
    if any(isinstance(layer, keras.layers.LSTM) for layer in model.layers) and not has_fused_lstm():
        log(f"The {keras.backend.backend()} backend has no fused LSTM here; it runs step by step")

    scaling = fit_scaling(run)
    training = scaled_examples(run.dataset, run.split.train, scaling)
    if run.extra:
        more = scaled_examples(run.extra, extra_indices(run), scaling)
        pairs = zip(vars(training).values(), vars(more).values(), strict=True)
        training = Examples(*(np.concatenate(pair) for pair in pairs))
    require_same_run(folder, run.identity.fingerprint)
    progress = (fit if run.recipe.loop == "fit" else train)(
        model,
        training,
        scaled_examples(run.dataset, run.split.validation, scaling),
        recipe=run.recipe,
        folder=folder,
        fingerprint=run.identity.fingerprint,
        should_stop=should_stop,
        report=report,
    )
    if progress.finished:
        _write_model(run, folder, model, scaling, progress, examples=len(training), command=command, log=log)
    return progress


def _write_model(
    run: Run,
    folder: Path,
    model: keras.Model,
    scaling: Scaling,
    progress: Progress,
    *,
    examples: int,
    command: str,
    log: Callable[[str], None],
) -> None:
    target = folder / "model"
    target.mkdir(exist_ok=True)
    # A fresh build carries no optimizer, whose state Keras would write beside the weights.
    bare = build(run.architecture, features=run.features)
    bare.set_weights([keras.ops.convert_to_numpy(variable) for variable in model.weights])
    bare.save_weights(target / "model.weights.h5")
    scaling.save(target / "scaling.json")
    run.split.save(target / "split.json")
    shutil.copyfile(folder / "history.csv", target / "history.csv")
    (target / "recipe.toml").write_text(run.recipe.to_toml(), encoding="utf-8")

    parts = {"validation": run.split.validation, "test": run.split.test}
    errors = {part: evaluate(model, scaling, run.dataset, indices) for part, indices in parts.items()}
    write_errors(target / "test_errors.csv", run.split.test, errors["test"])
    cost = {"epochs": progress.epoch, "best_epoch": progress.best_epoch}
    cost |= {"seconds": progress.seconds, "cpu_seconds": progress.cpu_seconds}
    _write_json(
        target / "metrics.json",
        {"parameters": model.count_params(), **cost, **{part: summary(values) for part, values in errors.items()}},
    )
    content = {
        "format": RUN_FORMAT,
        "format_version": 1,
        "name": run.name,
        "architecture": run.architecture,
        "features": run.features,
        "command": command,
        "backend": keras.backend.backend(),
        "fused_lstm": has_fused_lstm(),
        "versions": versions(),
        "seed": run.recipe.seed,
        # A plateau ends a training before its epochs do.
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
        export_folder(target)
    except NotExportableError as error:
        (target / ONNX_NAME).unlink(missing_ok=True)
        log(f"{run.name}: without {ONNX_NAME}, so that it predicts with backend='keras' alone. {error}")


def _write_json(path: Path, content: dict) -> None:
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
