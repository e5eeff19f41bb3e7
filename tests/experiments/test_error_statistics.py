import csv
import json

import numpy as np
import pytest

from experiments import error_statistics, model_comparison, studies
from experiments.data_efficiency import variants as shares
from experiments.feature_sets import summary as feature_summary
from experiments.feature_sets import variants as feature_variants
from surrogate.architectures.naming import names

COLUMNS = (
    "mse",
    "mae",
    "dtw_rmse",
    "nmae_percent",
    "pull_off_force_percent",
    "pull_off_time_percent",
    "hysteresis_percent",
    "native_pull_off_force_percent",
    "resolution_floor_percent",
)


def write_model(folder, mse):
    """A model directory with everything but weights."""
    folder.mkdir(parents=True)
    test = {name: {"mean": mse, "median": mse, "p90": mse, "max": mse} for name in COLUMNS}
    metrics = {"parameters": 10, "test": test, "epochs": 2, "best_epoch": 2, "cpu_seconds": 3600.0}
    (folder / "metrics.json").write_text(json.dumps(metrics), encoding="utf-8")
    run = {"backend": "tensorflow", "training_trajectories": 8, "dataset_sha256": "0"}
    (folder / "run.json").write_text(json.dumps(run), encoding="utf-8")
    rows = "epoch,train_mse,validation_mse\n1,0.2,0.3\n2,0.1,0.2\n"
    (folder / "history.csv").write_text(rows, encoding="utf-8")
    return folder


def test_quartiles_are_ranked_by_mse_and_equally_large():
    mse = np.array([5.0, 1.0, 2.0, 8.0, 3.0, 7.0, 4.0, 6.0])
    assert error_statistics.quartile_of(mse).tolist() == [2, 0, 0, 3, 1, 3, 1, 2]


def test_quartile_means_and_deviations():
    errors = {name: np.arange(1.0, 9.0) for name in COLUMNS}
    found = error_statistics.statistics(errors)
    first = found["quartiles"]["Q1"]
    assert first["count"] == 2
    assert first["mse"] == pytest.approx({"mean": 1.5, "sd": np.std([1.0, 2.0], ddof=1)})
    assert found["overall"]["hysteresis_percent"]["median"] == 4.5
    assert found["spearman"]["pull_off_and_hysteresis"] == pytest.approx(1.0)


def test_errors_are_read_from_a_model_directory(tmp_path):
    folder = tmp_path / "M1-concat"
    folder.mkdir()
    with (folder / "test_errors.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["trajectory", *COLUMNS])
        writer.writerows([[row, *[0.1 * row + 0.1] * len(COLUMNS)] for row in range(8)])
    out = tmp_path / "out.json"
    error_statistics.main(error_statistics.CONFIG, tmp_path, out)
    assert json.loads(out.read_text(encoding="utf-8"))["trajectories"] == 8


def test_missing_errors_name_the_command(tmp_path):
    with pytest.raises(FileNotFoundError, match="surrogate train"):
        error_statistics.read_errors(tmp_path / "absent.csv")


def test_comparison_draws_no_conclusion_while_models_are_missing(tmp_path):
    write_model(tmp_path / "M1-concat", 2.0)
    write_model(tmp_path / "M1-gated", 1.0)
    out = tmp_path / "comparison.json"
    model_comparison.main(tmp_path, out)
    found = json.loads(out.read_text(encoding="utf-8"))
    assert len(found["missing"]) == 16
    assert found["comparison"]["ranking"] == ["M1-gated", "M1-concat"]
    assert found["comparison"]["best"] is None
    assert found["comparison"]["best_conditioning"]["M1"] is None
    assert found["models"]["M1-concat"]["hours"] == 1.0


def test_comparison_of_all_models(tmp_path):
    for rank, name in enumerate(names()):
        write_model(tmp_path / name, 18.0 - rank)
    out = tmp_path / "comparison.json"
    model_comparison.main(tmp_path, out)
    found = json.loads(out.read_text(encoding="utf-8"))["comparison"]
    assert (found["best"], found["second_family"]) == ("M6-gated", "M5")
    assert set(found["best_conditioning"].values()) == {"gated"}


def test_comparison_of_no_model_names_the_target(tmp_path):
    with pytest.raises(FileNotFoundError, match="make models"):
        model_comparison.main(tmp_path, tmp_path / "out.json")


def test_feature_sets_differ_in_nothing_else():
    config = {"architecture": "M1-concat", "recipe": "swift", "epochs": 0, "sets": ["A", "D"]}
    found = feature_variants(config)
    assert found["A"].features == "A"
    assert found["A"].command(dataset="d", work=studies.RESULTS)[:2] == ["train", "M1-concat"]
    assert {(v.recipe, v.fraction, v.epochs) for v in found.values()} == {("swift", 1.0, 0)}
    summary = feature_summary({"A": {"validation_mse": 7.0}, "D": {"validation_mse": 1.0}})
    assert summary == {"order": ["D", "A"], "best": "D", "factor_a_over_d": 7.0}


def test_shares_are_the_papers():
    keys = ("architecture", "recipe", "percents", "epochs", "folds", "jobs")
    config = studies.read_config(studies.CONFIGS / "data_efficiency.toml", *keys)
    found = shares(config)
    assert len(found) == 35
    assert {percent for percent, _ in found} == {75, 50, 25, 12.5, 6.25, 3.125, 1.55125}
    assert found[50, 4].fraction == 0.5
    assert len({variant.label for variant in found.values()}) == 35


def test_a_configuration_with_other_keys_is_refused(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text("one = 1\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"must hold two; received one"):
        studies.read_config(path, "two")


@pytest.mark.parametrize("path", sorted((studies.CONFIGS / "smoke").glob("*.toml")), ids=lambda path: path.stem)
def test_the_smoke_configuration_has_the_same_keys(path):
    import tomllib

    full = tomllib.loads((studies.CONFIGS / path.name).read_text(encoding="utf-8"))
    assert tomllib.loads(path.read_text(encoding="utf-8")).keys() == full.keys()
