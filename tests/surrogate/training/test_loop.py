import csv
import dataclasses
import json
import os
import subprocess
import sys
import warnings

import keras
import numpy as np
import pytest

import surrogate
from surrogate.inference.predictor import ExtrapolationWarning, Surrogate
from surrogate.training.checkpoint import HISTORY_COLUMNS
from surrogate.training.recipe import Recipe
from surrogate.training.runs import Run, execute, extra_indices, publish
from tests.surrogate.conftest import build_by, build_least

COSINE = 'optimizer = "soap"\nweight_average = 0.5\ngradient_norm = 1.0\n[cosine]\nwarmup_epochs = 1\n'
PLATEAU = "[plateau]\nfactor = 0.5\npatience = 1\nminimum_rate = 1e-3\nstop_after = 3\n"


def recipe(tmp_path, table=COSINE, epochs=4, rate=1e-2):
    path = tmp_path / "recipe.toml"
    path.write_text(f'name = "test"\nseed = 3\nbatch_size = 20\nepochs = {epochs}\nlearning_rate = {rate}\n{table}')
    return Recipe.load(path)


def weights(folder):
    with np.load(folder / "checkpoint.npz") as stored:
        return {name: stored[name] for name in stored.files if name != "state"}


def history(folder):
    with (folder / "history.csv").open() as file:
        return [{k: float(v) for k, v in row.items() if "seconds" not in k} for row in csv.DictReader(file)]


class StopAfter:
    def __init__(self, epochs):
        self.left = epochs

    def __call__(self):
        self.left -= 1
        return self.left == 0


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


def test_packaged_recipes():
    paper, swift = Recipe.load("paper"), Recipe.load("swift")
    assert (paper.batch_size, paper.learning_rate, paper.epochs, paper.plateau.stop_after) == (8, 1e-4, 2000, 30)
    assert (paper.loop, swift.loop) == ("fit", None)
    assert (swift.optimizer, swift.batch_size, swift.learning_rate, swift.epochs) == ("soap", 64, 4e-3, 30)
    assert swift.with_overrides(epochs=3, seed=None).epochs == 3


def test_bad_recipes(tmp_path):
    with pytest.raises(FileNotFoundError, match="paper, swift"):
        Recipe.load("slow")
    path = tmp_path / "bad.toml"
    path.write_text("patience = 3")
    with pytest.raises(ValueError, match="patience"):
        Recipe.load(path)
    with pytest.raises(ValueError, match="seed=-1"):
        Recipe.load("swift").with_overrides(seed=-1)
    with pytest.raises(ValueError, match=r"Expected loop fit, or no such key\. Received: loop='own'"):
        Recipe.load("swift").with_overrides(loop="own")
    with pytest.raises(ValueError, match="at most one of loop and dropout_until"):
        Recipe.load("swift").with_overrides(loop="fit")
    with pytest.raises(ValueError, match="weight_average=2"):
        Recipe.load("swift").with_overrides(weight_average=2)
    with pytest.raises(ValueError, match="epochs=0"):
        Recipe.load("swift").with_overrides(epochs=0)
    with pytest.raises(ValueError, match="stop_after=0"):
        recipe(tmp_path, PLATEAU.replace("stop_after = 3", "stop_after = 0"))
    with pytest.raises(ValueError, match="dropout_until=2"):
        Recipe.load("swift").with_overrides(dropout_until=2)
    with pytest.raises(ValueError, match="Expected optimizer adam or soap"):
        Recipe.load("swift").with_overrides(optimizer="sgd")


