"""Trainings count as done when they come from what is asked for; sets of features are compared across steps."""

import dataclasses
import json
import shutil

import numpy as np
import pytest
import typer

from bem.dataset.campaign import Campaign
from bem.dataset.measurement_steps import PHYSICAL
from experiments.cases import Hidden
from experiments.surrogates.measurement_steps import READINGS
from experiments.trainings import data_efficiency, feature_sets
from experiments.trainings import variants as trainings
from experiments.trainings.variants import Variant, kept_folder
from surrogate.data.dataset import TrajectoryDataset
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import run_here
from tests.experiments.models import shallow, write_training

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


SETTINGS = {"architecture": "M1-concat", "recipe": "swift", "epochs": 1, "sets": ["A", "D"], "physical": ["D"]}
SETTINGS |= {"hidden": 3, "jobs": 1}


@pytest.fixture(scope="module")
def physical(tmp_path_factory):
    """The protocols of `dataset` at physical steps."""
    path = tmp_path_factory.mktemp("data") / "physical.h5"
    run_here(Campaign(count=60, seed=2, counts=PHYSICAL, steps="physical"), path, solver=stand_in.solve)
    return path


@pytest.fixture
def scored(monkeypatch):
    """Stands in for the comparison on hidden protocols; the models that it was asked for."""
    calls = []

    def compared(folders, count):
        calls.append({label: steps for label, (_, steps) in folders.items()})
        return {label: {"count": count} for label in folders}, {"uniform": {"count": count}}

    monkeypatch.setattr(feature_sets, "hidden_errors", compared)
    return calls


def run(tmp_path, dataset, file, **changes):
    """One call; returns the content of the result file."""
    out = tmp_path / "out.json"
    feature_sets.study(SETTINGS | changes, dataset, tmp_path / "published", out, work=tmp_path, physical=file)
    return json.loads(out.read_text(encoding="utf-8"))


@pytest.mark.parametrize(("waits_for", "sets", "summary"), [("D", "A", None), ("D-physical", "AD", 1.0)])
def test_summary_waits_for_paper_sets_only(waits_for, sets, summary, tmp_path, dataset, physical, queue, scored):
    queue[0].add(f"features-{waits_for}")
    with pytest.raises(typer.Exit):
        run(tmp_path, dataset, physical)
    result = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert (list(result["sets"]), result["complete"]) == (list(sets), False)
    assert result["summary"].get("factor_a_over_d") == summary
    assert (list(result["physical"]), scored) == (["D"] if waits_for == "D" else [], [])


def test_physical_sets_use_own_data_set(tmp_path, dataset, physical, queue, scored):
    result = run(tmp_path, dataset, physical)
    assert queue[1] == ["features-A", "features-D", "features-D-physical"]
    assert (result["complete"], list(result["sets"]), list(result["physical"])) == (True, ["A", "D"], ["D"])
    digests = [training["training"] for group in ("sets", "physical") for training in result[group].values()]
    assert len(set(digests)) == 3
    trained = json.loads((tmp_path / "models" / "features-D-physical" / "run.json").read_text(encoding="utf-8"))
    assert trained["dataset_sha256"] == TrajectoryDataset.load(physical).sha256
    assert scored == [{"features-A": "uniform", "features-D": "uniform", "features-D-physical": "physical"}]
    assert result["physical"]["D"]["hidden"] == {"count": 3}
    assert result["floor"] == {"uniform": {"count": 3}}


