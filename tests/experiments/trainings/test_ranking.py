"""Statistics of a ranking against cases made by hand, and the study on a small tree of published seeds."""

import csv
import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from experiments import run_folders
from experiments.trainings import ranking
from surrogate.architectures.naming import paper_names

TRAJECTORIES = 200
RNG = np.random.default_rng(5)
HARDNESS = RNG.lognormal(0.0, 1.0, TRAJECTORIES)


def drawn_of(factors):
    """Hierarchical replicates of models whose seeds err by these factors, all on the same hard trajectories."""
    indices = ranking.resampled(TRAJECTORIES, 500)
    by_model = {}
    for name, seeds in factors.items():
        noise = np.random.default_rng([*name.encode()]).lognormal(0.0, 0.05, (len(seeds), TRAJECTORIES))
        errors = np.array(seeds)[:, np.newaxis] * HARDNESS * noise
        by_model[name] = {metric: ranking.replicates(errors, indices, metric) for metric in ranking.COLUMNS}
    return {
        metric: {name: ranking.hierarchical(by_metric[metric], name) for name, by_metric in by_model.items()}
        for metric in ranking.COLUMNS
    }


def order_of(factors):
    contenders = {name: [name] for name in factors}
    trained = {name: seeds for name, seeds in factors.items() if seeds}
    (pair,) = ranking.orders("a", contenders, drawn_of(trained), {name: len(seeds) for name, seeds in trained.items()})
    return pair


@pytest.mark.parametrize(
    ("first", "second", "decision"),
    [
        ([1.0, 1.0, 1.0], [2.0, 2.1, 2.2], "holds"),
        ([2.0, 2.1, 2.2], [1.0, 1.0, 1.0], "fails"),
        ([1.0, 1.3, 1.1], [1.1, 1.2, 1.0], "tie"),
        # Better on every trajectory by one seed, worse by the other: the test set alone would decide it.
        ([1.0, 1.6], [1.3, 1.3], "tie"),
        ([1.0], [2.0, 2.0], "not decided"),
        ([1.0, 1.0], [], "not decided"),
    ],
)
def test_order_depends_on_seeds_and_errors(first, second, decision):
    pair = order_of({"a": first, "b": second})
    assert pair["decision"] == decision
    assert pair["seeds"] == [len(first), len(second)]
    assert (pair["probability"]["test_mse"] is None) == (decision == "not decided")


def test_equal_models_tie_and_best_counts():
    replicates = np.ones((2, 10))
    assert ranking.probability([replicates[0]], [replicates[1]]) == 0.5
    assert ranking.decision(0.5) == ranking.TIE
    assert ranking.decision(None) == ranking.NOT_DECIDED
    drawn = {metric: {"a": np.full(9, 2.0), "b": np.full(9, 3.0), "c": np.full(9, 1.0)} for metric in ranking.COLUMNS}
    (pair,) = ranking.orders("A", {"A": ["a"], "B": ["b", "c"]}, drawn, dict.fromkeys("abc", 3))
    assert pair["probability"]["test_mse"] == 0.0
    (pair,) = ranking.orders("A", {"A": ["a"], "B": ["b", "c"]}, drawn, {"a": 3, "b": 3, "c": 1})
    assert pair["decision"] == "not decided"


@pytest.mark.parametrize(
    ("decisions", "overall"),
    [
        (["holds", "holds"], "holds"),
        (["holds", "tie"], "tie"),
        (["holds", "tie", "not decided"], "not decided"),
        (["holds", "fails", "not decided"], "fails"),
    ],
)
def test_ranking_fails_with_one_order(decisions, overall):
    assert ranking.verdict(decisions) == overall


def test_interval_of_mean_is_standard_error():
    errors = np.random.default_rng(1).normal(10.0, 2.0, (1, 1000))
    low, high = ranking.interval(ranking.replicates(errors, ranking.resampled(1000, 2000), "test_mse"))
    assert high - low == pytest.approx(2 * 1.96 * errors.std() / np.sqrt(1000), rel=0.1)
    low, high = ranking.interval(ranking.replicates(errors, ranking.resampled(1000, 2000), "hysteresis_percent"))
    assert low < np.median(errors) < high
    # Three percent, where the interval over the test set is wider than a tenth: only paired resamples tell.
    drawn = drawn_of({"a": [1.0, 1.0], "b": [1.03, 1.03]})["test_mse"]
    assert np.ptp(np.quantile(drawn["a"], [0.025, 0.975])) > 0.1 * np.mean(drawn["a"])
    assert ranking.probability([drawn["a"]], [drawn["b"]]) > 0.95


