import json
from dataclasses import replace

import numpy as np
import pytest

from bem import LoadingProtocol
from surrogate.data.scaling import symlog
from surrogate.prediction.loading import load_banded
from tests.physical_data import physical_dataset
from tests.surrogate.prediction.conftest import SCENE

pretrained = pytest.importorskip("surrogate.training.pretrained")
COUNT = 160
RECIPE = replace(pretrained.RECIPES["accurate"], epochs=1, batch_size=16)

PROTOCOL = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
ELASTIC = {"modulus_ratio": np.full(COUNT, 1.0)}


def train(data, folder, recipe=RECIPE, held_out=(16, 40), name="fast", **given):
    return pretrained.train_model(name, (6,), recipe, data, folder, held_out=held_out, **given)


def assert_streams(model, own):
    """A stream of `model` has the forces that `own` predicts."""
    predicted, stream = own.predict(SCENE, PROTOCOL), model.stream(SCENE)
    edge = np.isin(np.arange(102), [21, 29])
    np.testing.assert_allclose(stream.run(predicted.time, predicted.indentation, edge), predicted.force, rtol=1e-4)


@pytest.fixture(scope="module")
def data():
    """Any forces that depend on the inputs and have a peak: the solver's are not needed to go through the motions."""
    box = physical_dataset(COUNT)
    return pretrained.Data(box, replace(box, sha256="1" * 64), replace(box, sha256="2" * 64), box, box, box)


def test_a_trained_model_is_ready_to_use_and_resumed_not_repeated(data, tmp_path):
    folder = train(data, tmp_path, command="some")
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
    train(data, tmp_path, command="some", report=seen.append)
    assert seen == []
    assert (folder / "model.onnx").read_bytes() == before
    with pytest.raises(ValueError, match="Received: a checkpoint of another recipe"):
        train(data, tmp_path, replace(RECIPE, epochs=2))
    pretrained.calibrate_published(folder, replace(data.elastic, protocols={**data.elastic.protocols, **ELASTIC}))
    again = load_banded(folder).bands.quantiles
    np.testing.assert_array_equal(again[:, :-1], model.bands.quantiles[:, :-1])
    assert np.all(again[:, -1, 0] != model.bands.quantiles[:, -1, 0])


@pytest.mark.parametrize("name", ["fast", "accurate"])
def test_training_goes_on_from_the_weights_of_a_model(data, tmp_path, name):
    first = train(data, tmp_path / "first", name=name)
    ((network, _),) = pretrained.members_of(first)
    model = load_banded(first)
    sequence, tabor = np.random.default_rng(0).normal(size=(2, 102, 12)).astype("f4"), np.ones((2, 1), "f4")
    np.testing.assert_allclose(network([sequence, tabor])[..., 0], model.network.scaled(sequence, tabor), atol=1e-5)
    again = train(data, tmp_path / "again", replace(RECIPE, learning_rate=1e-9), name=name, start=first)
    old, new = (pretrained.members_of(path)[0][0].get_weights() for path in (first, again))
    for one, other in zip(old, new, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-6)
    assert json.loads((again / "run.json").read_text())["members"][0]["start_sha256"]


@pytest.mark.parametrize("name", ["fast", "accurate"])
def test_a_network_beside_published_ones_makes_the_model_their_mean(data, tmp_path, name):
    first = train(data, tmp_path / "first", name=name)
    both = train(data, tmp_path / "both", replace(RECIPE, learning_rate=1e-9), name=name, beside=first)
    given = np.random.default_rng(0).normal(size=(2, 102, 12)).astype("f4"), np.ones((2, 1), "f4")
    forces = [np.asarray(network(list(given)))[..., 0] for network, _ in pretrained.members_of(both)]
    model = load_banded(both)
    assert np.ptp(forces, axis=0).max() > 1e-3
    np.testing.assert_allclose(np.mean(forces, axis=0), model.network.scaled(*given), atol=1e-5)
    np.testing.assert_allclose(forces[0], load_banded(first).network.scaled(*given), atol=1e-5)
    members = json.loads((both / "run.json").read_text())["members"]
    assert [one["recipe"]["seed"] for one in members] == [0, 1]
    if name == "accurate":
        assert_streams(model, model)


def test_a_mean_with_networks_of_another_model_has_their_forces_and_streams_its_own(data, tmp_path):
    other = replace(data.box, protocols={**data.box.protocols, "tabor": 1.1 * data.box.protocols["tabor"]})
    dense = train(replace(data, box=other), tmp_path / "dense")
    recurrent = train(data, tmp_path / "recurrent", name="accurate")
    mixed = train(data, tmp_path / "mixed", None, name="accurate", beside=recurrent, mixed=dense)
    fast, slow, mean = (load_banded(path) for path in (dense, recurrent, mixed))
    assert fast.scaling.tabor != slow.scaling.tabor
    parts = [symlog(one.predict(SCENE, PROTOCOL).force) for one in (fast, slow, mean)]
    np.testing.assert_allclose(0.5 * (parts[0] + parts[1]), parts[2], atol=1e-5)
    assert_streams(mean, slow)
    kinds = [one["layers"] for one in json.loads((mixed / "run.json").read_text())["members"]]
    assert kinds == ["LSTM", "dense"]
    again = train(data, tmp_path / "again", None, name="accurate", beside=mixed, mixed=dense)
    np.testing.assert_allclose(symlog(load_banded(again).predict(SCENE, PROTOCOL).force), parts[2], atol=1e-6)


def test_a_network_of_the_whole_history_does_not_stream(data, tmp_path):
    model = load_banded(train(data, tmp_path))
    with pytest.raises(ValueError, match=r"Expected a causal model, .*; use `predict`. Received: fast, which needs"):
        model.stream(SCENE)


def test_other_data_sets_are_refused(data, tmp_path):
    with pytest.raises(ValueError, match=r"physical steps and a range of modulus ratios"):
        replace(data, edges=replace(data.box, steps="uniform"))
    with pytest.raises(ValueError, match=r"a box of more than 1000 trajectories. Received: 160"):
        train(data, tmp_path, held_out=(500, 500))
