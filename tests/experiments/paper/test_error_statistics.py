import csv
from pathlib import Path

import numpy as np
import pytest

from experiments import common
from experiments.paper import error_statistics, fms_transfer, model_comparison
from experiments.trainings.data_efficiency import share
from experiments.trainings.data_efficiency import variants as shares
from experiments.trainings.feature_sets import variants as feature_variants
from surrogate.architectures.naming import FAMILIES, Family, names, paper_names
from tests.experiments import models
from tests.experiments.models import COLUMNS, SPLIT

DIGEST = "of the data set"


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    for module in (common, model_comparison):
        monkeypatch.setattr(module, "dataset_digest", lambda _: DIGEST)
    return tmp_path / "dataset.h5"


def write_model(folder, mse, **settings):
    return models.write_model(folder, mse, **{"dataset_sha256": DIGEST} | settings)


def test_quartiles_are_equal_ranks_of_mse():
    mse = np.array([5.0, 1.0, 2.0, 8.0, 3.0, 7.0, 4.0, 6.0])
    assert error_statistics.quartile_of(mse).tolist() == [2, 0, 0, 3, 1, 3, 1, 2]
    errors = {name: np.arange(1.0, 9.0) for name in COLUMNS}
    statistics = error_statistics.statistics(errors)
    assert statistics["quartiles"]["Q1"]["count"] == 2
    assert statistics["quartiles"]["Q1"]["mse"] == pytest.approx({"mean": 1.5, "sd": np.std([1.0, 2.0], ddof=1)})
    assert statistics["overall"]["hysteresis_percent"]["median"] == 4.5
    assert statistics["spearman"]["pull_off_and_hysteresis"] == pytest.approx(1.0)


