"""Which published models and seeds belong to the shipped data set: recomputed here from its arrays, by numpy alone."""

import csv
import dataclasses
import json

import h5py
import numpy as np
import pytest

import surrogate
from bem.dataset.measurement_steps import measurement_grid
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


def inputs_of(scaling, protocols):
    """Scaled inputs D, written down anew from docs/surrogate-models.md."""
    times, indentations = measurement_grid(**protocols)
    velocity, edge = np.zeros_like(times), np.zeros_like(times)
    velocity[:, 1:] = np.diff(indentations) / np.diff(times)
    edge[:, [49, 69]] = 1.0
    channels = np.stack([symlog(symlog(times)), symlog(indentations), symlog(velocity), edge], axis=-1)
    sequence = (channels - scaling["channel_mean"]) / scaling["channel_scale"]
    tabor = (symlog(protocols["tabor"]) - scaling["tabor"][0]) / scaling["tabor"][1]
    return [sequence.astype(np.float32), tabor.astype(np.float32)[:, np.newaxis]]


def check_weights(folder, force):
    """The errors that a training wrote are those of its weights on the shipped file."""
    with h5py.File(ROOT / "dataset.h5") as file:
        rows = [int(row["trajectory"]) for row in written_errors(folder)]
        protocols = {name: file[f"protocols/{name}"][:][rows] for name in file["protocols"]}
    run, scaling = read(folder / "run.json"), read(folder / "scaling.json")
    model = surrogate.build(run["architecture"], features="D")
    model.load_weights(folder / "model.weights.h5")
    predicted = model.predict(inputs_of(scaling, protocols), batch_size=512, verbose=0)[..., 0]
    mean, deviation = scaling["force"]
    residual = predicted.astype(np.float64) - (symlog(force[rows]) - mean) / deviation
    test = read(folder / "metrics.json")["test"]
    np.testing.assert_allclose(np.mean(residual**2), test["mse"]["mean"], rtol=model_forces.SAME_ERROR)
    np.testing.assert_allclose(np.mean(np.abs(residual)), test["mae"]["mean"], rtol=model_forces.SAME_ERROR)


def test_the_weights_of_a_model_err_as_written(force):
    check_weights(ROOT / "models" / "M1-gated", force)


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
