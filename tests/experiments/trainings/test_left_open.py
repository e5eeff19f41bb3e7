"""Trainings in another unit of the force, and at the reference model's size."""

import importlib

import pytest

from experiments.trainings import left_open
from surrogate.architectures.naming import FAMILIES, PARAMETER_COUNTS
from surrogate.data.dataset import TrajectoryDataset


@pytest.mark.parametrize("family", left_open.EQUAL_UNITS)
def test_families_of_unstated_size_have_the_parameters_of_the_reference(family):
    pytest.importorskip("keras")
    module = FAMILIES[family].builder
    builder = getattr(importlib.import_module(f"surrogate.architectures.{module}"), module)
    model = builder(units=left_open.EQUAL_UNITS[family])
    assert model.count_params() == pytest.approx(PARAMETER_COUNTS["M1-concat"], rel=0.02)
    assert builder().count_params() == PARAMETER_COUNTS[f"{family}-concat"]


def test_forces_return_to_their_unit(tmp_path, dataset, monkeypatch):
    """A model that has learned its forces exactly has no error and is the first of all."""
    data, learned = TrajectoryDataset.load(dataset), {}
    split = data.split()

    class Exact:
        def __init__(self, force):
            self.force = force

        def predict_history(self, *_):
            return self.force[split.test]

    def train(_, forces, *, out, **_options):
        learned[out.name] = forces
        return True

    def load(label, _):
        return Exact(learned[label].force if label in learned else 0.5 * data.force)

    monkeypatch.setattr(left_open, "train", train)
    monkeypatch.setattr(left_open.common, "load_surrogate", load)
    monkeypatch.setattr(left_open, "read_model", lambda _: {"epochs": 30, "hours": 0.5, "backend": "torch"})
    result = left_open.study_threshold(dataset, tmp_path, work=tmp_path)
    assert result["mse"] == pytest.approx(0.0, abs=1e-20)
    assert result["pull_off_force_percent"] == pytest.approx(0.0, abs=1e-6)
    assert (result["rank"], len(result["in_the_unit_1"])) == (1, 18)
    assert min(result["in_the_unit_1"].values()) > 1e-4
