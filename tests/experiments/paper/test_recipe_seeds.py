"""Trainings by the paper's recipe: what they decide, the file of more seeds, and commands that exist."""

import json
import shlex

import h5py
import numpy as np
import pytest

from experiments.paper import recipe_seeds
from experiments.trainings.ranking import ranked
from surrogate.architectures.naming import names
from surrogate.training.recipe import Recipe
from tests.experiments.models import COLUMNS, write_model
from tests.processes import ROOT

DIGEST = "of the data set"
SPREAD = {name: {"test_mse": {"min": 1.0, "max": 1.1}} for name in ("features-C", "features-D", "M1-concat")}
TRAJECTORIES = 40
(D_OVER_C,) = (claim for claim in ranked() if claim["ranking"] == "d_better_than_c")
(BEST,) = (claim for claim in ranked() if claim["ranking"] == "best_model")


def errors(*means):
    """Errors of shape (seeds, trajectories), hard for all on the same trajectories."""
    hardness = np.random.default_rng(3).lognormal(0.0, 1.0, TRAJECTORIES)
    return np.array([mean * hardness / hardness.mean() for mean in means])


@pytest.mark.parametrize(
    ("c_over_d", "decision", "first"),
    [(1.3, "holds", "D"), (1.15, "not decided", "D"), (0.9, "not decided", "C"), (0.8, "fails", "C")],
)
def test_single_trainings_need_twice_the_spread(c_over_d, decision, first):
    decided = recipe_seeds.decided(D_OVER_C, {"features-D": errors(1.0), "features-C": errors(c_over_d)}, SPREAD)
    assert (decided["decision"], decided["first"], decided["seeds"]) == (decision, first, 1)
    assert decided["apart"] == pytest.approx(1.21)


@pytest.mark.parametrize(
    ("seeds_of_c", "decision"), [((1.15, 1.2, 1.18), "holds"), ((0.9, 1.1), "tie"), ((0.9, 0.85), "fails")]
)
def test_seeds_decide_what_single_ones_cannot(seeds_of_c, decision):
    decided = recipe_seeds.decided(
        D_OVER_C, {"features-D": errors(1.0, 1.01, 0.99), "features-C": errors(*seeds_of_c)}, SPREAD
    )
    assert (decided["decision"], decided["seeds"]) == (decision, len(seeds_of_c))


def test_best_model_waits_for_its_contenders():
    trained = {name: errors(3.0) for name in names()} | {"M1-concat": errors(1.0, 1.0), "M6-concat": errors(2.0, 2.0)}
    assert recipe_seeds.decided(BEST, trained, SPREAD)["decision"] == "holds"
    alone = recipe_seeds.decided(BEST, trained | {"M2-concat": errors(1.05)}, SPREAD)
    assert (alone["decision"], alone["level"]) == ("not decided", ["M1-concat", "M2-concat"])
    beaten = recipe_seeds.decided(BEST, trained | {"M6-concat": errors(0.9, 0.91)}, SPREAD)
    assert (beaten["decision"], beaten["first"]) == ("fails", "M6-concat")
    del trained["M4-FiLM"]
    assert recipe_seeds.decided(BEST, trained, SPREAD) == {"lacking": ["M4-FiLM"]}


def training(folder, mse, **run):
    """The folder of a finished training by the paper's recipe, whose trajectories all have this error."""
    settings = {"name": folder.name, "recipe": {"name": "paper"}, "ended_by": "recipe", "dataset_sha256": DIGEST}
    command = f"surrogate train M1-concat --recipe paper --label {folder.name}"
    write_model(folder, mse, **settings | {"seed": 0, "command": command} | run)
    rows = [f"{index},{','.join([repr(mse)] * len(COLUMNS))}" for index in range(TRAJECTORIES)]
    text = "\n".join(["trajectory," + ",".join(COLUMNS), *rows])
    (folder / "test_errors.csv").write_text(text, encoding="utf-8")
    return folder


def test_added_seeds_join_the_published_one(tmp_path):
    models, seeds = tmp_path / "models", tmp_path / "paper_recipe_seeds.h5"
    training(models / "M1-concat-paper", 1e-4, device="a GPU", program_removed="elsewhere")
    folders = {seed: tmp_path / f"M1-concat-paper-seed-{seed}" for seed in (1, 2)}
    recipe_seeds.add([training(path, 1e-4 * (1 + s), seed=s, backend="torch") for s, path in folders.items()], seeds)
    recipe_seeds.add([training(tmp_path / "M1-concat-paper-seed-0", 1e-4)], seeds)  # the published one again
    with h5py.File(seeds) as file:
        assert list(file["M1-concat-paper"]) == ["seed-0", "seed-1", "seed-2"]
    index = json.loads(seeds.with_suffix(".json").read_text(encoding="utf-8"))["models"]["M1-concat-paper"]
    assert {"seed": 1, "backend": "torch", "epochs": 2, "mse": 2e-4, "hours": 120 / 3600}.items() <= index[1].items()
    study = recipe_seeds.decisions(models, seeds, DIGEST, {})
    rows = [row for row in study["trainings"] if row["model"] == "M1-concat"]
    assert [row["mse"] for row in rows] == pytest.approx([1e-4, 2e-4, 3e-4])
    assert (rows[0]["device"], rows[0]["removed"], rows[1]["device"]) == ("a GPU", "elsewhere", "processor")
    assert (study["removed"], study["longest"]["mse"]) == (1, 2e-4)
    assert study["backends"] == "tensorflow of 1 trainings, torch of 2 trainings"
    assert len(study["claims"]["best_model"]["lacking"]) == 17
    assert [row["mse"] for row in recipe_seeds.decisions(models, seeds, "of another", {})["trainings"]] == []


@pytest.mark.parametrize("settings", [{"ended_by": "--epochs"}, {"recipe": {"name": "swift"}}])
def test_only_ended_trainings_are_added(settings, tmp_path):
    folder = training(tmp_path / "M1-concat-paper-seed-1", 1e-4, **settings)
    with pytest.raises(ValueError, match=r"the recipe `paper` ended; received .*M1-concat-paper-seed-1"):
        recipe_seeds.add([folder], tmp_path / "seeds.h5")
    assert not (tmp_path / "seeds.h5").exists()


def missing_programs(run):
    """Commands of a training that this repository does not have."""
    missing = []
    for command in run["command"].split("; "):
        program, *words = shlex.split(command)
        known = [program, *words[:1]] == ["surrogate", "train"] and words[1] in names()
        try:
            Recipe.load(words[words.index("--recipe") + 1] if "--recipe" in words else "swift")
        except (ValueError, FileNotFoundError):
            known = False
        if not known:
            missing.append(command)
    return missing


RUNS = sorted((ROOT / "published/models").glob("*/run.json"))


@pytest.mark.parametrize("path", RUNS, ids=lambda path: path.parent.name)
def test_published_trainings_can_be_repeated(path):
    run = json.loads(path.read_text(encoding="utf-8"))
    assert bool(missing_programs(run)) == (recipe_seeds.REMOVED in run)


def test_a_missing_program_is_seen():
    assert missing_programs({"command": "surrogate train M1-concat --recipe paper"}) == []
    for command in ("python unfinished/gpu/train.py", "surrogate train M9", "surrogate train M1-FiLM --recipe x"):
        assert missing_programs({"command": command}) == [command]
