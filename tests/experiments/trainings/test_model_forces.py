"""Which published models and seeds belong to the shipped data set: from its arrays by numpy alone."""

import csv
import dataclasses
import json
from functools import partial

import h5py
import numpy as np
import pytest

from experiments.trainings import model_forces
from surrogate.data.dataset import TrajectoryDataset
from surrogate.prediction.files import PUBLISHED

ROOT = PUBLISHED.parent
SEEDS = sorted(path.parent for path in ROOT.glob("seeds/*/seed-*/run.json"))
SUMS = (ROOT / "SHA256SUMS").read_text(encoding="utf-8").split()
MODELS = sorted(path.parent for path in ROOT.glob("models/*/run.json") if f"models/{path.parent.name}/run.json" in SUMS)


def label(folder):
    return f"{folder.parent.name}/{folder.name}"


def read(path):
    return json.loads(path.read_text(encoding="utf-8"))


def symlog(values):
    return np.sign(values) * np.log1p(np.abs(values))


@pytest.fixture(scope="module")
def force():
    with h5py.File(ROOT / "dataset.h5") as file:
        return file["fms/force"][:].astype(np.float64)


@pytest.fixture(scope="module")
def split():
    """The division that all published trainings share."""
    return read(ROOT / "models" / "M1-concat" / "split.json")


def written_errors(folder):
    with (folder / "test_errors.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def same_moments(folder, values):
    """The moments of the forces agree within the solver's accuracy; a recomputed file differs by less."""
    mean, deviation = read(folder / "scaling.json")["force"]
    return np.isclose(mean, values.mean(), rtol=1e-3) and np.isclose(deviation, values.std(), rtol=1e-3)


@pytest.mark.parametrize("folder", SEEDS, ids=label)
def test_every_seed_errs_on_the_shared_test_part(folder, split):
    assert [int(row["trajectory"]) for row in written_errors(folder)] == split["test"]


@pytest.mark.parametrize("folder", MODELS, ids=label)
def test_every_published_model_belongs_to_the_shipped_forces(folder, force):
    listed = read(ROOT / "model_forces.json")
    assert set(listed["models"]) == {path.name for path in MODELS}
    assert listed["others"] == []
    if read(folder / "run.json")["extra_dataset_sha256"]:
        pytest.skip("its statistics are of two data sets; the study compares its errors instead")
    train = read(folder / "split.json")["train"]
    assert same_moments(folder, symlog(force[train]))


@pytest.mark.parametrize("folder", [*MODELS, *SEEDS], ids=label)
def test_the_summary_is_that_of_the_written_errors(folder):
    rows, summary = written_errors(folder), read(folder / "metrics.json")["test"]
    for name, found in summary.items():
        values = np.array([float(row[name]) for row in rows])
        wanted = [values.mean(), np.median(values), np.percentile(values, 90), values.max()]
        np.testing.assert_allclose(list(found.values()), wanted, rtol=1e-5, err_msg=name)


@pytest.mark.parametrize("backend", ["keras", "onnx"])
def test_the_weights_of_a_model_err_as_written(backend, monkeypatch):
    load, data = model_forces.common.load_surrogate, TrajectoryDataset.load(ROOT / "dataset.h5")
    monkeypatch.setattr(model_forces.common, "load_surrogate", partial(load, backend=backend))
    assert model_forces.error_difference(ROOT / "models" / "M1-gated", data) < model_forces.SAME_ERROR


@pytest.mark.slow
def test_the_published_list_is_what_the_study_finds():
    found = model_forces.study(ROOT / "dataset.h5", ROOT / "models")
    listed = read(ROOT / "model_forces.json")
    assert found["others"] == listed["others"]
    assert found["forces_sha256"] == listed["forces_sha256"]


def test_a_model_of_other_forces_is_told_from_one_of_these(split):
    data, folder = TrajectoryDataset.load(ROOT / "dataset.h5"), ROOT / "models" / "M1-gated"
    train = np.array(split["train"])
    assert model_forces.forces_agree(folder, data, train)
    moved = dataclasses.replace(data, force=data.force * 1.01)
    assert not model_forces.forces_agree(folder, moved, train)
