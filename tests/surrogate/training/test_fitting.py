"""Training by `model.fit`: it learns, Keras's rules hold, and an interruption changes nothing."""

import contextlib
import dataclasses
import io
import json
import shutil
import warnings
from types import SimpleNamespace

import h5py
import keras
import numpy as np
import pytest

import surrogate
import surrogate.training.fitting as fitting
from bem.dataset.sealed_file import arrays
from surrogate.model import ExtrapolationWarning
from surrogate.training.identity import Run
from surrogate.training.model_directory import MODEL_FILES, publish
from surrogate.training.run_folder import BACKUP, COLUMNS, locked, print_epoch
from surrogate.training.runs import execute
from tests.surrogate.conftest import build_by, build_least, scenes
from tests.surrogate.training.short_runs import COSINE, StopAfter, history, recipe, weights

RULE = {"factor": 0.5, "patience": 2, "minimum_rate": 0.05, "stop_after": 9}
EPOCHS = 8
PLATEAU = "[plateau]\n" + "".join(f"{key} = {value}\n" for key, value in RULE.items())


def run_of(dataset, folder, table="", **given):
    changes = {name: given.pop(name) for name in ("epochs", "rate") if name in given}
    return Run("M1-concat", dataset, dataset.split(), recipe(folder, table, **changes), **given)


def rates_by_hand(errors, rate, least_gain=1e-4, minimum=RULE["minimum_rate"]):
    """Learning rates of the epochs by the documented rule of `ReduceLROnPlateau`, whose min_delta is 1e-4."""
    found, best, wait = [], np.inf, 0
    for error in errors:
        found.append(rate)
        better = error < best - least_gain
        best, wait = (error, 0) if better else (best, wait + 1)
        if wait >= RULE["patience"] and rate > minimum:
            rate, wait = max(rate * RULE["factor"], minimum), 0
    return found


def in_two_parts(run, folder, epochs):
    """A training that was killed after some epochs, in the next one: after its backup, before its progress."""
    stopped = execute(run, folder, should_stop=StopAfter(epochs))
    assert (stopped.finished, stopped.epoch) == (False, epochs)
    assert not (folder / "model").exists()
    for path in (folder / name for name in BACKUP):
        shutil.copy(path, f"{path}.bkp")
    with h5py.File(folder / BACKUP[0], "r+") as file:
        for _, item in arrays(file):
            item[...] = 2 * item[...]
    return execute(run, folder)


class Notes(keras.callbacks.Callback):
    """Weights after each step, and after each epoch the rate and the random state of every dropout."""

    def __init__(self):
        super().__init__()
        self.steps, self.dropout, self.shuffled = [], [], []

    def on_train_batch_end(self, *_, **__):
        self.steps.append([keras.ops.convert_to_numpy(one).copy() for one in self.model.trainable_variables])

    def on_epoch_end(self, *_, **__):
        # What a layer has drawn moves its state on: the compiled step must really draw nothing any more.
        layers = [one for one in self.model._flatten_layers() if isinstance(one, keras.layers.Dropout)]
        self.dropout.append([(one.rate, *keras.ops.convert_to_numpy(one.seed_generator.state)) for one in layers])


@pytest.fixture(scope="module")
def finished(dataset, tmp_path_factory):
    """A training whose recipe has all that paces an epoch: run, folder, progress, output, and notes of a callback."""
    place, notes = tmp_path_factory.mktemp("finished"), Notes()
    table = f"dropout_until = 0.5\n{COSINE}"
    run = run_of(dataset, place, table, epochs=EPOCHS, rate=0.05, extra=dataset, label="large", features="C")
    callbacks, shuffle = fitting._callbacks, fitting.Batches.shuffle

    def shuffled(batches, epoch):
        notes.shuffled.append(epoch)
        shuffle(batches, epoch)

    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(io.StringIO()) as said:
        build_by(patch, build_least)
        patch.setattr(fitting, "_callbacks", lambda *given: [notes, *callbacks(*given)])
        patch.setattr(fitting.Batches, "shuffle", shuffled)
        progress = execute(run, place / "run", report=print_epoch)
    return SimpleNamespace(run=run, folder=place / "run", progress=progress, said=said.getvalue(), notes=notes)


