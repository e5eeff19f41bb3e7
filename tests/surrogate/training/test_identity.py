"""Which training a model comes from, and in what two of them differ."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from surrogate.data.dataset import Split
from surrogate.training.identity import (
    ALIKE,
    EVERYTHING,
    HELD_OUT,
    Run,
    differences,
    facts_that_differ,
    read_identity,
    trained_otherwise,
)
from surrogate.training.recipe import Recipe
from tests.surrogate.conftest import trained_as

RECIPE = Recipe.load("swift")


@pytest.fixture
def wanted(dataset):
    return Run("M1-concat", dataset, dataset.split(), RECIPE).identity


@pytest.mark.parametrize(
    ("published", "reason"),
    [
        ({}, ""),
        ({"backend": "jax"}, ""),
        ({"dataset_sha256": "b" * 64}, "of another data set"),
        ({"recipe": RECIPE.with_overrides(epochs=8)}, "of another recipe"),
        ({"features": "A"}, "of another feature set"),
        ({"extra_dataset_sha256": "b" * 64}, "of another extra data set"),
        ({"architecture": "M2-concat", "features": "A"}, "of another feature set, architecture"),
        ({"architecture_file": {"name": "own.py", "sha256": "c" * 64}}, "of another architecture file"),
    ],
)
def test_words_for_another_training(published, reason, wanted, dataset, tmp_path):
    assert (
        trained_otherwise(trained_as(tmp_path / "M1-concat", dataset, **{"recipe": RECIPE} | published), wanted)
        == reason
    )


def test_share_or_seed_is_another_split(wanted, dataset, tmp_path):
    others = {"share": dataset.split().with_fraction(0.5), "division": dataset.split(seed=1)}
    for name, split in others.items():
        folder = trained_as(tmp_path / name, dataset, RECIPE, split, architecture="M1-concat")
        assert trained_otherwise(folder, wanted) == "of another split"
    share, division = (read_identity(tmp_path / name) for name in others)
    assert differences(share, wanted, HELD_OUT) == []
    assert differences(division, wanted, HELD_OUT) == ["validation part", "test part"]


@pytest.mark.parametrize(
    "file", [("split.json", "{}"), ("split.json", None), ("run.json", "[]"), ("run.json", "{}"), ("run.json", None)]
)
def test_damaged_directory_has_no_identity(file, wanted, dataset, tmp_path):
    folder = trained_as(tmp_path / "M1-concat", dataset, RECIPE)
    if file[1] is None:
        (folder / file[0]).unlink()
    else:
        (folder / file[0]).write_text(file[1], encoding="utf-8")
    assert trained_otherwise(folder, wanted) == "which does not say how it was trained"
    with pytest.raises((ValueError, FileNotFoundError), match="a model directory must "):
        read_identity(folder)


OTHER = {
    "dataset": "b" * 64,
    "split": Split(*np.arange(3)[:, np.newaxis], seed=0),
    "recipe": {"name": "other"},
    "backend": "jax",
    "features": "A",
    "extra": "b" * 64,
    "architecture": "M2-concat",
    "architecture_sha256": "b" * 64,
}


@pytest.mark.parametrize("name", OTHER)
def test_every_quantity_counts(name, wanted):
    other = replace(wanted, **{name: OTHER[name]})
    assert len(differences(other, wanted)) == 1
    assert len(facts_that_differ(other.fingerprint, wanted.fingerprint)) == 1
    assert (differences(other, wanted, ALIKE) == []) == (name == "backend" or name.startswith("architecture"))
    assert (other.digest == wanted.digest) == (name == "backend")
    assert len(EVERYTHING) == len(OTHER)


def test_digest_is_that_of_published_results(wanted):
    content = {"dataset": wanted.dataset, "parts": wanted.split.parts, "recipe": RECIPE.as_dict(), "backend": ""}
    content |= {"features": "D", "architecture": "M1-concat", "extra": None}
    assert wanted.digest == hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


@pytest.mark.parametrize(("recipe", "differs"), [("paper", False), ("swift", True)])
def test_more_epochs_of_an_unpaced_recipe(recipe, differs, dataset):
    fewer, more = (
        Run("M1-concat", dataset, dataset.split(), Recipe.load(recipe).with_overrides(epochs=epochs)).identity
        for epochs in (3, 5)
    )
    assert bool(facts_that_differ(fewer.fingerprint, more.fingerprint)) == differs
    assert differences(fewer, more) == ["recipe"]


def test_models_share_a_split_beside_them(wanted, dataset, tmp_path):
    folder = trained_as(tmp_path / "M1-concat", dataset, RECIPE)
    (folder / "split.json").rename(tmp_path / "split.json")
    assert trained_otherwise(folder, wanted) == ""
    dataset.split(seed=1).save(folder / "split.json")
    assert trained_otherwise(folder, wanted) == "of another split"
