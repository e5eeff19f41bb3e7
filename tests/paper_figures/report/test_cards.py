import hashlib
import json
from pathlib import Path

import numpy as np
import onnx
import pytest

from bem.dataset.file import load_dataset
from paper_figures.report import cards
from surrogate.training.model_directory import CARD_MARK

PUBLISHED = Path("published")
RUN = {
    "architecture": "M1-concat",
    "features": "D",
    "training_trajectories": 64,
    "seed": 7,
    "epochs": 3,
    "best_epoch": 2,
    "command": "surrogate train M1-concat",
    "extra_dataset_sha256": None,
}


@pytest.fixture
def published(dataset_path, tmp_path):
    """A data set, and a model whose pull-off force errs by the Tabor parameter in percent."""
    path = tmp_path / "dataset.h5"
    path.write_bytes(dataset_path.read_bytes())
    dataset = load_dataset(path)
    folder = tmp_path / "models" / "M1-concat"
    folder.mkdir(parents=True)
    (folder / "run.json").write_text(json.dumps(RUN))
    (folder / "recipe.toml").write_text('name = "swift"\n')
    (folder / "metrics.json").write_text('{"parameters": 473729}')
    rows = [3, 5, 40, 77]
    lines = ["trajectory,mse,pull_off_force_percent,hysteresis_percent,resolution_floor_percent"]
    lines += [f"{row},1e-5,{dataset.protocols['tabor'][row]},2.0,0.5" for row in rows]
    (folder / "test_errors.csv").write_text("\n".join(lines))
    return tmp_path, np.sort(dataset.protocols["tabor"][rows])


def test_a_card_lists_the_errors_of_the_trajectories_of_each_region(published):
    folder, tabor = published
    cards.main(folder)
    text = (folder / "models" / "M1-concat" / "README.md").read_text()
    everything = next(line for line in text.splitlines() if line.startswith("| all |"))
    assert everything.split(" | ")[1:] == ["4", "1.0e-05", cards.spread(tabor), "2 / 2 |"]
    low = next(line for line in text.splitlines() if line.startswith("| Tabor parameter 0.2 to 1 |"))
    assert low.split(" | ")[1] == str(np.count_nonzero(tabor < 1.0))
    assert low.split(" | ")[3] == cards.spread(tabor[tabor < 1.0])
    assert "64 trajectories" in text
    assert CARD_MARK in " ".join(text.split())
    assert "another data set" not in text


def test_a_card_says_that_a_model_learned_from_more_than_the_published_data(published):
    folder, _ = published
    run = folder / "models" / "M1-concat" / "run.json"
    run.write_text(json.dumps(RUN | {"extra_dataset_sha256": "ab"}))
    cards.main(folder)
    assert "another data set" in run.with_name("README.md").read_text()


def test_the_metadata_name_the_file_by_its_sum(published):
    folder, _ = published
    cards.main(folder)
    metadata = json.loads((folder / cards.METADATA).read_text())
    (file,) = metadata["distribution"]
    assert file["sha256"] == hashlib.sha256((folder / file["contentUrl"]).read_bytes()).hexdigest()
    assert metadata["description"].startswith("80 force histories")


def test_the_published_metadata_are_of_the_published_file():
    metadata = json.loads((PUBLISHED / cards.METADATA).read_text())
    (file,) = metadata["distribution"]
    assert file["sha256"] == hashlib.sha256((PUBLISHED / file["contentUrl"]).read_bytes()).hexdigest()


def test_the_metadata_are_valid_croissant(published):
    croissant = pytest.importorskip("mlcroissant")
    folder, _ = published
    cards.main(folder)
    found = croissant.Dataset(jsonld=str(folder / cards.METADATA)).metadata
    assert (found.ctx.issues.errors, found.ctx.issues.warnings) == (set(), set())
    broken = json.loads((folder / cards.METADATA).read_text())
    del broken["distribution"][0]["contentUrl"]
    with pytest.raises(croissant.ValidationError):
        croissant.Dataset(jsonld=broken)


def test_the_card_of_the_data_set_states_its_extent(published):
    folder, _ = published
    cards.main(folder)
    text = (folder / cards.CARD).read_text()
    dataset = load_dataset(folder / "dataset.h5")
    assert f"{len(dataset):,} force histories" in text
    median = np.median(dataset.scalars["pull_off_force"])
    row = next(line for line in text.splitlines() if line.startswith("| pull_off_force |"))
    assert float(row.split(" | ")[3]) == pytest.approx(median, rel=1e-2)


def test_the_card_of_a_pretrained_model_lists_its_measured_errors(published):
    folder, _ = published
    model, measurements = folder / "pretrained" / "fast", folder / "measurements"
    model.mkdir(parents=True)
    measurements.mkdir()
    run = {"units": [64, 32], "parameters": 24193, "features": "F", "training_trajectories": 90} | {
        "calibration_trajectories": 5,
        "seed": 3,
        "recipe": {"optimizer": "soap", "epochs": 4},
        "best_epoch": 2,
        "command": "make pretrained",
    }
    (model / "run.json").write_text(json.dumps(run))
    (model / "scaling.json").write_text(json.dumps({"ranges": {"tabor": [0.2, 3.2], "modulus_ratio": [0.01, 1.0]}}))
    box = {"count": 11, "pull_off": [0.5, 1.75, 4.0], "hysteresis": [0.25, 1.75, 4.0], "width/pull_off": [1.25, 2, 3]}
    box |= dict.fromkeys((f"inside/{name}" for name in cards.INSIDE), 0.875)
    corners = [box | {"count": 3, "inside/curve": 0.5}, box | {"count": 4, "pull_off": [1.0, 9.0, 11.0]}]
    places = {"box": box, "edges": {"low tabor": box}, "corners": corners}
    measured = {"count": 20, "corner": 3, "coverage": 0.9, "command": "some", "models": {"fast": places}}
    (measurements / "errors_by_place.json").write_text(json.dumps(measured))
    (model / "model.onnx").write_bytes(b"")
    cards.main(folder)
    recorded = {entry.key: entry.value for entry in onnx.load(model / "model.onnx").metadata_props}
    assert recorded["card_sha256"] == hashlib.sha256((model / "README.md").read_bytes()).hexdigest()
    text = (model / "README.md").read_text()
    assert "| all | 11 | 0.5 / 1.8 / 4 | 0.25 / 1.8 / 4 | 0.88 | 0.88 | 0.88 | 0.88 | 0.88 | 1.2 |" in text
    assert "| the corner that errs most | 4 | 1 / 9 / 11 |" in text
    assert "0.88, 0.88, 0.88, 0.88, 0.50" in text
    assert "LSTMs of 64 and 32 units" in text
    assert "| modulus_ratio | 0.01 to 1 |" in text
    assert "90 % interval" in " ".join(text.split())
