"""What training costs and buys, from small networks and model directories."""

import pytest

from experiments.common import dataset_digest
from experiments.published_models import epoch_seconds, minutes_to, read_model
from experiments.trainings import training_costs
from tests.experiments import models
from tests.surrogate.conftest import build_least


def write_model(folder, dataset, mse, **run):
    models.write_model(folder, mse, **{"dataset_sha256": dataset_digest(dataset), "epochs": 2} | run)


def test_minutes_and_seconds_of_a_training(dataset, tmp_path):
    history = {"cpu_seconds": [60.0, 120.0, 180.0], "validation_mse": [0.3, 0.1, 0.2]}
    assert minutes_to(history, 0.2) == 2.0
    assert minutes_to(history, 0.01) is None
    write_model(tmp_path / "M1-concat", dataset, 3e-4)
    # 48 trajectories in batches of 20 take three of them an epoch.
    swift = {"recipe": "swift", "models": {"M1-concat": {"seconds_per_batch": {"median": 10.0}}}}
    by_paper = {"recipe": "swift", "models": {}, "by_paper_recipe": {"M1-concat": {"median": 10.0}}}
    seconds = [read_model(tmp_path / "M1-concat", speed)["core_seconds"] for speed in (None, by_paper, swift)]
    assert seconds == [120.0, 120.0, 2 * 3 * 10.0]
    write_model(tmp_path / "M1-FiLM", dataset, 3e-4, device="a GPU")
    assert read_model(tmp_path / "M1-FiLM", swift)["hours"] is None
    write_model(tmp_path / "M1-concat-paper", dataset, 3e-4, device="a GPU", recipe={"name": "paper", "batch_size": 8})
    assert read_model(tmp_path / "M1-concat-paper", by_paper)["hours"] == 2 * 6 * 10.0 / 3600.0


def test_cost_curves_and_held_out_errors(dataset, tmp_path):
    folder = tmp_path / "models"
    write_model(folder / "M1-concat", dataset, 3e-4)
    write_model(folder / "M1-concat-8-epochs", dataset, 9e-4)
    write_model(folder / "M1-concat-large", dataset, 1e-5, dataset_sha256="0")
    study = training_costs.study_training_cost(dataset, folder)
    assert read_model(folder / "M1-concat")["validation_mse"] == 4e-4
    (reference,) = study["models"]
    assert reference["history"]["best_mse"] == [0.3, 4e-4]
    assert reference["history"]["core_minutes"] == [1.0, 2.0]
    assert (reference["test_mse"], reference["core_minutes"]) == (3e-4, 2.0)
    assert study["minutes_to_paper_mse"] == 2.0
    assert [(training["name"], training["test_mse"]) for training in study["beside"]] == [("M1-concat-8-epochs", 9e-4)]
    assert list(study["outdated"]) == ["M1-concat-large"]
    assert len(study["missing"]) == 17 + len(training_costs.BUDGETS) - 1
    # With what a batch costs on one machine, 48 trajectories in batches of 20 take three of them an epoch.
    batches = {"recipe": "swift", "models": {"M1-concat": {"seconds_per_batch": {"median": 10.0}}}}
    study = training_costs.study_training_cost(dataset, folder, batches)
    (reference,) = study["models"]
    assert reference["history"]["core_minutes"] == [0.5, 1.0]
    assert (reference["core_minutes"], study["minutes_to_paper_mse"]) == (1.0, 1.0)


@pytest.mark.slow
def test_architectures_take_the_same_batches(dataset, monkeypatch):
    # The refinements of SOAP decide how long a block is: ten batches, too many for a network of full size.
    monkeypatch.setattr("surrogate.build", build_least)
    monkeypatch.setattr(training_costs, "names", lambda: ["M3-concat", "M4-gated"])
    monkeypatch.setattr(training_costs, "limit_threads", lambda _: None)
    study = training_costs.study_training_speed(dataset, repeats=2)
    assert list(study["models"]) == ["M3-concat", "M4-gated"]
    for model in study["models"].values():
        assert model["seconds_per_batch"]["count"] == 2
        epoch = model["seconds_per_batch"]["median"] * study["batches"]
        assert model["hours"] == pytest.approx(epoch * study["epochs"] / 3600.0)
    assert {seconds["count"] for seconds in study["by_paper_recipe"].values()} == {2}
    for recipe in ("swift", "paper"):
        settings = {"name": recipe, "batch_size": 8}
        timed = [epoch_seconds(study, settings, name, 80) for name in ("M3-concat", "M4-gated", "M1-FiLM")]
        assert timed[0] > 0.0 < timed[1]
        assert timed[2] is None
    longest = study["longest_training"]
    assert study["longest_training_hours"] == max(model["hours"] for model in study["models"].values())
    assert study["models"][longest]["hours"] == study["longest_training_hours"]


def test_a_chosen_model_is_only_timed(dataset, monkeypatch, capsys):
    monkeypatch.setattr(training_costs, "limit_threads", lambda _: None)
    monkeypatch.setattr(training_costs, "BLOCK", 4)
    monkeypatch.setattr(training_costs, "timed", lambda _, repeats: [10.0] * repeats)
    assert training_costs.study_training_speed(dataset, recipe="paper", only=["M4-gated"], repeats=1) is None
    assert capsys.readouterr().out.split()[:3] == ["M4-gated", "2500", "ms"]  # ten seconds for four batches
