import json

import numpy as np
import pytest

from surrogate.data.scaling import Scaling
from surrogate.pretrained.bands import Bands
from surrogate.pretrained.model import Pretrained
from surrogate.pretrained.network import CHANNELS, onnx_file

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
    folder = tmp_path / "fast"
    folder.mkdir()
    rng = np.random.default_rng(0)
    shapes = [(CHANNELS, 16), (4, 16), (16,), (4, 6), (6,), (6, 1), (1,)]
    weights = [rng.normal(scale=0.3, size=shape).astype(np.float32) for shape in shapes]
    (folder / "model.onnx").write_bytes(onnx_file(weights, "fast"))
    Scaling("F", (0.0,) * 12, (1.0,) * 12, (0.7, 0.3), (1.5, 1.0), RANGES).save(folder / "scaling.json")
    (folder / "run.json").write_text(json.dumps({"counts": [22, 8, 72]}))
    errors = np.exp(rng.normal(size=(200, 103)) - 4.0)
    bands = Bands.calibrate(np.exp(rng.normal(size=(200, 7))), errors[:, 0], errors[:, 1:], 50)
    np.savez(folder / "bands.npz", **bands.as_arrays())
    return folder


@pytest.fixture
def model(untrained):
    return Pretrained(untrained)
