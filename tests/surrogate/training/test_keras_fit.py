"""Training by `model.fit`: Keras's rules hold, an interruption changes nothing, and the package's loop agrees."""

import json
import shutil

import h5py
import numpy as np
import pytest

from bem.dataset.hdf5_arrays import arrays
from surrogate.training.keras_fit import _backed_up
from surrogate.training.recipe import Recipe
from surrogate.training.runs import Run, execute
from tests.surrogate.training.short_runs import StopAfter, history

PLATEAU = {"factor": 0.5, "patience": 2, "minimum_rate": 1e-3, "stop_after": 4}
STEPS = 3


def run_of(dataset, tmp_path, *, fit=True, plateau=None, epochs=12, rate=1e-2, extra="", **given):
    table = "" if plateau is None else "[plateau]\n" + "".join(f"{key} = {value}\n" for key, value in plateau.items())
    path = tmp_path / "recipe.toml"
    loop = 'loop = "fit"\n' if fit else ""
    path.write_text(
        f'name = "test"\nseed = 3\nbatch_size = 20\nepochs = {epochs}\nlearning_rate = {rate}\n{loop}{extra}{table}'
    )
    return Run("M1-concat", dataset, dataset.split(), Recipe.load(path), **given)


def rates_by_hand(errors, rate):
    """Learning rates of the epochs by the documented rule of `ReduceLROnPlateau`, whose min_delta is 1e-4."""
    found, best, wait = [], np.inf, 0
    for error in errors:
        found.append(rate)
        better = error < best - 1e-4
        best, wait = (error, 0) if better else (best, wait + 1)
        if wait >= PLATEAU["patience"] and rate > PLATEAU["minimum_rate"]:
            rate, wait = max(rate * PLATEAU["factor"], PLATEAU["minimum_rate"]), 0
    return found


@pytest.fixture(scope="module")
def plateau_runs(dataset, tmp_path_factory):
    """A training to its plateau, undisturbed and in parts, of a model with dropout."""
    from tests.surrogate.conftest import build_by, build_tiny

    folder = tmp_path_factory.mktemp("fit")
    with pytest.MonkeyPatch.context() as patch:
        build_by(patch, build_tiny)
        # A rate this large keeps the error from falling for long.
        run = run_of(dataset, folder, plateau=PLATEAU, epochs=60, rate=0.3)
        whole = execute(run, folder / "whole")
        stopped = execute(run, folder / "parts", should_stop=StopAfter(3))
        assert (stopped.finished, stopped.epoch) == (False, 3)
        # As if the process had been killed after the curve was written, and before the backup was.
        log = folder / "parts" / "log.csv"
        log.write_text(log.read_text() + log.read_text().splitlines()[-1].replace("2,", "3,", 1) + "\n")
        parts = execute(run, folder / "parts")
    return folder, whole, parts


def test_an_interrupted_training_follows_the_same_curve(plateau_runs):
    folder, whole, parts = plateau_runs
    assert history(folder / "parts") == history(folder / "whole")
    assert parts.best_epoch == whole.best_epoch
    with (
        h5py.File(folder / "parts/model/model.weights.h5") as one,
        h5py.File(folder / "whole/model/model.weights.h5") as other,
    ):
        expected = dict(arrays(other))
        for path, item in arrays(one):
            np.testing.assert_array_equal(item[()], expected[path][()], err_msg=path)


def test_learning_rate_and_early_stopping_follow_keras(plateau_runs):
    folder, whole, _ = plateau_runs
    rows = history(folder / "whole")
    rates = [row["learning_rate"] for row in rows]
    assert rates == pytest.approx(rates_by_hand([row["validation_mse"] for row in rows], 0.3), rel=1e-6)
    assert rates[-1] < rates[0]
    assert whole.finished
    assert whole.epoch == whole.best_epoch + PLATEAU["stop_after"] < 60
    assert json.loads((folder / "whole/model/run.json").read_text())["ended_by"] == "recipe"


def test_the_best_weights_are_kept(plateau_runs):
    folder, whole, _ = plateau_runs
    metrics = json.loads((folder / "whole/model/metrics.json").read_text())
    assert metrics["validation"]["mse"]["mean"] == pytest.approx(whole.best_mse, rel=1e-4)
    assert [path.name for path in (folder / "whole/best").iterdir()] == [f"{whole.best_epoch:05d}.weights.h5"]


def test_averaged_weights_and_batches_are_those_of_the_packages_loop(dataset, tmp_path, monkeypatch):
    from tests.surrogate.conftest import build_by, build_lstm

    build_by(monkeypatch, build_lstm)
    average = "weight_average = 0.5\n"
    for fit, folder in ((False, tmp_path / "loop"), (True, tmp_path / "fit")):
        assert execute(run_of(dataset, tmp_path, fit=fit, epochs=4, extra=average), folder).finished
    run = run_of(dataset, tmp_path, epochs=4, extra=average)
    assert not execute(run, tmp_path / "parts", should_stop=StopAfter(2)).finished
    assert execute(run, tmp_path / "parts").finished
    assert history(tmp_path / "parts") == history(tmp_path / "fit")
    for ours, theirs in zip(history(tmp_path / "fit"), history(tmp_path / "loop"), strict=True):
        assert ours == pytest.approx(theirs, rel=1e-4)


def test_a_training_cut_by_its_epochs_says_so_and_another_one_is_refused(tiny, dataset, tmp_path):
    run = run_of(dataset, tmp_path, epochs=1, plateau=PLATEAU, epochs_given=True)
    assert execute(run, tmp_path / "run").finished
    assert json.loads((tmp_path / "run/model/run.json").read_text())["ended_by"] == "--epochs"
    # What ends by its epochs alone goes on when more are asked for.
    more = execute(run_of(dataset, tmp_path, epochs=2, plateau=PLATEAU), tmp_path / "run")
    assert [row["epoch"] for row in more.history] == [1, 2]
    with pytest.raises(ValueError, match="at least 2 epochs"):
        execute(run, tmp_path / "run")
    other = Run("M1-concat", dataset, dataset.split(seed=1), run.recipe)
    with pytest.raises(ValueError, match=r"checkpoint of the same training.*of another split"):
        execute(other, tmp_path / "run")


@pytest.mark.filterwarnings("ignore:.*log.csv:pytest.PytestUnraisableExceptionWarning")
def test_divergence_is_reported(tiny, dataset, tmp_path):
    with pytest.raises(FloatingPointError, match="diverged"):
        execute(run_of(dataset, tmp_path, rate=1e30), tmp_path / "run")


def test_the_newer_complete_backup_is_used(plateau_runs, tmp_path):
    folder, whole, _ = plateau_runs
    steps = STEPS

    def backup():
        shutil.rmtree(tmp_path / "backup", ignore_errors=True)
        return shutil.copytree(folder / "whole" / "backup", tmp_path / "backup")

    assert _backed_up(backup(), steps) == whole.epoch
    for damage in ("weights cut", "count cut", "count not written"):
        place = backup()
        weights, told = place / "latest.weights.h5", place / "training_metadata.json"
        if damage == "weights cut":
            weights.write_bytes(weights.read_bytes()[:3000])
        elif damage == "count cut":
            told.write_text("")
        else:
            told.write_text(json.dumps({"epoch": whole.epoch - 1, "batch": 0}))
        assert _backed_up(place, steps) == whole.epoch - 1, damage
        assert _backed_up(place, steps) == whole.epoch - 1, "the older one has taken its place"
    place = backup()
    for path in place.iterdir():
        path.write_bytes(b"")
    assert _backed_up(place, steps) == 0
    assert not place.exists()
