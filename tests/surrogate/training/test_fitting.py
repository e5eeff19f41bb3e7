"""Training by `model.fit`: it learns, Keras's rules hold, and an interruption changes nothing."""

import dataclasses
import json
import shutil
import warnings

import h5py
import keras
import numpy as np
import pytest

import surrogate
import surrogate.training.fitting as fitting
from bem.dataset.sealed_file import arrays
from surrogate.prediction.predictor import ExtrapolationWarning
from surrogate.training.model_directory import MODEL_FILES, publish
from surrogate.training.recipe import Recipe
from surrogate.training.run_folder import BACKUP, COLUMNS, locked, print_epoch, set_aside
from surrogate.training.runs import Run, execute
from tests.surrogate.conftest import build_by, build_tiny, scenes
from tests.surrogate.training.short_runs import COSINE, StopAfter, history, recipe, weights

RULE = {"factor": 0.5, "patience": 2, "minimum_rate": 0.05, "stop_after": 9}
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


def watched(monkeypatch, method, note):
    """Let a callback of a user take notes of the model of every training, before the others do anything."""
    watch = type("Watch", (keras.callbacks.Callback,), {method: lambda self, *_, **__: note(self.model)})
    callbacks = fitting._callbacks
    monkeypatch.setattr(fitting, "_callbacks", lambda *given: [watch(), *callbacks(*given)])


@pytest.fixture(scope="module")
def on_a_plateau(dataset, tmp_path_factory):
    """A training to its plateau, of a model with dropout, and the folder it is in as `whole`."""
    folder = tmp_path_factory.mktemp("plateau")
    # A rate this large keeps the error from falling for long.
    run = run_of(dataset, folder, PLATEAU, epochs=60, rate=0.3)
    with pytest.MonkeyPatch.context() as patch:
        build_by(patch, build_tiny)
        return run, folder, execute(run, folder / "whole")


def require_same(one, other):
    assert history(one) == history(other)
    expected = weights(other)
    for name, value in weights(one).items():
        np.testing.assert_array_equal(value, expected[name], err_msg=name)


@pytest.mark.parametrize(("below", "before"), [(0.29, 0), pytest.param(0.1, 1, marks=pytest.mark.slow)])
def test_an_interrupted_training_on_a_plateau_is_the_same(below, before, on_a_plateau, tiny):
    """After an epoch of a lower rate; and as soon as the rate is halved, near its minimum, while the error stays."""
    run, folder, whole = on_a_plateau
    fallen = next(row["epoch"] for row in whole.history if row["learning_rate"] < below)
    parts = folder / f"parts-{below}"
    assert in_two_parts(run, parts, fallen - before).best_epoch == whole.best_epoch
    require_same(parts, folder / "whole")


@pytest.mark.slow
def test_steps_around_the_largest_force_weigh_more(dataset, tmp_path):
    force = np.zeros((2, 10, 1))
    force[0, 1], force[1, 6] = 1.0, 2.0
    weights = fitting.peak_weights(force, 4.0)
    np.testing.assert_allclose(weights[0], np.where(np.arange(10) <= 3, 5.0, 1.0) / 2.8)
    np.testing.assert_allclose(weights[1], np.where(np.abs(np.arange(10) - 6) <= 2, 5.0, 1.0) / 2.8)
    plain, hardly, much = (
        execute(run_of(dataset, tmp_path, table, epochs=1), tmp_path / f"{number}").best_mse
        for number, table in enumerate(("", "peak_weight = 1e-9\n", "peak_weight = 50.0\n"))
    )
    assert hardly == pytest.approx(plain, rel=1e-4)
    assert much != pytest.approx(plain, rel=1e-2)


@pytest.mark.parametrize(
    "table",
    [
        COSINE,
        "weight_average = 0.5\n",
        "dropout_until = 0.5\n",
        pytest.param("peak_weight = 4.0\n", marks=pytest.mark.slow),
    ],
)
def test_an_interrupted_training_is_the_same(table, least, dataset, tmp_path):
    run = run_of(dataset, tmp_path, table, epochs=4)
    assert execute(run, tmp_path / "whole").finished
    assert in_two_parts(run, tmp_path / "parts", 3).finished
    require_same(tmp_path / "parts", tmp_path / "whole")


def test_learning_rate_and_early_stopping_follow_keras(on_a_plateau):
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


