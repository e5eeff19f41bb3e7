"""Trainings count as done when they come from what is asked for; those of feature sets are kept."""

import dataclasses
import json
import shutil

import pytest
import typer

from experiments.trainings import data_efficiency, feature_sets
from experiments.trainings import variants as trainings
from experiments.trainings.variants import Variant, kept_folder
from tests.experiments.models import write_training

VARIANT = Variant(label="half", architecture="M1-concat", recipe="swift", epochs=35, fraction=0.5, fold=1)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"epochs": 110}, "recipe"),
        ({"recipe": "paper"}, "recipe"),
        ({"fold": 2}, "split"),
        ({"fraction": 0.25}, "split"),
        ({"features": "A"}, "feature set"),
        ({"architecture": "M4-FiLM"}, "architecture"),
        ({}, "data set"),
        ({}, None),
    ],
)
def test_only_the_same_training_is_taken(change, word, tmp_path, data):
    half, folders = tmp_path / "models" / "half", {"work": tmp_path, "models": tmp_path / "published"}
    assert kept_folder(VARIANT, data, **folders) is None
    dataset_used = dataclasses.replace(data, sha256="0" * 64) if word == "data set" else data
    write_training(half, Variant(**(vars(VARIANT) | change)), dataset_used)
    if word is None:
        assert kept_folder(VARIANT, data, **folders) == half
        return
    with pytest.raises(ValueError, match=f"received one of another {word}: remove .* to train it again"):
        kept_folder(VARIANT, data, **folders)


def study(tmp_path, dataset, published=()):
    """One call of one variant after a result file with earlier trainings; returns what is published at the end."""
    (tmp_path / "out.json").write_text(json.dumps({"sets": {"deep": list(published)}}), encoding="utf-8")
    results = {}
    trainings.train_variants(
        {"a": VARIANT},
        dataset=dataset,
        work=tmp_path,
        models=tmp_path / "published",
        out=tmp_path / "out.json",
        jobs=1,
        publish=lambda done: results.update(done),
    )
    return results["a"]


def test_published_model_stands_for_variant(tmp_path, data, dataset, queue):
    for label, epochs, mse in (("M1-concat-short", 35, 0.25), ("M1-concat", 36, 0.75)):
        folder = tmp_path / "published" / label
        write_training(folder, Variant(**(vars(VARIANT) | {"epochs": epochs})), data, mse)
    result = study(tmp_path, dataset)
    assert (result["mse"], result["taken_from"], queue[1]) == (0.25, "M1-concat-short", [])


def test_study_resumes_in_another_clone(tmp_path, dataset, queue):
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
    status, result = run()
    assert (status, result["complete"]) == (trainings.STOPPED, False)
    assert [len(share["folds"]) for share in result["shares"]] == [1, 2]
    assert set(result["summary"].values()) == {None}
    refused.clear()
    started.clear()
    shutil.rmtree(tmp_path / "models")
    status, result = run()
    assert (status, result["complete"], result["summary"]["folds"]) == (0, True, 2)
    assert started == ["share-75-fold-1"]
    assert [share["mse_mean"] for share in result["shares"]] == [0.5, 0.5]
    started.clear()
    assert run()[0] == 0
    assert started == []


@pytest.mark.parametrize(("epochs", "mse"), [(35, 0.125), (36, 0.5)])
def test_results_of_same_training_are_kept(epochs, mse, tmp_path, dataset, data, queue):
    variant = Variant(**(vars(VARIANT) | {"epochs": epochs}))
    entry = {"training": variant.identity(data).digest, "mse": 0.125}
    assert study(tmp_path, dataset, [entry])["mse"] == mse


SETTINGS = {"architecture": "M1-concat", "recipe": "swift", "epochs": 1, "sets": ["A", "D"], "jobs": 1}


def run(tmp_path, dataset):
    """One call; returns the content of the result file."""
    out = tmp_path / "out.json"
    feature_sets.study(SETTINGS, dataset, tmp_path / "published", out, work=tmp_path)
    return json.loads(out.read_text(encoding="utf-8"))


def test_summary_waits_for_its_sets(tmp_path, dataset, queue):
    queue[0].add("features-D")
    with pytest.raises(typer.Exit):
        run(tmp_path, dataset)
    result = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert (list(result["sets"]), result["complete"], result["summary"]) == (["A"], False, {})


def test_errors_are_kept_without_weights(tmp_path, dataset, queue):
    first = run(tmp_path, dataset)
    assert (first["complete"], first["summary"]["factor_a_over_d"]) == (True, 1.0)
    (tmp_path / "models").rename(tmp_path / "gone")
    assert run(tmp_path, dataset)["sets"] == first["sets"]
    assert queue[1] == ["features-A", "features-D"]


def test_paper_ranking_is_of_paper_sets():
    errors = {"A": 7.0, "B": 3.0, "C": 0.5, "D": 1.0, "X": 0.1}
    summary = feature_sets.summary({name: {"validation_mse": error} for name, error in errors.items()})
    expected = {"order": ["C", "D", "B", "A"], "best": "C", "all_improve_over_a": True, "d_better_than_c": False}
    assert summary == expected | {"factor_a_over_d": 7.0}
    two = feature_sets.summary({"A": {"validation_mse": 7.0}, "D": {"validation_mse": 1.0}})
    assert two == {"order": ["D", "A"], "best": "D", "factor_a_over_d": 7.0}
    assert feature_sets.summary({"X": {"validation_mse": 0.1}})["best"] is None
