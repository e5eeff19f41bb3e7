import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from bem import LoadingProtocol
from surrogate.files import PUBLISHED_BANDED
from surrogate.loading import load_banded
from tests.physical_data import physical_dataset
from tests.surrogate.conftest import SCENE

pretrained = pytest.importorskip("surrogate.training.pretrained")
COUNT = 160
# The step of Adam compiles in a fraction of the time that SOAP's takes.
RECIPE = replace(pretrained.RECIPES["LSTM"], epochs=1, batch_size=16, optimizer="adam")
DENSE, LSTM = ("dense", (6,)), ("LSTM", (6,))

PROTOCOL = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
ELASTIC = {"modulus_ratio": np.full(COUNT, 1.0)}


def train(data, folder, recipe=RECIPE, held_out=(16, 40), networks=(DENSE,), **given):
    recipes = {kind: recipe for kind, _ in networks if recipe}
    return pretrained.train_model("fast", networks, recipes, data, folder, held_out=held_out, **given)


@pytest.fixture(scope="module")
def data():
    """Any forces that depend on the inputs and have a peak: the solver's are not needed to go through the motions."""
    box = physical_dataset(COUNT)
    return pretrained.Data(box, replace(box, sha256="1" * 64), replace(box, sha256="2" * 64), box, box, box)


@pytest.fixture(scope="module")
def runs(data, tmp_path_factory):
    """The folder of a training of one network of dense layers, with its model in `fast`."""
    folder = tmp_path_factory.mktemp("runs")
    train(data, folder, command="some")
    return folder


def test_dense_networks_read_eight_steps():
    # Of the 72 points of unloading, 16 lie before the crossing of zero.
    assert pretrained.telling_steps((22, 8, 72)) == [10, 21, 25, 29, 37, 45, 64, 101]


def test_trained_model_loads_and_is_resumed(data, runs, tmp_path):
    runs = shutil.copytree(runs, tmp_path / "runs")
    folder = runs / "fast"
    model = load_banded(folder)
    found = model.predict(SCENE, PROTOCOL)
    assert np.isfinite(found.force).all()
    assert np.isfinite(found.hysteresis_interval).all()
    assert found.pull_off_interval[0] < found.pull_off_force < found.pull_off_interval[1]
    run = json.loads((folder / "run.json").read_text())
    assert (run["members"][0]["units"], run["counts"], run["members"][0]["command"]) == ([6], [22, 8, 72], "some")
    assert run["training_trajectories"] == COUNT - 56 + 3 * COUNT
    assert run["calibration_trajectories"] == 40 + 2 * COUNT
    before = (folder / "model.onnx").read_bytes()
    seen = []
    train(data, runs, command="some", report=seen.append)
    assert seen == []
    assert (folder / "model.onnx").read_bytes() == before
    with pytest.raises(ValueError, match="received a checkpoint of another recipe"):
        train(data, runs, replace(RECIPE, epochs=2))
    pretrained.calibrate_published(folder, replace(data.elastic, protocols={**data.elastic.protocols, **ELASTIC}))
    again = load_banded(folder).bands.quantiles
    np.testing.assert_array_equal(again[:, :-1], model.bands.quantiles[:, :-1])
    assert np.all(again[:, -1, 0] != model.bands.quantiles[:, -1, 0])


def test_training_starts_from_given_weights(data, runs, tmp_path):
    (network, _), *_ = pretrained.members_of(runs / "fast")
    again = train(data, tmp_path, replace(RECIPE, learning_rate=1e-9), start=runs / "fast")
    ((same, record),) = pretrained.members_of(again)
    for one, other in zip(network.get_weights(), same.get_weights(), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)
    assert record["start_sha256"]


def test_a_model_is_the_mean_of_its_networks(data, tmp_path):
    networks = (LSTM, DENSE)
    folder = train(data, tmp_path / "all", networks=networks)
    model, given = load_banded(folder), np.random.default_rng(0).normal(size=(2, 102, 12)).astype("f4")
    tabor = np.ones((2, 1), "f4")
    forces = [np.asarray(network([given, tabor]))[..., 0] for network, _ in pretrained.members_of(folder)]
    assert np.ptp(forces, axis=0).max() > 1e-3
    np.testing.assert_allclose(np.mean(forces, axis=0), model.network.scaled(given, tabor), atol=1e-5)
    members = json.loads((folder / "run.json").read_text())["members"]
    assert [(one["layers"], one["recipe"]["seed"]) for one in members] == [("LSTM", 0), ("dense", 1)]
    predicted = model.predict(SCENE, PROTOCOL)
    again = load_banded(train(data, tmp_path / "again", None, networks=networks, start=folder))
    np.testing.assert_array_equal(again.predict(SCENE, PROTOCOL).force, predicted.force)
    alone = load_banded(train(data, tmp_path / "alone", None, networks=(LSTM,), start=folder))
    assert np.abs(alone.predict(SCENE, PROTOCOL).force - predicted.force).max() > 1e-3


def test_start_of_other_networks_is_refused(data, runs, tmp_path):
    with pytest.raises(ValueError, match=r"--start must hold the networks \[\('dense', \(6,\)\)\]; received none"):
        train(data, tmp_path, None)
    for networks in ((LSTM,), (("dense", (7,)),), (DENSE, DENSE)):
        with pytest.raises(ValueError, match=r"received \[\('dense', \(6,\)\)\]"):
            train(data, tmp_path / "again", networks=networks, start=runs / "fast")
    assert not (tmp_path / "again").exists()


def test_published_networks_are_the_stated():
    for name, networks in pretrained.NETWORKS.items():
        run = json.loads((PUBLISHED_BANDED / name / "run.json").read_text())
        assert [(one["layers"], tuple(one["units"])) for one in run["members"]] == list(networks)
        assert {kind for kind, _ in networks} <= pretrained.RECIPES.keys()


def test_unread_steps_do_not_matter(runs):
    model = load_banded(runs / "fast")
    assert len(model.network.steps) == 8
    found = model.predict(SCENE, PROTOCOL).force
    model.network.steps = slice(None)
    np.testing.assert_array_equal(model.predict(SCENE, PROTOCOL).force, found)


def test_other_data_sets_are_refused(data, tmp_path):
    with pytest.raises(ValueError, match=r"physical steps and a range of modulus ratios"):
        replace(data, edges=replace(data.box, steps="uniform"))
    with pytest.raises(ValueError, match="the box must hold more than 1000 trajectories; received 160"):
        train(data, tmp_path, held_out=(500, 500))
