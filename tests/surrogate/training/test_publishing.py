"""A name from outside is one plain name, and nothing but a model is ever replaced, and that only when asked."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from experiments.common import load_surrogate
from experiments.trainings.variants import Variant
from surrogate.cli import app as cli
from surrogate.files import find_model
from surrogate.training.identity import Run
from surrogate.training.model_directory import model_name, publish, require_place
from surrogate.training.recipe import Recipe
from tests.surrogate.conftest import trained_as

PATHS = ["../victim", "/tmp/victim", ".", "..", "", "a/b", "a\\b", ".hidden", "-r", "a b", "a\n", "é", "n" * 65]


def contents(folder):
    return {str(path.relative_to(folder)): path.is_file() and path.read_bytes() for path in folder.rglob("*")}


def model_directory(folder, **run):
    folder.mkdir(parents=True)
    (folder / "run.json").write_text(json.dumps(run))
    (folder / "model.weights.h5").write_text("weights")
    return folder


@pytest.mark.parametrize("name", ["M1-concat", "mine", "a.b_c-1", "7", "n" * 64])
def test_plain_names(name):
    assert model_name(name) == name


@pytest.mark.parametrize("label", [*PATHS, "STOP", "stop", "mine.onnx"])
def test_bad_label_is_refused_at_once(label, tmp_path, monkeypatch, dataset_path):
    (tmp_path / "work").mkdir()
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim" / "thesis.tex").write_text("precious")
    before = contents(tmp_path)
    monkeypatch.chdir(tmp_path / "work")
    # Neither the recipe nor the data set is there.
    words = ["train", "M1-concat", f"--label={label}", "--recipe", "none.toml", "--dataset", "none.h5", "--models", "."]
    result = CliRunner().invoke(cli.app, words)
    assert isinstance(result.exception, ValueError)
    assert str(result.exception).startswith(("Expected a --label o", "a --label must be another"))
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", PATHS)
def test_names_that_become_paths_are_plain(name, tmp_path, dataset):
    for use in (
        lambda: Run("M1-concat", dataset, dataset.split(), Recipe.load("swift"), label=name or "."),
        lambda: Variant(label=name, architecture="M1-concat", recipe="swift"),
        lambda: load_surrogate(name, tmp_path),
    ):
        with pytest.raises(ValueError, match=r"Expected a.* of at most 64 letters") as refused:
            use()
        assert len(str(refused.value)) < 200
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["", ".", "..", "../models"])
def test_a_path_is_not_looked_for_as_a_name(name, tmp_path, monkeypatch):
    model_directory(tmp_path / "models" / "M1-concat")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FileNotFoundError, match="name must be a model's, a directory with"):
        find_model(name, tmp_path / "models")


@pytest.mark.parametrize("name", ["thesis.tex", "run.json"])
def test_other_folders_are_never_removed(name, tmp_path):
    (tmp_path / "run" / "model").mkdir(parents=True)
    place = tmp_path / "mine"
    if name == "run.json":
        model_directory(place)
        (place / "notes").mkdir()
    else:
        place.mkdir()
        (place / name).write_text("precious")
    before = contents(tmp_path)
    with pytest.raises(ValueError, match=r"a new path or a model directory.*mine, which holds '(thesis|notes)"):
        publish(tmp_path / "run", place)
    with pytest.raises(ValueError, match=r"which has no run\.json"):
        require_place(tmp_path / "run" / "model")
    with pytest.raises(ValueError, match="a file"):
        require_place(tmp_path / "mine" / name if name == "thesis.tex" else tmp_path / "mine" / "run.json")
    assert contents(tmp_path) == before


def test_model_is_replaced_as_a_whole(tmp_path):
    model_directory(tmp_path / "run" / "model", name="new")
    old = model_directory(tmp_path / "elsewhere" / "mine", name="old")
    models = tmp_path / "models"
    models.mkdir()
    (models / "mine").symlink_to(old)
    publish(tmp_path / "run", models / "mine")
    assert (models / "mine").is_symlink()
    assert json.loads((old / "run.json").read_text())["name"] == "new"
    publish(tmp_path / "run", models / "other.part")
    publish(tmp_path / "run", models / "other")
    assert sorted(path.name for path in models.iterdir()) == ["mine", "other", "other.part"]
    assert [path.name for path in old.parent.iterdir()] == ["mine"]


def test_notes_of_a_user_stay(tmp_path):
    model_directory(tmp_path / "run" / "model", name="new")
    (model_directory(tmp_path / "noted", name="old") / "README.md").write_text("my notes")
    with pytest.raises(ValueError, match=r"noted, which holds 'README\.md'"):
        publish(tmp_path / "run", tmp_path / "noted")
    assert (tmp_path / "noted" / "README.md").read_text() == "my notes"


def test_failed_replacement_keeps_the_model(tmp_path, monkeypatch):
    model_directory(tmp_path / "run" / "model", name="new")
    place = model_directory(tmp_path / "models" / "mine", name="old")
    rename = type(place).rename

    def fail(path, target):
        if path.name == "arriving":
            raise OSError("disk full")
        return rename(path, target)

    monkeypatch.setattr(type(place), "rename", fail)
    with pytest.raises(OSError, match="disk full"):
        publish(tmp_path / "run", place)
    assert json.loads((place / "run.json").read_text())["name"] == "old"
    assert [path.name for path in place.parent.iterdir()] == ["mine"]


@pytest.mark.parametrize("label", ["M2-concat", "mine"])
def test_published_label_is_not_overwritten(label, tmp_path, dataset, dataset_path, monkeypatch):
    recipe = tmp_path / "mine.toml"
    recipe.write_text('name = "mine"\nseed = 0\nbatch_size = 24\nepochs = 2\nlearning_rate = 1e-3\n')
    place = trained_as(tmp_path / "models" / label, dataset, Recipe.load(recipe), architecture="M1-concat")
    before = contents(tmp_path)
    monkeypatch.setattr("surrogate.training.interface.import_keras", lambda: pytest.fail("the training began"))
    words = ["train", "M1-concat", "--label", label, "--dataset", str(dataset_path), "--recipe", str(recipe)]
    words += ["--models", str(tmp_path / "models"), "--runs", str(tmp_path / "runs")]

    again = CliRunner().invoke(cli.app, words)
    assert (again.exit_code, again.output) == (
        0,
        f"{label}: already published in {place}; --replace trains it again\n",
    )
    for otherwise, why in (
        (["--epochs", "1"], "another recipe"),
        (["--features", "C"], "another feature set"),
        (["--fraction", "0.5"], "another split"),
        (["--extra", str(dataset_path)], "another extra data set"),
    ):
        refused = CliRunner().invoke(cli.app, [*words, *otherwise])
        assert isinstance(refused.exception, ValueError)
        assert "out must be a path without a model (--label NAME), or replace must be true" in str(refused.exception)
        assert why in str(refused.exception)
    words[1] = "M3-concat"
    assert "a published model of another architecture" in str(CliRunner().invoke(cli.app, words).exception)
    assert contents(tmp_path) == before


def test_unwritable_place_is_refused_at_once(tmp_path, monkeypatch):
    require_place(tmp_path / "models" / "mine")
    monkeypatch.setattr("os.access", lambda place, _: Path(place) != tmp_path)
    with pytest.raises(ValueError, match="must be one that can be written"):
        require_place(tmp_path / "models" / "mine")
