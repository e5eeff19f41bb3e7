import pytest

from experiments.trainings import variants as trainings
from experiments.trainings.variants import Variant
from surrogate.data.dataset import TrajectoryDataset
from tests.experiments.models import write_training


@pytest.fixture
def data(dataset):
    return TrajectoryDataset.load(dataset)


@pytest.fixture
def queue(monkeypatch, tmp_path):
    """Stands in for training: each variant appears with an error of 0.5, but for the labels refused."""
    refused, started = set(), []

    def run(label, command, runs):
        options = dict(zip(command[2::2], command[3::2], strict=True))
        numbers = int(options["--epochs"]), options["--features"], float(options["--fraction"]), int(options["--fold"])
        started.append(label)
        if label in refused:
            return label, trainings.STOPPED
        variant = Variant(label, command[1], options["--recipe"], *numbers)
        write_training(tmp_path / "models" / label, variant, TrajectoryDataset.load(options["--dataset"]), 0.5)
        (tmp_path / "models" / label / "model.weights.h5").touch()
        return label, 0

    monkeypatch.setattr(trainings, "run_training", run)
    return refused, started
