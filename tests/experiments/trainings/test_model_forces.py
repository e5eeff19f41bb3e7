"""Which published models and seeds belong to the shipped data set, and whether their summaries are of their errors."""

import dataclasses
from functools import partial

import numpy as np
import pytest

from bem._support.text_files import read_json
from experiments.run_folders import read_table, read_trainings
from experiments.trainings import model_forces
from surrogate.data.dataset import Split, TrajectoryDataset
from surrogate.data.scaling import Scaling
from surrogate.files import PUBLISHED

ROOT = PUBLISHED.parent
SEEDS = read_trainings(ROOT / "seeds.h5")
SUMS = (ROOT / "SHA256SUMS").read_text(encoding="utf-8").split()
MODELS = sorted(path.parent for path in ROOT.glob("models/*/run.json") if f"models/{path.parent.name}/run.json" in SUMS)


def label(folder):
    return f"{folder.parent.name}/{folder.name}"


@pytest.fixture(scope="module")
def data():
    return TrajectoryDataset.load(ROOT / "dataset.h5")


@pytest.fixture(scope="module")
def split():
    """The division that all published trainings share."""
    return read_json(ROOT / "models" / "split.json")


@pytest.mark.parametrize("folder", MODELS, ids=label)
def test_published_models_match_the_forces(folder, data):
    listed = read_json(ROOT / "model_forces.json")
    assert (set(listed["models"]), listed["others"]) == ({path.name for path in MODELS}, [])
    if read_json(folder / "run.json")["extra_dataset_sha256"]:
        pytest.skip("its statistics are of two data sets; the study compares its errors instead")
    train = Split.of(folder).train
    assert model_forces.forces_agree(folder, data, train)
    assert not model_forces.forces_agree(folder, dataclasses.replace(data, force=data.force * 1.01), train)
    # The same by numpy alone; a file that is computed again differs by less.
    values = np.sign(data.force[train]) * np.log1p(np.abs(data.force[train].astype(np.float64)))
    np.testing.assert_allclose(Scaling.load(folder / "scaling.json").force, [values.mean(), values.std()], rtol=1e-3)


def require_own_summary(errors, summary, split):
    assert errors["trajectory"].tolist() == split["test"]
    for name, statistics in summary.items():
        expected = [errors[name].mean(), *np.percentile(errors[name], [50, 90, 100])]
        np.testing.assert_allclose(list(statistics.values()), expected, rtol=1e-5, err_msg=name)


@pytest.mark.parametrize("folder", MODELS, ids=label)
def test_a_summary_is_of_the_models_errors(folder, split):
    errors = read_table(folder, "test_errors")
    require_own_summary(errors, read_json(folder / "metrics.json")["test"], split)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_summary_is_of_the_seeds_errors(seed, split):
    require_own_summary(SEEDS[seed]["test_errors"], SEEDS[seed]["metrics"]["test"], split)


@pytest.mark.parametrize("backend", [pytest.param("keras", marks=pytest.mark.slow), "onnx"])
def test_weights_err_as_recorded(backend, data, monkeypatch):
    load = model_forces.common.load_surrogate
    monkeypatch.setattr(model_forces.common, "load_surrogate", partial(load, backend=backend))
    assert model_forces.error_difference(ROOT / "models" / "M1-gated", data) < model_forces.SAME_ERROR


@pytest.mark.slow
def test_published_list_equals_the_study():
    study, listed = model_forces.study(ROOT / "dataset.h5", ROOT / "models"), read_json(ROOT / "model_forces.json")
    for name in ("others", "forces_sha256"):
        assert study[name] == listed[name]