@pytest.fixture(scope="module")
def on_a_plateau(dataset, tmp_path_factory):
    """A training to its plateau, of a model with dropout, and the folder it is in as `whole`."""
    folder = tmp_path_factory.mktemp("plateau")
    # A rate this large keeps the error from falling for long.
    run = run_of(dataset, folder, PLATEAU, epochs=60, rate=0.3)
    with pytest.MonkeyPatch.context() as patch:
        build_by(patch, build_least)
        return run, folder, execute(run, folder / "whole")


def require_same(one, other):
    assert history(one) == history(other)
    expected = weights(other)
    for name, value in weights(one).items():
        np.testing.assert_array_equal(value, expected[name], err_msg=name)


@pytest.mark.parametrize(("below", "before"), [(0.29, 0), pytest.param(0.1, 1, marks=pytest.mark.slow)])
def test_resumed_plateau_is_the_same(below, before, on_a_plateau, least):
    """After an epoch of a lower rate; and as soon as the rate is halved, near its minimum, while the error stays."""
    run, folder, whole = on_a_plateau
    fallen = next(row["epoch"] for row in whole.history if row["learning_rate"] < below)
    parts = folder / f"parts-{below}"
    assert in_two_parts(run, parts, fallen - before).best_epoch == whole.best_epoch
    require_same(parts, folder / "whole")


def test_an_interrupted_training_is_the_same(finished, least, tmp_path):
    assert in_two_parts(finished.run, tmp_path / "parts", EPOCHS - 2).finished
    require_same(tmp_path / "parts", finished.folder)


def test_rate_and_early_stop_follow_keras(on_a_plateau):
    _, folder, whole = on_a_plateau
    rows = history(folder / "whole")
    rates = [row["learning_rate"] for row in rows]
    assert rates == pytest.approx(rates_by_hand([row["validation_mse"] for row in rows], 0.3), rel=1e-6)
    assert rates[-1] < rates[0]
    assert whole.finished
    assert whole.epoch == whole.best_epoch + RULE["stop_after"] < 60
    assert json.loads((folder / "whole/model/run.json").read_text())["ended_by"] == "recipe"
    # The best weights are kept, and no others.
    metrics = json.loads((folder / "whole/model/metrics.json").read_text())
    assert metrics["validation"]["mse"]["mean"] == pytest.approx(whole.best_mse, rel=1e-4)
    assert [path.name for path in (folder / "whole/best").iterdir()] == [f"{whole.best_epoch:05d}.weights.h5"]


