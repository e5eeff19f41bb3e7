"""What training buys, from small model directories."""

import json

from experiments.common import dataset_digest
from experiments.paper.model_comparison import minutes_to, read_model
from experiments.trainings import training_cost


def write_model(folder, dataset, test_mse, **run):
    folder.mkdir(parents=True)
    split = {"seed": 0, "train": [0], "validation": [1], "test": [2]}
    (folder / "split.json").write_text(json.dumps(split), encoding="utf-8")
    (folder / "recipe.toml").write_text('name = "swift"\nbatch_size = 20\n', encoding="utf-8")
    content = {"architecture": "M1-concat", "features": "D", "backend": "tensorflow", "versions": {}}
    content |= {"training_trajectories": 48, "dataset_sha256": dataset_digest(dataset)}
    (folder / "run.json").write_text(json.dumps(content | run), encoding="utf-8")
    test = {name: {"mean": test_mse} for name in ("mse", "mae", "dtw_rmse")}
    metrics = {"parameters": 1, "epochs": 2, "best_epoch": 1, "cpu_seconds": 120.0, "test": test}
    (folder / "metrics.json").write_text(json.dumps(metrics), encoding="utf-8")
    rows = "epoch,train_mse,validation_mse,cpu_seconds\n1,0.5,4e-4,60\n2,0.5,7e-4,120\n"
    (folder / "history.csv").write_text(rows, encoding="utf-8")


def test_minutes_to_an_error_are_those_of_the_first_epoch_below_it():
    history = {"cpu_seconds": [60.0, 120.0, 180.0], "validation_mse": [0.3, 0.1, 0.2]}
    assert minutes_to(history, 0.2) == 2.0
    assert minutes_to(history, 0.01) is None


def test_held_out_errors_stand_beside_the_curves_of_the_validation_error(dataset, tmp_path):
    models = tmp_path / "models"
    write_model(models / "M1-concat", dataset, 3e-4)
    write_model(models / "M1-concat-8-epochs", dataset, 9e-4)
    write_model(models / "M1-concat-large", dataset, 1e-5, dataset_sha256="0")
    content = training_cost.study(dataset, models)
    assert read_model(models / "M1-concat")["validation_mse"] == 4e-4
    (reference,) = content["models"]
    assert reference["history"]["best_mse"] == [4e-4, 4e-4]
    assert reference["history"]["core_minutes"] == [1.0, 2.0]
    assert (reference["test_mse"], reference["core_minutes"]) == (3e-4, 2.0)
    assert content["minutes_to_paper_mse"] == 1.0
    assert [(one["name"], one["test_mse"]) for one in content["beside"]] == [("M1-concat-8-epochs", 9e-4)]
    assert list(content["outdated"]) == ["M1-concat-large"]
    assert len(content["missing"]) == 17 + len(training_cost.BUDGETS) - 1
    # With what a batch costs on one machine, 48 trajectories in batches of 20 take three of them an epoch.
    batches = {"recipe": "swift", "models": {"M1-concat": {"seconds_per_batch": {"median": 10.0}}}}
    content = training_cost.study(dataset, models, batches)
    (reference,) = content["models"]
    assert reference["history"]["core_minutes"] == [0.5, 1.0]
    assert (reference["core_minutes"], content["minutes_to_paper_mse"]) == (1.0, 0.5)


def test_seconds_of_a_training_are_its_batches_where_one_machine_measured_them(dataset, tmp_path):
    write_model(tmp_path / "M1-concat", dataset, 3e-4, epochs=2, cpu_seconds=120.0)
    assert training_cost.training_seconds(tmp_path / "M1-concat", {("paper", "M1-concat"): 10.0}) == 120.0
    assert training_cost.training_seconds(tmp_path / "M1-concat", {("swift", "M1-concat"): 10.0}) == 2 * 3 * 10.0
