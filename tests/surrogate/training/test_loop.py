import dataclasses
import json
import warnings

import keras
import numpy as np
import pytest

from surrogate.inference.predictor import ExtrapolationWarning, Surrogate
from surrogate.training.checkpoint import HISTORY_COLUMNS
from surrogate.training.recipe import Recipe
from surrogate.training.runs import Run, execute, extra_indices, publish
from tests.surrogate.conftest import build_by, build_least
from tests.surrogate.training.short_runs import COSINE, PLATEAU, StopAfter, history, recipe, weights


def undisturbed(dataset, folder, table):
    """A run to its end, and where it was written."""
    # A rate this large makes the plateau rule act within a few epochs.
    chosen = recipe(folder, table) if table == COSINE else recipe(folder, table, epochs=6, rate=1.0)
    run = Run("M1-concat", dataset, dataset.split(), chosen)
    with pytest.MonkeyPatch.context() as patch:
        build_by(patch, build_least)
        assert execute(run, folder / "whole").finished
    return run, folder / "whole"


@pytest.fixture(scope="module")
def on_a_plateau(dataset, tmp_path_factory):
    return undisturbed(dataset, tmp_path_factory.mktemp("plateau"), PLATEAU)


@pytest.mark.parametrize("table", [COSINE, PLATEAU], ids=["cosine", "plateau"])
def test_interrupted_and_undisturbed_runs_agree(least, dataset, tmp_path, table, on_a_plateau):
    run, whole = on_a_plateau if table == PLATEAU else undisturbed(dataset, tmp_path, table)
    parts = tmp_path / "parts"
    if table == PLATEAU:
        assert history(whole)[-1]["learning_rate"] < 0.6 * run.recipe.learning_rate
    stopped = execute(run, parts, should_stop=StopAfter(2))
    assert (stopped.finished, stopped.epoch) == (False, 2)
    assert not (parts / "model").exists()
    assert execute(run, parts).finished

    reference = weights(whole)
    assert history(parts) == history(whole)
    for name, value in weights(parts).items():
        np.testing.assert_array_equal(value, reference[name], err_msg=name)


def test_a_run_goes_on_when_asked_for_more_epochs_where_they_only_say_when_it_ends(
    least, dataset, tmp_path, on_a_plateau
):
    def run(table, epochs):
        return Run("M1-concat", dataset, dataset.split(), recipe(tmp_path, table, epochs=epochs, rate=1.0))

    # The rate shrinks after the second epoch: also where that is the last one asked for at first.
    _, whole = on_a_plateau
    parts, paced = tmp_path / "parts", tmp_path / "paced"
    for epochs in (2, 4):
        progress = execute(run(PLATEAU, epochs), parts)
        assert (progress.finished, progress.epoch) == (True, epochs)
        assert json.loads((parts / "model" / "metrics.json").read_text())["epochs"] == epochs
    assert history(parts) == history(whole)[:4]
    assert history(whole)[2]["learning_rate"] < history(whole)[1]["learning_rate"]
    with pytest.raises(ValueError, match="at least 4 epochs"):
        execute(run(PLATEAU, 3), parts)

    averaged = "weight_average = 0.5\n"
    execute(run(averaged, 2), paced, should_stop=StopAfter(1))
    with pytest.raises(ValueError, match=r"checkpoint of the same training.*of another recipe"):
        execute(run(averaged, 4), paced)


def test_training_learns_and_a_finished_run_is_complete(tiny, dataset, tmp_path):
    run = Run("M1-concat", dataset, dataset.split(), recipe(tmp_path, epochs=12))
    seen = []
    progress = execute(run, tmp_path / "run", report=seen.append, command="surrogate train M1-concat")
    assert [epoch.row["epoch"] for epoch in seen] == list(range(1, 13))
    assert seen[-1].seconds_left == 0
    assert set(seen[0].row) == set(HISTORY_COLUMNS)
    assert seen[-1].row["train_mse"] < 0.5 * seen[0].row["train_mse"]
    assert seen[-1].row["learning_rate"] < 1e-4

    publish(tmp_path / "run", tmp_path / "models" / "M1-concat")
    folder = tmp_path / "models" / "M1-concat"
    assert {path.name for path in folder.iterdir()} == {
        "model.weights.h5",
        "model.onnx",
        "scaling.json",
        "split.json",
        "history.csv",
        "metrics.json",
        "test_errors.csv",
        "recipe.toml",
        "run.json",
    }
    written = json.loads((folder / "run.json").read_text())
    assert written["dataset_sha256"] == dataset.sha256
    assert written["dataset_forces_sha256"] == dataset.forces_sha256
    assert written["versions"]["keras"] == keras.__version__
    assert (written["seed"], written["epochs"], written["backend"]) == (3, 12, keras.backend.backend())
    assert Recipe.load(folder / "recipe.toml") == run.recipe
    metrics = json.loads((folder / "metrics.json").read_text())
    assert metrics["validation"]["mse"]["mean"] == pytest.approx(progress.best_mse, rel=1e-4)
    loaded = Surrogate.load(folder)
    times, indentations = dataset.grid(run.split.test)
    # Held-out protocols of so small a set leave its training ranges.
    warnings.simplefilter("ignore", ExtrapolationWarning)
    force = loaded.predict(times, indentations, tabor=dataset.protocols["tabor"][run.split.test])
    error = np.mean(
        (loaded.scaling.scale_force(force) - loaded.scaling.scale_force(dataset.force[run.split.test])) ** 2
    )
    assert metrics["test"]["mse"]["mean"] == pytest.approx(error, rel=1e-4)


