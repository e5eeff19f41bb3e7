"""The median of three seeds is published under the model's name, once, with what follows from its weights."""

import json
import os
import shutil
from dataclasses import replace

import numpy as np
import pytest

from bem.dataset.measurement_steps import measurement_grid
from experiments.paper.model_comparison import trained_otherwise
from experiments.seeds import median_seeds
from surrogate.data.dataset import TrajectoryDataset
from surrogate.inference.model_files import PUBLISHED
from surrogate.inference.predictor import Surrogate
from surrogate.training.identity import PUBLISHED_SEED, TrainingIdentity, read_identity
from surrogate.training.identity import trained_otherwise as reason
from surrogate.training.publishing import CARD_MARK
from surrogate.training.recipe import Recipe

ROOT = PUBLISHED.parent


@pytest.fixture
def tree(tmp_path):
    """The published M1-gated and its three seeds, and two seeds of another model."""
    for name in ("M1-gated", "M1-concat"):
        for number in range(3 if name == "M1-gated" else 2):
            place = f"seeds/{name}/seed-{number}"
            shutil.copytree(ROOT / place, tmp_path / place)
    shutil.copytree(ROOT / "models" / "M1-gated", tmp_path / "models" / "M1-gated")
    # The model as it was before any seed was published in its place.
    run = tmp_path / "models" / "M1-gated" / "run.json"
    content = json.loads(run.read_text(encoding="utf-8"))
    content.pop(PUBLISHED_SEED, None)
    run.write_text(json.dumps(content), encoding="utf-8")
    (run.parent / "README.md").write_text(f"A former model. {CARD_MARK}.", encoding="utf-8")
    # So that the median is not the seed of the other models.
    metrics = tmp_path / "seeds" / "M1-gated" / "seed-0" / "metrics.json"
    content = json.loads(metrics.read_text(encoding="utf-8"))
    content["test"]["mse"]["mean"] = 1e-2
    metrics.write_text(json.dumps(content), encoding="utf-8")
    # As of a checkout on a file system with times in whole seconds.
    for weights in tmp_path.glob("**/model.weights.h5"):
        os.utime(weights, (0, 0))
    return tmp_path


def publish(tree):
    median_seeds.study(ROOT / "dataset.h5", tree / "models", tree / "seeds")


def median_of(tree):
    """The seed whose mean test MSE lies between the two others'."""
    found = {}
    for path in tree.glob("seeds/M1-gated/*/metrics.json"):
        found[json.loads(path.read_text(encoding="utf-8"))["test"]["mse"]["mean"]] = path.parent
    return found[sorted(found)[1]]


def seed_with_split(seed, model):
    """The seed itself, which stands for no other."""
    shutil.copy(model / "split.json", seed)
    return seed


def test_the_median_seed_takes_the_place_of_the_model_and_stays(tree, monkeypatch, capsys):
    exported = []
    monkeypatch.setattr(
        median_seeds, "export", lambda folder: (exported.append(folder), (folder / "model.onnx").write_bytes(b"1"))
    )
    publish(tree)
    model, seed = tree / "models" / "M1-gated", median_of(tree)
    for name in ("model.weights.h5", "metrics.json", "scaling.json", "test_errors.csv", "history.csv", "recipe.toml"):
        assert (model / name).read_bytes() == (seed / name).read_bytes(), name
    assert not (model / "README.md").exists()
    run = json.loads((model / "run.json").read_text(encoding="utf-8"))
    assert (run["name"], run[PUBLISHED_SEED]) == ("M1-gated", seed.name)
    # All published models share one division.
    reference = replace(read_identity(ROOT / "models" / "M1-concat"), recipe=Recipe.load("swift").as_dict())
    assert read_identity(model).parts == reference.parts
    assert not (tree / "models" / "M1-concat").exists(), "two seeds have no median"
    # Its seed is another than the others', and it is compared with them and not trained again.
    found = {"M1-concat": reference, "M1-gated": read_identity(model)}
    assert found["M1-gated"].recipe["seed"] != reference.recipe["seed"]
    assert trained_otherwise(found, reference.dataset) == {}
    data = TrajectoryDataset.load(ROOT / "dataset.h5")
    wanted = TrainingIdentity.of("M1-gated", data, data.split(), Recipe.load("swift"))
    assert reason(model, wanted) == ""
    assert reason(seed_with_split(seed, model), wanted) == "of another recipe"
    assert "1 of 18 models are median seeds" in capsys.readouterr().out
    publish(tree)
    assert len(exported) == 1
    assert f"{seed.name} is published already" in capsys.readouterr().out
    # A fourth file that is missing is made again.
    (model / "model.onnx").unlink()
    publish(tree)
    assert len(exported) == 2


def test_a_seed_of_another_division_is_refused_and_nothing_lost(tree, monkeypatch):
    monkeypatch.setattr(median_seeds, "export", print)
    for path in tree.glob("seeds/M1-gated/*/test_errors.csv"):
        head, first, *rest = path.read_text(encoding="utf-8").splitlines()
        path.write_text("\n".join([head, "2," + first.split(",", 1)[1], *rest]) + "\n", encoding="utf-8")
    for path in tree.glob("seeds/M1-concat/*/run.json"):
        path.unlink()
    before = (tree / "models/M1-gated/model.weights.h5").read_bytes()
    with pytest.raises(ValueError, match="expected the test part"):
        publish(tree)
    assert (tree / "models/M1-gated/model.weights.h5").read_bytes() == before


@pytest.mark.slow
def test_the_exported_network_is_that_of_the_seed(tree):
    publish(tree)
    exported = Surrogate.load(tree / "models" / "M1-gated", backend="onnx")
    keras = Surrogate.load(tree / "models" / "M1-gated", backend="keras")
    protocol = {"tabor": 1.0, "peak_indentation": 10.0, "loading_rate": 10.0, "dwell_time": 0.5, "unloading_rate": 5.0}
    times, indentations = measurement_grid(**{name: np.array([value]) for name, value in protocol.items()})
    forces = [one.predict(times, indentations, tabor=np.array([1.0])) for one in (exported, keras)]
    np.testing.assert_allclose(*forces, rtol=1e-3, atol=1e-3)