def write_errors(folder, rows):
    with (folder / "test_errors.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["trajectory", *COLUMNS])
        writer.writerows([[row, *[0.1 * row + 0.1] * len(COLUMNS)] for row in rows])


@pytest.mark.parametrize(("ended_by", "median"), [("recipe", 1.25), ("--epochs", None)])
def test_errors_are_read_from_a_model_folder(ended_by, median, tmp_path, dataset):
    write_errors(write_model(tmp_path / "M1-concat", 1.0, split=SPLIT | {"test": list(range(8))}), range(8))
    study = error_statistics.study({"model": "M1-concat"}, tmp_path, dataset)
    assert (study["swift"]["trajectories"], study["paper"]) == (8, None)
    settings = {"split": SPLIT | {"test": list(range(8, 16))}, "ended_by": ended_by}
    write_errors(write_model(tmp_path / "M1-concat-paper", 1.0, **settings), range(8, 16))
    again = error_statistics.study({"model": "M1-concat"}, tmp_path, dataset)
    theirs = again["paper"]
    assert (theirs and theirs["overall"]["mse"]["median"]) == (median and pytest.approx(median))
    assert again["swift"]["overall"]["mse"]["median"] == pytest.approx(0.45)
    with pytest.raises(FileNotFoundError, match="make model-paper-recipe"):
        error_statistics.study({"model": "M2-concat"}, tmp_path, dataset)


def test_errors_that_grow_with_the_mse():
    errors = {name: np.arange(1.0, 21.0) for name in COLUMNS} | {"hysteresis_percent": np.arange(20.0, 0.0, -1.0)}
    errors["mse"] = np.where(np.arange(20) < 18, 1.0, 41.0)
    statistics = error_statistics.statistics(errors)
    assert statistics["squared_error_of_worst_tenth_percent"] == 82.0
    grows = statistics["grows_with_quartile"]
    assert (grows["pull_off_force_percent"], grows["hysteresis_percent"]) == (True, False)
    assert not statistics["waveform_orders_more"]  # equally


def test_errors_of_other_test_parts_refused(tmp_path, dataset):
    write_errors(write_model(tmp_path / "part", 1.0), range(8))
    with pytest.raises(ValueError, match=r"of the 2 trajectories .* received 8 others"):
        error_statistics.held_out_errors(tmp_path / "part", dataset)
    write_errors(write_model(tmp_path / "data", 1.0, dataset_sha256="of others"), [3, 4])
    with pytest.raises(ValueError, match="must have been trained on"):
        error_statistics.held_out_errors(tmp_path / "data", dataset)
    with pytest.raises(ValueError, match="must have been trained on"):
        fms_transfer.held_out(tmp_path / "data", dataset, {"trajectories": 0})


def test_the_best_number_of_steps_errs_least(monkeypatch):
    monkeypatch.setattr(common, "load_surrogate", lambda *_: None)
    monkeypatch.setattr(fms_transfer, "held_out", lambda *_: ({}, []))
    errors = {100: {"mse": {"mean": 2.0}, "nmae_percent": {"median": 1.0}}}
    errors[120] = errors[100] | {"mse": {"mean": 1.0}}
    monkeypatch.setattr(fms_transfer, "errors_on_grid", lambda total, *_: errors[total])
    sample = {"predictions": {"100": {"mse": 1.0}, "120": {"mse": 2.0}}}
    monkeypatch.setattr(fms_transfer, "sample_transfer", lambda *_: sample)
    monkeypatch.setattr(fms_transfer, "by_recipe", lambda *_: {"paper": "M1-concat-paper", "swift": "M1-concat"})
    study = fms_transfer.study({"model": "M1-concat", "steps": [100, 120], "sample": 8}, Path("models"), None)
    best = {"best_for_the_sample": "100", "best_for_the_test_set": "120"}
    assert [study[recipe]["summary"] for recipe in ("paper", "swift")] == [best, best]


def test_what_is_missing_names_the_command(tmp_path, dataset):
    with pytest.raises(FileNotFoundError, match="surrogate train"):
        error_statistics.read_table(tmp_path / "absent", "test_errors")
    with pytest.raises(FileNotFoundError, match="make models"):
        model_comparison.study(tmp_path, dataset)


def test_missing_models_leave_ranking_open(tmp_path, dataset):
    write_model(tmp_path / "M1-concat", 2.0)
    write_model(tmp_path / "M1-gated", 1.0)
    study = model_comparison.study(tmp_path, dataset)
    assert len(study["missing"]) == 16
    assert study["comparison"]["ranking"] == ["M1-gated", "M1-concat"]
    assert study["models"]["M1-concat"]["core_seconds"] == 120.0
    assert study["models"]["M1-concat"]["minutes_to_paper_mse"] == 2.0


def test_models_trained_alike_are_compared(tmp_path, dataset):
    different = {
        "M1-FiLM": ("recipe", {"recipe": {"name": "other"}}),
        "M1-gated": ("split", {"split": SPLIT | {"test": [0, 1]}}),
        "M2-concat": ("data set", {"dataset_sha256": "of others"}),
        "M1-concat-8-epochs": ("test part", {"split": SPLIT | {"test": [1]}}),
        "M1-concat-large": ("data set", {"dataset_sha256": "of others"}),
    }
    for name, (_, settings) in different.items():
        write_model(tmp_path / name, 0.1, **settings)
    write_model(tmp_path / "M1-concat", 1.0)
    # Another backend is no other training, as little as another seed is.
    write_model(tmp_path / "M2-FiLM", 0.1, backend="jax")
    # On purpose.
    write_model(tmp_path / "M1-concat-more", 0.1, split=SPLIT | {"train": [0]}, extra_dataset_sha256="1")
    write_model(tmp_path / "M1-concat-paper", 0.1, recipe={"name": "paper"})
    study = model_comparison.study(tmp_path, dataset)
    assert (study["comparison"]["ranking"], len(study["missing"])) == (["M2-FiLM", "M1-concat"], 13)
    assert list(study["beside"]) == ["M1-concat-more", "M1-concat-paper"]
    assert study["beside"]["M1-concat-paper"]["recipe"]["name"] == "paper"
    sentences = study["outdated"]
    reasons = {name: sentence.split("its ")[1].split(" is not that")[0] for name, sentence in sentences.items()}
    assert reasons == {name: word for name, (word, _) in different.items()}
    assert study["differences"] == {name: [word] for name, word in reasons.items()}
    assert sentences["M1-FiLM"].endswith("M1-FiLM' and train it again.")
    remove = f": remove {str(tmp_path / 'M1-concat-large')!r} and train it again."
    assert sentences["M1-concat-large"].endswith(remove)


def test_paper_recipe_summary_waits_for_all():
    def one(mse, hours):
        return {"validation_mse": 2.0 * mse, "epochs": int(hours), "ended_by": "recipe", "mse": mse}

    beside = {f"{name}-paper": one(1e-4, rank + 1.0) for rank, name in enumerate(paper_names())}
    beside |= {
        f"M1-concat-inputs-{name}-paper": one(mse, 1.0) for name, mse in zip("ABC", (9e-4, 3e-4, 2e-4), strict=True)
    }
    paper = model_comparison.by_paper_recipe(beside)
    assert paper["most_epochs"] == 18
    assert paper["mse"]["features-D"] == paper["mse"]["M1-concat"] == 1e-4
    assert paper["validation_mse"] == {"A": 18e-4, "B": 6e-4, "C": 4e-4, "D": 2e-4}
    assert paper["a_over_d"] == pytest.approx(9.0)
    assert paper["all_improve_over_a"] is True

    beside["M6-gated-paper"]["ended_by"] = "--epochs"  # cut short, so that it is none
    beside["M1-concat-inputs-B-paper"] = one(1e-3, 1.0)
    paper = model_comparison.by_paper_recipe(beside)
    assert (paper["most_epochs"], paper["all_improve_over_a"]) == (None, False)
    del beside["M1-concat-inputs-B-paper"]
    paper = model_comparison.by_paper_recipe(beside)
    assert len(paper["trained"]) == 17
    assert paper["all_improve_over_a"] is None


def test_own_family_stands_beside_the_18(tmp_path, dataset, monkeypatch):
    monkeypatch.setitem(FAMILIES, "M7", Family("one more"))
    for name in names():
        write_model(tmp_path / name, 0.1 if name == "M7-concat" else 1.0)
    study = model_comparison.study(tmp_path, dataset)
    assert list(study["beside"]) == ["M7-FiLM", "M7-concat", "M7-gated"]
    assert (len(study["models"]), study["expected"], study["missing"]) == (18, 18, [])
    assert "M7-concat" not in study["comparison"]["ranking"]


def test_variants_are_those_of_the_paper():
    config = {"architecture": "M1-concat", "recipe": "swift", "epochs": 0, "sets": ["A", "D"]}
    variants = feature_variants(config)
    assert [variant.features for variant in variants.values()] == ["A", "D"]
    commands = [variant.command(dataset="d", work=Path("work")) for variant in variants.values()]
    assert commands[0][:2] == ["train", "M1-concat"]
    assert [command[command.index("--dataset") + 1] for command in commands] == ["d", "d"]
    assert {(v.recipe, v.fraction, v.epochs) for v in variants.values()} == {("swift", 1.0, 0)}
    config = common.read_config(common.CONFIGS / "data_efficiency.toml")
    variants = shares(config)
    assert len(variants) == 36
    assert {percent for percent, _ in variants} == {100, 75, 50, 25, 12.5, 6.25, 3.125, 1.55125}
    assert variants[50, 4].fraction == 0.5
    assert next(iter(variants.values())).fraction == 1.0
    folds = [{"mse": mse, "training_trajectories": 8} for mse in (1.0, 3.0)]
    assert share(50, folds)["mse_sd"] == pytest.approx(np.sqrt(2.0))
    assert len({variant.label for variant in variants.values()}) == 36
    # The largest share is trained as long as the whole, and smaller ones longer.
    assert config["epochs"][0] == config["whole_epochs"]
    assert config["epochs"] == sorted(config["epochs"])
    assert config["percents"] == sorted(config["percents"], reverse=True)


@pytest.mark.parametrize("path", sorted((common.CONFIGS / "smoke").glob("*.toml")), ids=lambda path: path.stem)
def test_smoke_configuration_has_known_keys(path, tmp_path):
    usual = common.read_config(common.CONFIGS / path.name)
    assert common.read_config(path).keys() == usual.keys()
    (tmp_path / path.name).write_text("one = 1\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"must hold .* only; received one"):
        common.read_config(tmp_path / path.name)
