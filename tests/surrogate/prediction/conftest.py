import json

import keras
import numpy as np
import pytest

from bem.dataset.measurement_steps import PHYSICAL
from surrogate.data.scaling import Scaling
from surrogate.export.onnx import network_content
from surrogate.export.onnx_file import seal_folder
from surrogate.prediction.bands import Bands
from surrogate.prediction.loading import load_banded

RANGES = {
    "tabor": (0.2, 3.2),
    "peak_indentation": (2.0, 100.0),
    "loading_rate": (0.1, 1000.0),
    "dwell_time": (1e-3, 3.0),
    "unloading_rate": (0.1, 1000.0),
    "modulus_ratio": (0.01, 1.0),
}


@pytest.fixture
def untrained(tmp_path):
    """A folder as `make pretrained` leaves it, of a network that nobody trained."""
    from surrogate.training.pretrained import network

    folder = tmp_path / "fast"
    folder.mkdir()
    keras.utils.set_random_seed(0)
    (folder / "model.onnx").write_bytes(network_content([network("LSTM", (4,), PHYSICAL)], "F", "fast"))
    Scaling("F", (0.0,) * 12, (1.0,) * 12, (0.7, 0.3), (1.5, 1.0), RANGES).save(folder / "scaling.json")
    (folder / "run.json").write_text(json.dumps({"counts": [22, 8, 72]}))
    rng = np.random.default_rng(0)
    errors = np.exp(rng.normal(size=(4000, 105)) - 4.0)
    known = np.exp(rng.uniform(*np.log([*RANGES.values(), (1e-4, 0.5)]).T, (4000, 7)))
    bands = Bands.calibrate(RANGES, known, errors[:, :3].T, errors[:, 3:], 2000)
    bands.quantiles[:, :64] = bands.quantiles[:, 64:65]  # of corners in which nothing was drawn
    np.savez(folder / "bands.npz", **bands.as_arrays())
    seal_folder(folder)
    return folder


@pytest.fixture
def banded(untrained):
    return load_banded(untrained)
