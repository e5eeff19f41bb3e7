"""A training counts as done only when it comes from what is asked for."""

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bem"))

import campaign_stand_in as stand_in

from bem.campaign import run_campaign
from bem.campaign_plan import Campaign
from experiments import data_efficiency, trainings
from experiments.trainings import Variant, is_trained
from surrogate.dataset import TrajectoryDataset


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "dataset.h5"
    run_campaign(Campaign(count=40, seed=2), path, solver=stand_in.solve)
    return path


@pytest.fixture
def data(path):
    return TrajectoryDataset.load(path)


def write_training(folder, variant, data):
    """The parts of a model directory that say where it comes from."""
    from surrogate.recipe import Recipe

    folder.mkdir(parents=True)
    data.split().with_fraction(variant.fraction, variant.fold).save(folder / "split.json")
    recipe = Recipe.load(variant.recipe).with_overrides(epochs=variant.epochs or None)
    (folder / "recipe.toml").write_text(recipe.to_toml(), encoding="utf-8")
    run = {"dataset_sha256": data.sha256, "backend": "tensorflow"}
    run |= {"features": variant.features, "architecture": variant.architecture}
    (folder / "run.json").write_text(json.dumps(run), encoding="utf-8")


VARIANT = Variant(label="half", architecture="M1-concat", recipe="swift", epochs=35, fraction=0.5, fold=1)


def test_a_training_is_done_when_it_comes_from_what_is_asked_for(tmp_path, data):
    assert not is_trained(VARIANT, data, tmp_path / "half")
    write_training(tmp_path / "half", VARIANT, data)
    assert is_trained(VARIANT, data, tmp_path / "half")


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"epochs": 110}, "recipe"),
        ({"recipe": "paper"}, "recipe"),
        ({"fold": 2}, "split"),
        ({"fraction": 0.25}, "split"),
        ({"features": "A"}, "feature set"),
        ({"architecture": "M4-FiLM"}, "architecture"),
    ],
)
def test_a_training_of_something_else_is_refused(change, word, tmp_path, data):
    write_training(tmp_path / "half", Variant(**(vars(VARIANT) | change)), data)
    with pytest.raises(ValueError, match=f"received one of another {word}: remove .* to train it anew"):
        is_trained(VARIANT, data, tmp_path / "half")


def test_a_training_on_another_data_set_is_refused(tmp_path, data, path):
    write_training(tmp_path / "models" / "half", VARIANT, data)
    run = tmp_path / "models" / "half" / "run.json"
    run.write_text(run.read_text(encoding="utf-8").replace(data.sha256, "0" * 64), encoding="utf-8")
    with pytest.raises(ValueError, match="another data set"):
        trainings.train_variants([VARIANT], dataset=path, work=tmp_path, jobs=1)


def test_the_model_of_the_whole_part_must_be_trained_as_the_shares(tmp_path, data):
    config = {"architecture": "M1-concat", "recipe": "swift"}
    with pytest.raises(FileNotFoundError, match="make models ONLY=M1-concat"):
        data_efficiency.whole_part(config, data, tmp_path)
    other = Variant(label="M1-concat", architecture="M1-concat", recipe="paper")
    write_training(tmp_path / "M1-concat", other, data)
    (tmp_path / "M1-concat" / "metrics.json").write_text(
        json.dumps(
            {
                "parameters": 1,
                "epochs": 2,
                "best_epoch": 1,
                "cpu_seconds": 1.0,
                "test": {name: {"mean": 0.1} for name in ("mse", "mae", "dtw_rmse")},
            }
        ),
        encoding="utf-8",
    )
    (tmp_path / "M1-concat" / "history.csv").write_text(
        "epoch,train_mse,validation_mse,cpu_seconds\n1,0.1,0.1,1\n", encoding="utf-8"
    )
    run = tmp_path / "M1-concat" / "run.json"
    content = json.loads(run.read_text(encoding="utf-8")) | {"versions": {}, "training_trajectories": 32}
    run.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(ValueError, match="another recipe"):
        data_efficiency.whole_part(config, data, tmp_path)