WHOLE = 'name = "mine"\nseed = 0\nbatch_size = 8\nepochs = 3\nlearning_rate = 1e-3\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            'name = "mine"\npatience = 3\nspeed = 1\n',
            "Expected name, seed, batch_size, epochs, learning_rate, and optionally optimizer, gradient_norm, "
            "weight_average, dropout_until, loop, cosine, plateau, in a training recipe. Received: {} without seed, "
            "batch_size, epochs, learning_rate and with patience, speed",
        ),
        (
            f"{WHOLE}[plateau]\npatience = 3\n",
            "Expected factor, patience, minimum_rate, stop_after in the table [plateau]. Received: {} without factor, "
            "minimum_rate, stop_after",
        ),
        (
            f"{WHOLE}[cosine]\nwarm = 1\n",
            "Expected no keys but warmup_epochs in the table [cosine]. Received: {} with warm",
        ),
        (f"{WHOLE}cosine = 3\n", "Expected the table [cosine]. Received: 3 in {}"),
        (
            WHOLE.replace("8", '"eight"'),
            "Expected a whole number as batch_size in a training recipe. Received: 'eight' in {}",
        ),
        (
            WHOLE.replace("1e-3", "nan"),
            "Expected a finite number as learning_rate in a training recipe. Received: nan in {}",
        ),
        (
            WHOLE.replace("= 3", "= true"),
            "Expected a whole number as epochs in a training recipe. Received: True in {}",
        ),
        ("name = mine", "Expected a training recipe in TOML. Received: {} (Invalid value (at line 1, column 8))"),
        (
            "".join(f"key_{number} = 1\n" for number in range(10_000)) + WHOLE,
            "Expected name, seed, batch_size, epochs, learning_rate, and optionally optimizer, gradient_norm, "
            "weight_average, dropout_until, loop, cosine, plateau, in a training recipe. Received: {} with key_0, "
            "key_1, key_2, key_3, key_4 and 9995 more",
        ),
    ],
    ids=["keys", "plateau", "cosine", "no table", "text", "nan", "boolean", "no TOML", "many keys"],
)
def test_a_bad_recipe_is_one_sentence_that_names_what_is_allowed(text, said, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match="Expected") as refused:
        Recipe.load(path)
    assert str(refused.value) == said.format(path)


def test_a_recipe_of_any_name_is_read_back(tmp_path):
    (tmp_path / "mine.toml").write_text(WHOLE.replace('"mine"', "'my \"best\" \\ one'"))
    chosen = Recipe.load(tmp_path / "mine.toml")
    (tmp_path / "again.toml").write_text(chosen.to_toml())
    assert Recipe.load(tmp_path / "again.toml") == chosen


OTHER_BACKEND = """
import sys
import warnings
from pathlib import Path

import keras
import numpy as np
import surrogate
from surrogate.training import runs
from surrogate.data.dataset import TrajectoryDataset
from surrogate.training.recipe import Recipe

folder, dataset = Path(sys.argv[1]), TrajectoryDataset.load(sys.argv[2])


def started(name, features):
    # Every backend draws its own first weights.
    model = surrogate.build(name, features=features)
    model.load_weights(folder / "start.weights.h5")
    return model


runs.build = started
warnings.simplefilter("ignore")
for optimizer in ("adam", "soap"):
    recipe = Recipe.load("swift").with_overrides(epochs=1, batch_size=24, optimizer=optimizer)
    run = runs.Run("M3-FiLM", dataset, dataset.split(), recipe)
    place = folder / keras.backend.backend() / optimizer
    place.parent.mkdir(exist_ok=True)
    assert runs.execute(run, place).finished
    model = surrogate.load(place / "model", backend="keras")
    force = model.predict(*dataset.grid(run.split.test), tabor=dataset.protocols["tabor"][run.split.test])
    np.save(place / "scaled.npy", model.scaling.scale_force(force))
"""


@pytest.mark.parametrize("backend", ["torch", "jax"])
def test_two_steps_under_another_backend(backend, dataset, dataset_path, tmp_path):
    pytest.importorskip(backend)
    surrogate.build("M3-FiLM").save_weights(tmp_path / "start.weights.h5")
    names = (backend, "tensorflow")
    for name in names:
        subprocess.run(
            [sys.executable, "-c", OTHER_BACKEND, str(tmp_path), str(dataset_path)],
            env={**os.environ, "KERAS_BACKEND": name},
            check=True,
        )
    forces = {(name, how): np.load(tmp_path / name / how / "scaled.npy") for name in names for how in ("adam", "soap")}
    np.testing.assert_allclose(forces[backend, "adam"], forces["tensorflow", "adam"], rtol=0.0, atol=1e-5)
    # SOAP's second step is taken in bases of the first one's gradients alone, which span a part of the space only;
    # rounding decides the others' directions, so the steps have the same size but not the same digits.
    moved = np.abs(forces["tensorflow", "soap"] - forces["tensorflow", "adam"]).max()
    assert np.abs(forces[backend, "soap"] - forces["tensorflow", "soap"]).max() < 0.5 * moved
    runs = [json.loads((tmp_path / name / "soap" / "model" / "run.json").read_text()) for name in names]
    assert [run["backend"] for run in runs] == [*names]