def test_validation_uses_averaged_weights(finished, least):
    """By hand: Keras's moving average of the weights after each step, whose momentum the recipe sets."""
    seen, progress = finished.notes.steps, finished.progress
    momentum = 1.0 - 1.0 / (0.5 * len(seen))
    # Keras's average begins with the weights after the first step.
    average = seen[0]
    for step in seen[1 : progress.best_epoch * len(seen) // EPOCHS]:
        average = [momentum * one + (1.0 - momentum) * new for one, new in zip(average, step, strict=True)]
    found = surrogate.load(finished.folder / "model", backend="keras").model.get_weights()
    for one, expected in zip(found, average, strict=True):
        np.testing.assert_allclose(one, expected, atol=1e-5)


def test_dropout_ends_and_epochs_shuffle(finished):
    drawn, half = finished.notes.dropout, EPOCHS // 2
    assert finished.notes.shuffled[-EPOCHS:] == list(range(EPOCHS))
    assert [layers[0][0] for layers in drawn] == [0.1] * half + [0.0] * half
    states = [layers[0][1:] for layers in drawn]
    assert len(set(states[:half])) == half
    assert set(states[half:]) == {states[half - 1]}


def test_finished_run_is_complete(finished, least, dataset, tmp_path):
    run, progress = finished.run, finished.progress
    seen = [line for line in finished.said.splitlines() if line.startswith("epoch ")]
    assert [line.split()[1] for line in seen] == [f"{epoch}/{EPOCHS}" for epoch in range(1, EPOCHS + 1)]
    assert seen[-1].endswith(", at most 0:00:00 left")
    first, *_, last = progress.history
    assert set(first) == {"epoch", *COLUMNS}
    assert last["train_mse"] < 0.5 * first["train_mse"]
    assert last["learning_rate"] < 1e-4

    folder = tmp_path / "models" / "large"
    publish(finished.folder, folder)
    assert {path.name for path in folder.iterdir()} == set(MODEL_FILES)
    written = json.loads((folder / "run.json").read_text())
    assert (written["name"], written["architecture"], written["training_trajectories"]) == ("large", "M1-concat", 96)
    assert written["dataset_sha256"] == dataset.sha256
    assert written["dataset_forces_sha256"] == dataset.forces_sha256
    assert written["versions"]["keras"] == keras.__version__
    assert (written["seed"], written["epochs"], written["backend"]) == (3, EPOCHS, keras.backend.backend())
    assert written["recipe"] == run.recipe.as_dict()
    metrics = json.loads((folder / "metrics.json").read_text())
    assert metrics["validation"]["mse"]["mean"] == pytest.approx(progress.best_mse, rel=1e-4)
    loaded, test = surrogate.load(folder), run.split.test
    assert (loaded.scaling.features, loaded.modulus_ratio) == ("C", 0.1)
    # Held-out protocols of so small a set leave its training ranges.
    warnings.simplefilter("ignore", ExtrapolationWarning)
    force = loaded.predict_history(*dataset.grid(test), scenes(dataset.protocols["tabor"][test]))
    error = np.mean((loaded.scaling.scale_force(force) - loaded.scaling.scale_force(dataset.force[test])) ** 2)
    assert metrics["test"]["mse"]["mean"] == pytest.approx(error, rel=1e-4)


def test_more_epochs_continue_a_plateau(least, dataset, tmp_path):
    """The gain that the learning rate counts is so large that it never comes: a plateau from the first epoch on."""
    table = PLATEAU.replace("0.05", "0.001") + "least_gain = 10.0\n"
    run = run_of(dataset, tmp_path, table, epochs=1, epochs_given=True)
    assert execute(run, tmp_path / "run").finished
    assert json.loads((tmp_path / "run/model/run.json").read_text())["ended_by"] == "--epochs"
    # What ends by its epochs alone goes on when more are asked for.
    rows = execute(run_of(dataset, tmp_path, table, epochs=4), tmp_path / "run").history
    assert [row["epoch"] for row in rows] == [1, 2, 3, 4]
    errors, rates = ([row[name] for row in rows] for name in ("validation_mse", "learning_rate"))
    assert rates == pytest.approx(rates_by_hand(errors, 0.01, 10.0, 1e-3), rel=1e-6)
    assert rates[-1] < rates[0]
    with pytest.raises(ValueError, match="epochs must be at least 4"):
        execute(run, tmp_path / "run")


def test_other_or_damaged_run_is_refused(finished, least, dataset, tmp_path):
    """The older backup does not belong to the progress."""
    run, place = finished.run, tmp_path / "run"
    shutil.copytree(finished.folder, place)
    for other, words in (
        (dataclasses.replace(run, split=dataset.split(seed=1)), "split"),
        (dataclasses.replace(run, recipe=run.recipe.with_overrides(epochs=2 * EPOCHS)), "recipe"),
    ):
        with pytest.raises(ValueError, match=rf"must be of the same training.*of another {words}"):
            execute(other, place)
    shutil.rmtree(place / "model")
    for path in [path for path in place.rglob("*") if path.suffix in (".h5", ".json")]:
        content = path.read_bytes()
        for found in (content[:-1], bytes([content[0] ^ 1]) + content[1:]):
            path.write_bytes(found)
            with pytest.raises(ValueError, match=rf"remove {place} to train .*, which is damaged") as caught:
                execute(run, place)
            assert path.name in str(caught.value) or path.parent.name == "backup"
            assert "\n" not in str(caught.value)
        path.write_bytes(content)
    assert execute(run, place).finished


def test_folder_in_use_and_divergence(least, dataset, tmp_path):
    run = run_of(dataset, tmp_path, rate=1e30)
    with locked(tmp_path / "run"), pytest.raises(ValueError, match=rf"received {tmp_path}/run, where another process"):
        execute(run, tmp_path / "run")
    with pytest.raises(FloatingPointError, match="diverged"):
        execute(run, tmp_path / "run")


def test_extra_data_leave_held_out_ones_out(dataset, tmp_path):
    # Protocols compare equal although processors round their last digits differently.
    elsewhere = {name: np.nextafter(values, np.inf) for name, values in dataset.protocols.items()}
    run = run_of(dataset, tmp_path, extra=dataclasses.replace(dataset, protocols=elsewhere))
    assert set(run.training[1][1]) == set(run.split.train)
    for name, value in (("modulus_ratio", 0.5), ("points_per_phase", (60, 20, 40))):
        with pytest.raises(ValueError, match="the extra data set must have the"):
            run_of(dataset, tmp_path, extra=dataclasses.replace(dataset, **{name: value}))