@pytest.mark.parametrize("least_gain", [0.0, 10.0])
def test_the_least_gain_decides_what_a_plateau_is(least_gain, dataset, tiny, tmp_path):
    table = PLATEAU.replace("0.05", "0.001") + f"least_gain = {least_gain}\n"
    run = run_of(dataset, tmp_path, table, epochs=6, rate=0.01)
    execute(run, tmp_path / "run")
    rows = history(tmp_path / "run")
    rates = [row["learning_rate"] for row in rows]
    assert rates == pytest.approx(
        rates_by_hand([row["validation_mse"] for row in rows], 0.01, least_gain, 1e-3), rel=1e-6
    )
    assert (rates[-1] < rates[0]) == (least_gain == 10.0)


def test_validation_is_by_the_averaged_weights(least, dataset, tmp_path, monkeypatch):
    """By hand: Keras's moving average of the weights after each step, whose momentum the recipe sets."""
    seen = []

    def note(model):
        seen.append([keras.ops.convert_to_numpy(one).copy() for one in model.trainable_variables])

    watched(monkeypatch, "on_train_batch_end", note)
    progress = execute(run_of(dataset, tmp_path, "weight_average = 0.5\n", epochs=1), tmp_path / "run")
    momentum = 1.0 - 1.0 / (0.5 * len(seen))
    # Keras's average begins with the weights after the first step.
    average = seen[0]
    for step in seen[1:]:
        average = [momentum * one + (1.0 - momentum) * new for one, new in zip(average, step, strict=True)]
    found = surrogate.load(tmp_path / "run/model", backend="keras").model.get_weights()
    for one, expected in zip(found, average, strict=True):
        np.testing.assert_allclose(one, expected, atol=1e-5)
    metrics = json.loads((tmp_path / "run/model/metrics.json").read_text())
    assert metrics["validation"]["mse"]["mean"] == pytest.approx(progress.best_mse, rel=1e-4)


def test_dropout_ends_where_the_recipe_says_and_every_epoch_is_shuffled(least, dataset, tmp_path, monkeypatch):
    drawn = []

    def note(model):
        # What a layer has drawn moves its state on: the compiled step must really draw nothing any more.
        layers = [one for one in model._flatten_layers() if isinstance(one, keras.layers.Dropout)]
        drawn.append([(one.rate, *keras.ops.convert_to_numpy(one.seed_generator.state)) for one in layers])

    def shuffle(batches, epoch):
        shuffled.append(epoch)
        return in_order(batches, epoch)

    shuffled, in_order = [], fitting.Batches.shuffle
    monkeypatch.setattr(fitting.Batches, "shuffle", shuffle)
    watched(monkeypatch, "on_epoch_end", note)
    execute(run_of(dataset, tmp_path, "dropout_until = 0.5\n", epochs=4), tmp_path / "run")
    assert shuffled[-4:] == [0, 1, 2, 3]
    assert [layers[0][0] for layers in drawn] == [0.1, 0.1, 0.0, 0.0]
    assert drawn[0][0][1:] != drawn[1][0][1:] == drawn[2][0][1:] == drawn[3][0][1:]


def test_training_learns_and_a_finished_run_is_complete(tiny, dataset, tmp_path, capsys):
    run = run_of(dataset, tmp_path, COSINE, epochs=12)
    progress = execute(run, tmp_path / "run", report=print_epoch)
    seen = [line for line in capsys.readouterr().out.splitlines() if line.startswith("epoch ")]
    assert [line.split()[1] for line in seen] == [f"{epoch}/12" for epoch in range(1, 13)]
    assert seen[-1].endswith(", at most 0:00:00 left")
    first, *_, last = progress.history
    assert set(first) == {"epoch", *COLUMNS}
    assert last["train_mse"] < 0.5 * first["train_mse"]
    assert last["learning_rate"] < 1e-4

    folder = tmp_path / "models" / "M1-concat"
    publish(tmp_path / "run", folder)
    assert {path.name for path in folder.iterdir()} == set(MODEL_FILES)
    written = json.loads((folder / "run.json").read_text())
    assert written["dataset_sha256"] == dataset.sha256
    assert written["dataset_forces_sha256"] == dataset.forces_sha256
    assert written["versions"]["keras"] == keras.__version__
    assert (written["seed"], written["epochs"], written["backend"]) == (3, 12, keras.backend.backend())
    assert Recipe.load(folder / "recipe.toml") == run.recipe
    metrics = json.loads((folder / "metrics.json").read_text())
    assert metrics["validation"]["mse"]["mean"] == pytest.approx(progress.best_mse, rel=1e-4)
    loaded, test = surrogate.load(folder), run.split.test
    # Held-out protocols of so small a set leave its training ranges.
    warnings.simplefilter("ignore", ExtrapolationWarning)
    force = loaded.predict_history(*dataset.grid(test), scenes(dataset.protocols["tabor"][test]))
    error = np.mean((loaded.scaling.scale_force(force) - loaded.scaling.scale_force(dataset.force[test])) ** 2)
    assert metrics["test"]["mse"]["mean"] == pytest.approx(error, rel=1e-4)