def publish(root, model, seed, mse, **run):
    """Add a seed to `seeds.h5` whose errors are all `mse`, on trajectories of different hardness."""
    folder = root / "folders" / f"{model}-seed-{seed}"
    folder.mkdir(parents=True)
    run = {"name": folder.name, "seed": seed, "dataset_sha256": "d" * 64, "backend": "torch", "features": "D"} | (
        {"architecture": model, "recipe": {"name": "swift", "seed": seed}} | run
    )
    values = mse * HARDNESS
    spread = {"mean": values.mean(), "median": float(np.median(values))}
    (folder / "run.json").write_text(json.dumps(run), encoding="utf-8")
    metrics = {"test": dict.fromkeys(ranking.COLUMNS.values(), spread)}
    (folder / "metrics.json").write_text(json.dumps(metrics), encoding="utf-8")
    history = f"epoch,learning_rate,train_mse,validation_mse,cpu_seconds\n1,1,1,{3 * mse},1\n2,1,1,{2 * mse},2\n"
    (folder / "history.csv").write_text(history, encoding="utf-8")
    with (folder / "test_errors.csv").open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["trajectory", *ranking.COLUMNS.values()])
        rows.writerows([k, *[value] * len(ranking.COLUMNS)] for k, value in enumerate(values))
    run_folders.add_seeds(root / "seeds.h5", [folder])
    return folder


@pytest.fixture
def studied(tmp_path, monkeypatch):
    """The study, of a data set that has nothing but its digest."""
    data = SimpleNamespace(sha256="d" * 64)
    monkeypatch.setattr(ranking, "TrajectoryDataset", SimpleNamespace(load=lambda _: data))
    monkeypatch.setattr(ranking, "RESAMPLES", 100)
    return lambda: ranking.study(tmp_path / "dataset.h5", tmp_path / "seeds.h5")


def test_the_study_ranks_what_is_published(tmp_path, studied):
    for name in paper_names():
        for seed in range(3):
            publish(tmp_path, name, seed, 1.0 + 0.01 * seed if name == "M1-concat" else 2.0 + 0.01 * seed)
    study = studied()
    json.dumps(study, allow_nan=False)
    rows = study["models"]["M1-concat"]
    assert [row["seed"] for row in rows] == [0, 1, 2]
    assert rows[1]["test_mse"] == pytest.approx(1.01 * HARDNESS.mean())
    assert rows[1]["pull_off_percent"] == pytest.approx(1.01 * np.median(HARDNESS))
    assert rows[1]["validation_mse"] == pytest.approx(2.02)
    assert study["curves"]["M1-concat"][1] == pytest.approx([3.03, 2.02])
    spread = study["spread"]["M1-concat"]["test_mse"]
    assert spread["low"] < spread["min"] < spread["median"] < spread["max"] < spread["high"]
    decisions = {name: claim["decision"] for name, claim in study["claims"].items()}
    assert (
        decisions["best_model"] == decisions["concatenation_suffices"] == decisions["best_conditioning/M1"] == "holds"
    )
    assert decisions["best_conditioning/M2"] == decisions["second_family"] == "tie"
    assert decisions["d_better_than_c"] == "not decided"
    assert study["claims"]["best_conditioning/M3"]["level"] == ["FiLM", "concat", "gated"]
    assert study["missing"] == {}
    assert sum(pair["claim"] == "best_model" for pair in study["pairs"]) == 17


def test_another_model_moves_no_number(tmp_path, studied):
    def numbers():
        study = studied()
        chances = [pair["probability"] for pair in study["pairs"] if pair["worse"] == "M1-FiLM"]
        return study["spread"]["M1-concat"], chances

    for seed in range(2):
        publish(tmp_path, "M1-concat", seed, 1.0 + seed)
        publish(tmp_path, "M1-FiLM", seed, 1.3 + 0.1 * seed)
    before = numbers()
    assert 0.1 < before[1][0]["test_mse"] < 0.9
    publish(tmp_path, "M1-gated", 0, 1.0)
    assert numbers() == before


