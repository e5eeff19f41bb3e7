"""One training run, from the data set to the model directory (`surrogate.training.model_directory`).

Also the ONNX file of a model directory, from its weights and scaling.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import keras
import numpy as np

from bem._support.outputs import write_whole
from bem._support.provenance import host
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FMS, measurement_grid
from surrogate.architectures import build
from surrogate.architectures.naming import is_registered
from surrogate.architectures.registry import source_of
from surrogate.backend import versions
from surrogate.data.examples import Examples, physical_channels, scaled_examples
from surrogate.data.features import edge_from_counts
from surrogate.data.metrics import summary
from surrogate.data.scaling import Scaling
from surrogate.files import read_run, weights_sha256, write_run
from surrogate.networks import KerasNetwork, OnnxNetwork, keras_network
from surrogate.onnx.export import file_content
from surrogate.onnx.file import ONNX_NAME
from surrogate.onnx.keras_layers import NotExportableError
from surrogate.training.evaluation import evaluate, write_errors
from surrogate.training.fitting import fit, started
from surrogate.training.identity import Run
from surrogate.training.run_folder import Progress, Report, locked

RUN_FORMAT = "viscoelastic-contact-surrogate"
AGREEMENT = 1e-3
"""Largest difference between ONNX and Keras for a registered architecture, as a fraction of a history's force range."""


def training_examples(run: Run) -> tuple[Scaling, Examples]:
    """Return the scaling of a run, the statistics of its training set, and that set, scaled by it."""
    parts = run.training
    protocols = [dataset.protocols_of(rows) for dataset, rows in parts]
    ranges = {name: np.concatenate([table[name] for table in protocols]) for name in protocols[0]}
    tabor = ranges["tabor"]
    if run.dataset.modulus_ratio is not None:
        ranges["modulus_ratio"] = np.array([run.dataset.modulus_ratio])
    channels = np.concatenate([physical_channels(dataset, rows, run.features) for dataset, rows in parts])
    force = np.concatenate([dataset.force[rows] for dataset, rows in parts])
    scaling = Scaling.fit(
        channels,
        tabor=tabor,
        force=force,
        features=run.features,
        protocols=ranges,
        dataset_sha256=run.dataset.sha256,
    )
    return scaling, Examples.scaled(channels, tabor, force, scaling)


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
    scaling, training = training_examples(run)
    validation = scaled_examples(run.dataset, run.split.validation, scaling)
    facts = replace(run.identity, backend=keras.backend.backend()).fingerprint
    with locked(folder):
        progress = fit(
            model, training, validation, run.recipe, folder, facts=facts, should_stop=should_stop, report=report
        )
        if progress.finished:
            (folder / "model").mkdir(exist_ok=True)
            shutil.copyfile(folder / "history.csv", folder / "model" / "history.csv")
            _write_model(run, KerasNetwork(model, scaling), progress, folder / "model", command)
            try:
                write_whole(folder / "model" / ONNX_NAME, folder_content(folder / "model"))
            except NotExportableError as error:
                (folder / "model" / ONNX_NAME).unlink(missing_ok=True)
                log(f"{run.name}: no {ONNX_NAME} is written, so the model predicts with backend='keras' only. {error}")
            write_run(folder / "model", read_run(folder / "model")[0])
    return progress


def _write_model(run: Run, trained: KerasNetwork, progress: Progress, target: Path, command: str) -> None:
    # A new model has no optimizer, whose state Keras would write into the weights file.
    bare = build(run.architecture, features=run.features)
    bare.set_weights(trained.model.get_weights())
    bare.save_weights(target / "model.weights.h5")
    trained.scaling.save(target / "scaling.json")
    run.split.save(target / "split.json")
    parts = {"validation": run.split.validation, "test": run.split.test}
    errors = {subset: evaluate(trained, run.dataset, indices) for subset, indices in parts.items()}
    write_errors(target / "test_errors.csv", run.split.test, errors["test"])
    cost = {"epochs": progress.epoch, "best_epoch": progress.best_epoch}
    cost |= {clock: progress.spent(clock) for clock in ("seconds", "cpu_seconds")}
    metrics = {
        "parameters": bare.count_params(),
        **cost,
        **{subset: summary(subset_errors) for subset, subset_errors in errors.items()},
    }
    source = source_of(run.architecture)
    record = {
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
        "recipe": run.recipe.as_dict(),
        # Early stopping ends a training before its last epoch.
        "ended_by": "--epochs" if run.epochs_given and progress.epoch == run.recipe.epochs else "recipe",
        "training_trajectories": sum(len(rows) for _, rows in run.training),
        **cost,
        "dataset_sha256": run.dataset.sha256,
        "dataset_forces_sha256": run.dataset.forces_sha256,
        "extra_dataset_sha256": run.extra.sha256 if run.extra else None,
        **({"architecture_file": source._asdict()} if source else {}),
    }
    (target / "metrics.json").write_text(json.dumps(metrics, indent=1) + "\n", encoding="utf-8")
    write_run(target, record)


def folder_content(folder: Path) -> bytes:
    """Return the bytes of the ONNX file of a model directory.

    Raises:
        FileNotFoundError: the directory is not complete.
        NotExportableError: a registered architecture has a layer that cannot be exported, or that computes otherwise in
            ONNX Runtime than in Keras.
        ValueError: the weights do not fit the architecture.
    """
    run, scaling = read_run(folder)
    network = keras_network(folder, run, scaling)
    model_bytes = file_content(
        network.model,
        scaling,
        name=run["name"],
        architecture=run["architecture"],
        weights_sha256=weights_sha256(folder),
    )
    if is_registered(run["architecture"]):  # tests compare the 18 paper models with Keras
        protocols = {name: np.linspace(*scaling.ranges[name], 4)[1:] for name in QUANTITIES}
        inputs = (*measurement_grid(**protocols), protocols["tabor"], edge_from_counts(FMS, 3))
        expected, predicted = network.force(*inputs), OnnxNetwork(model_bytes, scaling, run["name"]).force(*inputs)
        differences = np.abs(predicted - expected).max(axis=1) / np.ptp(expected, axis=1)
        if not differences.max() <= AGREEMENT:
            raise NotExportableError(
                f"the ONNX file must agree with Keras to {AGREEMENT:g} of the force's range; received one that differs "
                f"by {differences.max():.1e}, because a layer computes something else than its class says"
            )
    return model_bytes
