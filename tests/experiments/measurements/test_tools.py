"""Which surrogates are measured, which are outdated, and whose seconds count, from small model directories."""

import shutil

import numpy as np
import pytest

from bem.dataset.file import load_dataset
from experiments.common import dataset_digest
from experiments.measurements import accuracy_cost, tools
from experiments.trainings import amortisation
from surrogate.prediction.files import PUBLISHED, weights_sha256
from tests.experiments import models


def write_model(folder, dataset):
    models.write_model(folder, architecture="M1-concat", dataset_sha256=dataset_digest(dataset))
    for name in tools.FILES:
        if not (folder / name).exists():
            (folder / name).write_text(folder.name, encoding="utf-8")


def test_seconds_of_a_model_that_was_trained_anew_do_not_count(dataset, tmp_path):
    folder = tmp_path / "models"
    for name in ("M1-concat", "M1-FiLM", "M1-gated", "M2-concat"):
        write_model(folder / name, dataset)
    digests = {name: weights_sha256(folder / name) for name in ("M1-concat", "M1-FiLM")}
    (folder / "M1-FiLM" / "model.weights.h5").write_text("trained anew", encoding="utf-8")
    common = {"kind": "surrogate", "way": "ONNX single", "errors": {}, "seconds": {"mean": 1e-3}}
    measured = [{"model": name, "setting": name, "weights_sha256": digest} | common for name, digest in digests.items()]
    measured.append({"model": "M1-gated", "setting": "M1-gated"} | common)
    content = amortisation.study({"tools": measured}, dataset, folder)
    assert [line["name"] for line in content["lines"] if line["kind"] == "surrogate"] == ["M1-concat"]
    (line,) = (line for line in content["lines"] if line["kind"] == "surrogate")
    assert line["fixed_seconds"] == load_dataset(dataset).scalars["solver_seconds"].sum() + 120.0
    assert content["retrained"] == ["M1-FiLM", "M1-gated"]
    assert content["unmeasured"] == ["M2-concat"]


def test_a_loop_has_an_area_whichever_way_it_turns_and_a_batch_is_shared_out(monkeypatch):
    depth, force = np.r_[np.linspace(0.0, 1.0, 60), np.linspace(1.0, 0.0, 60)], np.repeat([2.0, 0.0], 60)
    answers = tools.from_steps(np.array([force, force[::-1]]), np.array([depth, depth]))
    assert answers[:, 1] == pytest.approx(2.0)
    monkeypatch.setattr(accuracy_cost, "timed", lambda _, repeats: [8.0] * repeats)
    monkeypatch.setattr(accuracy_cost, "BATCH", 4)
    answers = {"ONNX": lambda cases: np.ones((len(cases), 122))}
    _, seconds = accuracy_cost.timed_ways(answers, [1, 2, 3], 1, "any")["ONNX batch"]
    assert seconds.tolist() == [[2.0] * 3] * accuracy_cost.BATCH_REPEATS


DATASET = PUBLISHED.parent / "dataset.h5"


def test_surrogates_are_measured_and_what_is_missing_is_named(tmp_path, monkeypatch):
    """A published model, one without weights, and one of another recipe."""
    trained = tmp_path
    for name in ("M1-concat", "M1-FiLM", "M2-concat"):
        shutil.copytree(PUBLISHED / "M1-concat", tmp_path / name)
    (tmp_path / "M1-FiLM" / "model.weights.h5").unlink()
    recipe = tmp_path / "M2-concat" / "recipe.toml"
    recipe.write_text(recipe.read_text(encoding="utf-8").replace("swift", "other"), encoding="utf-8")
    assert tools.published(trained) == ["M1-concat", "M2-concat"]
    absent = tools.absent(trained, DATASET)
    assert (absent["missing"][:1], absent["outdated"]) == (["M1-FiLM"], ["M2-concat"])
    for name, value in {"TARGETS": (1.7e-2,), "BASELINE": {}, "FORMS": (), "SINGLE_CALLS": 2, "BATCH": 4}.items():
        monkeypatch.setattr(accuracy_cost, name, value)
    monkeypatch.setattr(tools, "EXACT_TARGET", 5e-2)
    monkeypatch.setattr(tools, "KEPT", tmp_path)
    content = accuracy_cost.study(DATASET, trained, count=3, repeats=2, finest=0, jobs=1)
    surrogates = [tool for tool in content["tools"] if tool["kind"] == "surrogate"]
    ways = [tool["way"] for tool in surrogates if tool["model"] == "M1-concat"]
    assert ways == ["Keras call", "ONNX single", "ONNX batch"]
    assert all(tool["protocols"] == 3 and tool["seconds"]["median"] > 0.0 for tool in surrogates)
    assert surrogates[0]["seconds"]["count"] == 2  # of three protocols, the two that are timed
    assert {tool["model"] for tool in surrogates if tool["outdated"]} <= {"M2-concat"}
    pretrained = [tool for tool in content["tools"] if tool["kind"] in ("fast", "accurate")]
    assert [tool["setting"] for tool in pretrained] == 2 * ["ONNX single", "ONNX batch"]
    assert all(tool["errors"]["pull_off_force"]["median"] < 0.1 for tool in pretrained)
    later = amortisation.study(content, DATASET, trained)
    for found in (content, later):
        assert (found["outdated"], len(found["missing"])) == (["M2-concat"], 16)
    assert any(one["surrogate"] == "M1-concat, ONNX batch" for one in later["break_even"])
