import json

import h5py
import pytest

from bem.dataset.sealed_file import BLOCK, FORMAT, FORMAT_VERSION
from experiments.stages import describe, hours_of, read_stages
from surrogate.architectures.naming import names
from tests.data_files import editing
from tests.experiments.models import write_model


def test_hours_follow_from_what_the_published_models_took(tmp_path):
    known = read_stages()
    assert list(known) == ["dataset", "models", "more-models", "feature-sets", "data-efficiency", "paper"]
    line = describe("models", known, tmp_path)
    assert line.startswith("stage 2 of 6, models: train the 18 paper models")
    assert line.endswith("by estimate")
    for name in names():
        write_model(tmp_path / "models" / name)
    assert hours_of("models", read_stages(), tmp_path) == (pytest.approx(18 * 120.0 / 3600.0 / 2), True)
    assert describe("models", read_stages(), tmp_path).endswith("about 18 minutes")
    speed = {"recipe": "swift", "models": {name: {"seconds_per_batch": {"median": 2.0}} for name in names()}}
    (tmp_path / "measurements").mkdir()
    (tmp_path / "measurements" / "training_speed.json").write_text(json.dumps(speed), encoding="utf-8")
    # Of one machine where it measured batches: two epochs of three.
    assert hours_of("models", read_stages(), tmp_path) == (pytest.approx(18 * 12.0 / 3600.0 / 2), True)
    (tmp_path / "models" / "M6-gated" / "run.json").unlink()
    assert not hours_of("models", read_stages(), tmp_path)[1]


def test_hours_of_data_set_and_studies(tmp_path):
    with h5py.File(tmp_path / "dataset.h5", "w", userblock_size=BLOCK):
        pass
    with editing(tmp_path / "dataset.h5") as file:
        file.attrs.update(format=FORMAT, format_version=FORMAT_VERSION, core_seconds=180.0)
    one = {"hours": 0.5, "training": "a digest"}
    taken = one | {"taken_from": "M1-concat"}
    sets = {"complete": True, "sets": {"A": one, "D": taken}, "physical": {"D": one}}
    (tmp_path / "feature_sets.json").write_text(json.dumps(sets), encoding="utf-8")
    shares = {"complete": True, "full": taken, "shares": [{"folds": [one, one]}, {"folds": [one, one]}]}
    (tmp_path / "data_efficiency.json").write_text(json.dumps(shares), encoding="utf-8")
    found = {name: hours_of(name, read_stages(), tmp_path) for name in ("dataset", "feature-sets", "data-efficiency")}
    assert found == {"dataset": (0.025, True), "feature-sets": (0.5, True), "data-efficiency": (1.0, True)}
    (tmp_path / "feature_sets.json").write_text(json.dumps(sets | {"complete": False}), encoding="utf-8")
    assert hours_of("feature-sets", read_stages(), tmp_path)[1] is False
