"""What counts as trained, and what is published under an architecture's own name."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from surrogate.cli import app as cli
from surrogate.data.dataset import Split
from surrogate.training.queue import outdated, set_aside
from surrogate.training.recipe import Recipe

RECIPE = Recipe.load("swift")
RUN = {"dataset_sha256": "a" * 64, "features": "D", "backend": "tensorflow", "extra_dataset_sha256": None}


@pytest.fixture
def asked(dataset):
    return {"dataset_sha256": "a" * 64, "recipe": RECIPE, "split": dataset.split()}


def publish(folder, split, recipe=RECIPE, **run):
    folder.mkdir()
    (folder / "run.json").write_text(json.dumps(RUN | run), encoding="utf-8")
    (folder / "recipe.toml").write_text(recipe.to_toml(), encoding="utf-8")
    split.save(folder / "split.json")
    return folder


@pytest.mark.parametrize(
    ("run", "reason"),
    [
        ({}, ""),
        ({"backend": "jax"}, ""),
        ({"dataset_sha256": "b" * 64}, "trained on another data set"),
        ({"recipe": RECIPE.with_overrides(epochs=8)}, "trained with another recipe"),
        ({"features": "A"}, "trained with other features"),
        ({"extra_dataset_sha256": "b" * 64}, "trained on an extra data set"),
    ],
)
def test_a_model_is_outdated_unless_it_was_trained_as_it_would_be_now(run, reason, asked, tmp_path):
    assert outdated(publish(tmp_path / "model", asked["split"], **run), **asked) == reason


def test_a_share_of_the_training_part_or_another_division_is_outdated(dataset, asked, tmp_path):
    others = {"share": asked["split"].with_fraction(0.5), "division": dataset.split(seed=1)}
    for name, split in others.items():
        folder = publish(tmp_path / name, split)
        assert outdated(folder, **asked) == "trained on other trajectories of the data set"
    (folder / "split.json").write_text("{}", encoding="utf-8")
    assert outdated(folder, **asked) == "which does not say how it was trained"


def test_a_division_has_one_digest(asked, tmp_path):
    asked["split"].save(tmp_path / "split.json")
    assert Split.load(tmp_path / "split.json").sha256 == asked["split"].sha256
    assert asked["split"].with_fraction(0.5).sha256 != asked["split"].sha256


@pytest.mark.parametrize(
    ("change", "aside"),
    [
        ({}, False),
        ({"backend": "jax"}, False),
        ({"features": "A"}, True),
        ({"split": "other"}, True),
        ({"extra": "b"}, True),
    ],
)
def test_work_of_another_training_is_set_aside(change, aside, asked, tmp_path):
    found = {"dataset": "a" * 64, "recipe": RECIPE.as_dict(), "features": "D", "extra": None}
    fingerprint = json.dumps(found | {"split": asked["split"].sha256} | change)
    folder = tmp_path / "run"
    folder.mkdir()
    np.savez(folder / "checkpoint.npz", state=np.array(json.dumps({"fingerprint": fingerprint})))
    assert (set_aside(folder, **asked) is not None) == aside
    assert folder.exists() != aside


@pytest.mark.parametrize(
    "options", [["--features", "A"], ["--fraction", "0.5"], ["--split-seed", "1"], ["--extra", "x"]]
)
def test_what_is_trained_otherwise_needs_a_label(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(cli.app, ["train", "M1-concat", *options])
    assert isinstance(result.exception, ValueError)
    assert str(result.exception).startswith(f"Expected --label beside {options[0]}, since published/models/M1-concat ")
    for allowed in (["--label", "mine"], ["--models", "elsewhere"]):
        result = CliRunner().invoke(cli.app, ["train", "M1-concat", *options, *allowed])
        # There is no data set here.
        assert isinstance(result.exception, FileNotFoundError)