def test_few_or_no_seeds_are_stated(tmp_path, studied):
    assert studied()["models"] == {}
    publish(tmp_path, "M1-concat", 1, 1.0)
    study = studied()
    assert len(study["missing"]) == 18
    assert study["missing"]["M1-concat"] == [0, 2]
    assert study["missing"]["M6-gated"] == [0, 1, 2]
    assert {pair["decision"] for pair in study["pairs"]} == {"not decided"}


def test_differently_trained_seeds_left_out(tmp_path, studied):
    for seed in range(2):
        publish(tmp_path, "M1-concat", seed, 1.0)
    publish(tmp_path, "M1-FiLM", 0, 1.0, dataset_sha256="e" * 64)
    publish(tmp_path, "M2-concat", 0, 1.0, architecture="M3-concat")
    publish(tmp_path, "M2-gated", 0, 1.0, recipe={"name": "paper", "seed": 0})
    publish(tmp_path, "M1-concat", 2, 1.0, backend="tensorflow")
    study = studied()
    assert list(study["models"]) == ["M1-concat"]
    assert [row["backend"] for row in study["models"]["M1-concat"]] == ["torch", "torch", "tensorflow"]
    reasons = {label: sentence.split("its ")[1] for label, sentence in study["left_out"].items()}
    reasons_expected = ("data set", "model", "recipe")
    names = ("M1-FiLM", "M2-concat", "M2-gated")
    assert reasons == {f"{name}/seed-0": f"{word} differs" for name, word in zip(names, reasons_expected, strict=True)}


@pytest.mark.parametrize("damage", [Path.unlink, lambda path: path.write_text("trajectory,mse\n1,a\n")])
def test_an_incomplete_seed_is_not_added(tmp_path, damage):
    folder = publish(tmp_path, "M1-concat", 0, 1.0)
    before = (tmp_path / "seeds.h5").read_bytes()
    damage(folder / "test_errors.csv")
    with pytest.raises(ValueError, match="expected a complete training; received"):
        run_folders.add_seeds(tmp_path / "seeds.h5", [folder])
    assert (tmp_path / "seeds.h5").read_bytes() == before


def test_a_seed_without_errors_is_refused():
    training = {"run": {"seed": 0, "backend": "torch"}, "history": {"validation_mse": np.ones(1)}}
    with pytest.raises(ValueError, match="it lacks 'test_errors'"):
        ranking.seed_facts(training)


def test_seed_has_the_numbers_of_its_folder(tmp_path):
    publish(tmp_path, "M1-concat", 0, 9.0)
    shutil.rmtree(tmp_path / "folders")
    folder = publish(tmp_path, "M1-concat", 0, 0.1)
    publish(tmp_path, "M1-concat", 1, 0.2)
    trainings = run_folders.read_trainings(tmp_path / "seeds.h5")
    assert list(trainings) == ["M1-concat/seed-0", "M1-concat/seed-1"]
    tables, seed = run_folders.read_training(folder), trainings["M1-concat/seed-0"]
    for table in run_folders.TABLES:
        assert list(seed[table]) == list(tables[table])
        assert [column.tolist() for column in seed[table].values()] == [row.tolist() for row in tables[table].values()]
    assert {key: seed[key] for key in ("run", "metrics", "recipe")} == {
        key: tables[key] for key in ("run", "metrics", "recipe")
    }


def test_feature_sets_have_their_own_seeds(tmp_path, studied):
    for features, mse in (("C", 1.0), ("D", 2.0)):
        for seed in range(2):
            recipe = {"name": "swift", "epochs": 15, "seed": seed}
            run = {"architecture": "M1-concat", "features": features, "recipe": recipe}
            publish(tmp_path, f"features-{features}", seed, mse, **run)
    for seed in range(3):
        publish(tmp_path, "M1-concat", seed, 1.0)
    study = studied()
    assert study["left_out"] == {}
    assert study["claims"]["d_better_than_c"]["decision"] == "fails"
    assert study["claims"]["best_input"] == {"paper": "D", "first": "C", "level": ["D"], "decision": "fails"}


def test_unknown_ranking_is_refused():
    with pytest.raises(ValueError, match="received 'luckiest'"):
        ranking.contenders({"ranking": "luckiest", "value": "M1"})
