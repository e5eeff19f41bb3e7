import json
from dataclasses import replace

import numpy as np
import pytest

from bem import LoadingProtocol
from surrogate.prediction.loading import load_banded
from tests.physical_data import physical_dataset
from tests.surrogate.prediction.predicting import SCENE

pretrained = pytest.importorskip("surrogate.training.pretrained")
COUNT = 160
TINY = pretrained.Definition((6,), COUNT, replace(pretrained._RECIPE, epochs=1, batch_size=16))


@pytest.fixture(scope="module")
def dataset():
    """Any forces that depend on the inputs and have a peak: the solver's are not needed to go through the motions."""
    return physical_dataset(COUNT)


def test_a_trained_model_is_ready_to_use_and_resumed_not_repeated(dataset, tmp_path):
    folder = pretrained.train_model("fast", TINY, dataset, tmp_path, command="some")
    model = load_banded(folder)
    protocol = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=0.1, unloading_rate=10.0)
    found = model.predict(SCENE, protocol)
    assert np.isfinite(found.force).all()
    assert found.pull_off_interval[0] < found.pull_off_force < found.pull_off_interval[1]
    run = json.loads((folder / "run.json").read_text())
    assert (run["units"], run["counts"], run["command"]) == ([6], [22, 8, 72], "some")
    assert run["training_trajectories"] + 2 * run["calibration_trajectories"] == COUNT
    before = (folder / "model.onnx").read_bytes()
    seen = []
    pretrained.train_model("fast", TINY, dataset, tmp_path, command="some", report=seen.append)
    assert seen == []
    assert (folder / "model.onnx").read_bytes() == before


def test_another_data_set_is_refused(dataset, tmp_path):
    with pytest.raises(ValueError, match=r"physical steps and a range of modulus ratios"):
        pretrained.train_model("fast", TINY, replace(dataset, steps="uniform"), tmp_path)
    with pytest.raises(ValueError, match=r"at least 1000 trajectories. Received: 160"):
        pretrained.train_model("fast", replace(TINY, trajectories=1000), dataset, tmp_path)