def test_errors_are_kept_without_weights(tmp_path, dataset, physical, queue, scored):
    first = run(tmp_path, dataset, physical)
    (tmp_path / "models").rename(tmp_path / "gone")
    again = run(tmp_path, dataset, physical)
    assert (again["sets"], again["physical"], again["floor"]) == (first["sets"], first["physical"], first["floor"])
    assert (len(queue[1]), len(scored)) == (3, 1)
    # A training whose weights are gone keeps its errors; one that is there is measured on as many protocols as asked.
    (tmp_path / "models").mkdir()
    (tmp_path / "gone" / "features-D").rename(tmp_path / "models" / "features-D")
    (tmp_path / "gone" / "features-A").rename(tmp_path / "models" / "features-A")
    (tmp_path / "models" / "features-A" / "model.weights.h5").unlink()
    more = run(tmp_path, dataset, physical, hidden=4)
    assert scored[1:] == [{"features-D": "uniform"}]
    assert [more["sets"][name]["hidden"]["count"] for name in "AD"] == [3, 4]


def test_data_sets_must_hold_same_protocols(tmp_path, dataset, physical, queue, scored):
    with pytest.raises(FileNotFoundError, match="`make feature-sets` makes it"):
        run(tmp_path, dataset, tmp_path / "absent.h5")
    with pytest.raises(ValueError, match="received 60 trajectories at uniform steps"):
        run(tmp_path, dataset, dataset)
    foreign = tmp_path / "other.h5"
    run_here(Campaign(count=60, seed=3, counts=PHYSICAL, steps="physical"), foreign, solver=stand_in.solve)
    with pytest.raises(ValueError, match=r"must hold the protocols of .* received 60 trajectories at physical steps"):
        run(tmp_path, dataset, foreign)
    assert queue[1] == []
    assert run(tmp_path, dataset, tmp_path / "absent.h5", physical=[])["physical"] == {}


def test_paper_ranking_is_of_paper_sets():
    errors = {"A": 7.0, "B": 3.0, "C": 0.5, "D": 1.0, "E": 0.4, "F": 0.1}
    summary = feature_sets.summary({name: {"validation_mse": error} for name, error in errors.items()})
    expected = {"order": ["C", "D", "B", "A"], "best": "C", "all_improve_over_a": True, "d_better_than_c": False}
    assert summary == expected | {"factor_a_over_d": 7.0}
    two = feature_sets.summary({"A": {"validation_mse": 7.0}, "D": {"validation_mse": 1.0}})
    assert two == {"order": ["D", "A"], "best": "D", "factor_a_over_d": 7.0}
    assert feature_sets.summary({"F": {"validation_mse": 0.1}})["best"] is None


class Copy:
    """A model that predicts the solver's forces, a share too large."""

    def __init__(self, share):
        self.share = share

    def predict_history(self, times, indentations, scenes):
        assert times.shape == indentations.shape
        trajectories = Hidden.draw(len(scenes), feature_sets.common.MODULUS_RATIO).simulated("draft")
        pairs = zip(trajectories, times, strict=True)
        return (1.0 + self.share) * np.array([run.at(np.minimum(row, run.time[-1])) for run, row in pairs])


def test_models_of_both_steps_are_compared(monkeypatch, tmp_path):
    simulated = Hidden.simulated
    monkeypatch.setattr(Hidden, "draw", shallow)
    monkeypatch.setattr(Hidden, "simulated", lambda self, *_: simulated(self, "draft"))
    shares = {"exact": 0.0, "off": 0.5}
    monkeypatch.setattr(feature_sets.common, "load_surrogate", lambda name, _: Copy(shares[name]))
    folders = {f"{name}-{steps}": (tmp_path / name, steps) for name in shares for steps in feature_sets.STEPS}
    model_errors, floor = feature_sets.hidden_errors(folders, 4)
    for steps in feature_sets.STEPS:
        assert floor[steps]["count"] == 4
        for reading in READINGS:
            exact, off = (model_errors[f"{name}-{steps}"][reading] for name in ("exact", "off"))
            assert floor[steps][reading]["p50"] < 5.0
            assert exact == pytest.approx(floor[steps][reading], abs=1e-6)
            assert off["p50"] == pytest.approx(50.0, abs=2.0 * floor[steps][reading]["p99"])
    assert floor["uniform"]["pull_off"]["p50"] != floor["physical"]["pull_off"]["p50"]