def test_checkpoint_of_another_run_is_refused(least, dataset, tmp_path):
    run = Run("M1-concat", dataset, dataset.split(), recipe(tmp_path, table=""))
    execute(run, tmp_path / "run", should_stop=StopAfter(1))
    other = Run("M1-concat", dataset, dataset.split(seed=1), run.recipe)
    with pytest.raises(ValueError, match=r"checkpoint of the same training.*of another split"):
        execute(other, tmp_path / "run")


def test_extra_trajectories_join_training_but_held_out_protocols_do_not(least, dataset, tmp_path):
    run = Run("M1-concat", dataset, dataset.split(), recipe(tmp_path, table="", epochs=1), extra=dataset, label="large")
    execute(run, tmp_path / "run")
    written = json.loads((tmp_path / "run" / "model" / "run.json").read_text())
    assert (written["name"], written["architecture"]) == ("large", "M1-concat")
    assert written["training_trajectories"] == 48 + 48


@pytest.mark.parametrize(("name", "value"), [("modulus_ratio", 0.5), ("points_per_phase", (60, 20, 40))])
def test_extra_trajectories_are_of_the_same_material_and_steps(dataset, tmp_path, name, value):
    other = dataclasses.replace(dataset, **{name: value})
    with pytest.raises(ValueError, match="Expected an extra data set with the"):
        Run("M1-concat", dataset, dataset.split(), recipe(tmp_path, epochs=1), extra=other)


def test_held_out_protocols_are_known_by_all_but_their_last_digits(dataset, tmp_path):
    elsewhere = {name: np.nextafter(values, np.inf) for name, values in dataset.protocols.items()}
    run = Run(
        "M1-concat",
        dataset,
        dataset.split(),
        recipe(tmp_path, epochs=1),
        extra=dataclasses.replace(dataset, protocols=elsewhere),
    )
    assert set(extra_indices(run)) == set(run.split.train)


def test_dropout_ends_where_the_recipe_says_also_after_a_resumption(least, dataset, tmp_path, monkeypatch):
    import surrogate.training.loop as training

    seen = []
    trained = training._train_epoch

    def watched(model, *arguments):
        loss = trained(model, *arguments)
        layers = [one for one in model._flatten_layers() if isinstance(one, keras.layers.Dropout)]
        # What a layer has drawn moves its state on: the compiled step must really draw nothing any more.
        seen.append([(one.rate, *keras.ops.convert_to_numpy(one.seed_generator.state).tolist()) for one in layers])
        return loss

    monkeypatch.setattr(training, "_train_epoch", watched)
    chosen = recipe(tmp_path, "dropout_until = 0.5\n", epochs=4)
    run = Run("M4-concat", dataset, dataset.split(), chosen)
    execute(run, tmp_path / "whole")
    assert [{rate for rate, *_ in layers} for layers in seen] == [{0.1}, {0.1}, {0.0}, {0.0}]
    drawn = [[state for _, *state in layers] for layers in seen]
    assert drawn[0] != drawn[1] == drawn[2] == drawn[3]
    execute(run, tmp_path / "parts", should_stop=StopAfter(3))
    execute(run, tmp_path / "parts")
    assert history(tmp_path / "parts") == history(tmp_path / "whole")


def test_divergence_is_reported(least, dataset, tmp_path):
    run = Run("M1-concat", dataset, dataset.split(), recipe(tmp_path, table="", rate=1e30))
    with pytest.raises(FloatingPointError, match="diverged"):
        execute(run, tmp_path / "run")