def test_more_epochs_go_on_and_another_training_is_refused(least, dataset, tmp_path):
    run = run_of(dataset, tmp_path, PLATEAU, epochs=1, epochs_given=True)
    assert execute(run, tmp_path / "run").finished
    assert json.loads((tmp_path / "run/model/run.json").read_text())["ended_by"] == "--epochs"
    # What ends by its epochs alone goes on when more are asked for.
    more = execute(run_of(dataset, tmp_path, PLATEAU, epochs=2), tmp_path / "run")
    assert [row["epoch"] for row in more.history] == [1, 2]
    with pytest.raises(ValueError, match="at least 2 epochs"):
        execute(run, tmp_path / "run")
    other = Run("M1-concat", dataset, dataset.split(seed=1), run.recipe)
    with pytest.raises(ValueError, match=r"checkpoint of the same training.*of another split"):
        execute(other, tmp_path / "run")
    execute(run_of(dataset, tmp_path, "weight_average = 0.5\n", epochs=2), tmp_path / "paced", should_stop=StopAfter(1))
    with pytest.raises(ValueError, match=r"checkpoint of the same training.*of another recipe"):
        execute(run_of(dataset, tmp_path, "weight_average = 0.5\n", epochs=4), tmp_path / "paced")


def test_a_folder_in_use_is_refused_and_divergence_is_reported(least, dataset, tmp_path):
    run = run_of(dataset, tmp_path, rate=1e30)
    with locked(tmp_path / "run"), pytest.raises(ValueError, match=rf"Received: {tmp_path}/run, where another process"):
        execute(run, tmp_path / "run")
    with pytest.raises(FloatingPointError, match="diverged"):
        execute(run, tmp_path / "run")


def test_damaged_files_are_refused_and_the_older_backup_does_not_belong_to_the_progress(least, dataset, tmp_path):
    run = run_of(dataset, tmp_path, epochs=3)
    execute(run, tmp_path / "run", should_stop=StopAfter(2))
    for path in [path for path in (tmp_path / "run").rglob("*") if path.suffix in (".h5", ".json")]:
        content = path.read_bytes()
        for found in (content[:-1], bytes([content[0] ^ 1]) + content[1:]):
            path.write_bytes(found)
            with pytest.raises(ValueError, match=rf"remove {tmp_path}/run to train .*, which is damaged") as caught:
                execute(run, tmp_path / "run")
            assert path.name in str(caught.value) or path.parent.name == "backup"
            assert "\n" not in str(caught.value)
            if path.parent == tmp_path / "run":
                with pytest.raises(ValueError, match="which is damaged"):
                    set_aside(path.parent, run.identity)
        path.write_bytes(content)
    assert execute(run, tmp_path / "run").finished


def test_extra_trajectories_join_training_but_held_out_protocols_do_not(least, dataset, tmp_path):
    run = run_of(dataset, tmp_path, epochs=1, extra=dataset, label="large")
    execute(run, tmp_path / "run")
    written = json.loads((tmp_path / "run" / "model" / "run.json").read_text())
    assert (written["name"], written["architecture"]) == ("large", "M1-concat")
    assert written["training_trajectories"] == 48 + 48
    # Protocols compare equal although processors round their last digits differently.
    elsewhere = {name: np.nextafter(values, np.inf) for name, values in dataset.protocols.items()}
    extra = dataclasses.replace(dataset, protocols=elsewhere)
    assert set(run_of(dataset, tmp_path, extra=extra).training[1][1]) == set(run.split.train)
    for name, value in (("modulus_ratio", 0.5), ("points_per_phase", (60, 20, 40))):
        with pytest.raises(ValueError, match="Expected an extra data set with the"):
            run_of(dataset, tmp_path, extra=dataclasses.replace(dataset, **{name: value}))
