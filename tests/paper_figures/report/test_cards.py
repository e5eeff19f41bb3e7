import hashlib
import json

import numpy as np
import pytest

from bem.dataset.file import load_dataset
from paper_figures.report import cards

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
