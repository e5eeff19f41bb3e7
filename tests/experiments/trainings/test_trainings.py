"""A training counts as done only when it comes from what is asked for."""

import json
import shutil

import pytest
import typer

from experiments.trainings import data_efficiency
from experiments.trainings import variants as trainings
from experiments.trainings.variants import Variant, kept_folder
from tests.experiments.models import write_training

VARIANT = Variant(label="half", architecture="M1-concat", recipe="swift", epochs=35, fraction=0.5, fold=1)


def test_a_training_is_done_when_it_comes_from_what_is_asked_for(tmp_path, data):
    folders, half = {"work": tmp_path, "models": tmp_path / "published"}, tmp_path / "models" / "half"
    assert kept_folder(VARIANT, data, **folders) is None
    write_training(half, VARIANT, data)
    assert kept_folder(VARIANT, data, **folders) == half


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
    write_training(tmp_path / "models" / "half", Variant(**(vars(VARIANT) | change)), data)
    with pytest.raises(ValueError, match=f"received one of another {word}: remove .* to train it again"):
        kept_folder(VARIANT, data, work=tmp_path, models=tmp_path)


def test_a_training_on_another_data_set_is_refused(tmp_path, data, dataset):
    write_training(tmp_path / "models" / "half", VARIANT, data)
    run = tmp_path / "models" / "half" / "run.json"
    run.write_text(run.read_text(encoding="utf-8").replace(data.sha256, "0" * 64), encoding="utf-8")
    with pytest.raises(ValueError, match="another data set"):
        study(tmp_path, dataset)


def study(tmp_path, dataset, published=()):
    """One call of one variant after a result file with earlier trainings; returns what is published at the end."""
    (tmp_path / "out.json").write_text(json.dumps({"sets": {"deep": list(published)}}), encoding="utf-8")
    found = {}
    trainings.train_variants(
        {"a": VARIANT},
        dataset=dataset,
        work=tmp_path,
        models=tmp_path / "published",
        out=tmp_path / "out.json",
        jobs=1,
        publish=lambda done: found.update(done),
    )
    return found["a"]


def test_a_published_model_that_was_trained_alike_is_taken(tmp_path, data, dataset, queue):
    for label, epochs, mse in (("M1-concat-short", 35, 0.25), ("M1-concat", 36, 0.75)):
        folder = tmp_path / "published" / label
        write_training(folder, Variant(**(vars(VARIANT) | {"epochs": epochs})), data, mse)
    found = study(tmp_path, dataset)
    assert (found["mse"], found["taken_from"], queue[1]) == (0.25, "M1-concat-short", [])


def test_a_study_goes_on_from_its_result_file_in_another_clone(tmp_path, dataset, queue):
    refused, started = queue
    config = {"architecture": "M1-concat", "recipe": "swift", "whole_epochs": 1}
    config |= {"percents": [75, 50], "epochs": [1, 2], "folds": 2, "jobs": 1}

    def run():
        options = {"dataset": dataset, "models": tmp_path / "published", "work": tmp_path, "out": tmp_path / "out.json"}
        try:
            data_efficiency.study(config, **options)
        except typer.Exit as stop:
            return stop.exit_code, json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
        return 0, json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))

    refused.add("share-75-fold-1")
    status, content = run()
    assert (status, content["complete"]) == (trainings.STOPPED, False)
    assert [len(one["folds"]) for one in content["shares"]] == [1, 1]
    assert set(content["summary"].values()) == {None}
    refused.clear()
    started.clear()
    shutil.rmtree(tmp_path / "models")
    status, content = run()
    assert (status, content["complete"], content["summary"]["folds"]) == (0, True, 2)
    assert started == ["share-75-fold-1", "share-50-fold-1"]
    assert [one["mse_mean"] for one in content["shares"]] == [0.5, 0.5]
    started.clear()
    assert run()[0] == 0
    assert started == []


@pytest.mark.parametrize(("epochs", "mse"), [(35, 0.125), (36, 0.5)])
def test_the_result_of_the_same_training_is_taken_and_of_another_is_not(epochs, mse, tmp_path, dataset, data, queue):
    other = Variant(**(vars(VARIANT) | {"epochs": epochs}))
    entry = {"training": other.identity(data).digest, "mse": 0.125}
    assert study(tmp_path, dataset, [entry])["mse"] == mse
