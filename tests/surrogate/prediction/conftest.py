"""What tests of predictions share: protocols, how a mistake must end, untrained models."""

import re
import shutil

import keras
import numpy as np
import pytest

from bem import Scene, StandardLinearSolid
from bem.dataset.measurement_steps import PHYSICAL
from surrogate.data.scaling import Scaling
from surrogate.export.onnx import network_content
from surrogate.prediction.bands import Bands
from surrogate.prediction.files import write_run
from surrogate.prediction.loading import load_banded

PROTOCOL = {"peak_indentation": 20.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0}
FLAGS = [word for key, value in PROTOCOL.items() for word in (f"--{key.replace('_', '-')}", str(value))]
SCENE = Scene(1.0, StandardLinearSolid(0.1))


def refused(command, words, *, folder):
    """The one sentence a mistake ends in; nothing may be left behind."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    code, out, err = command(*words)
    assert (code, out) == (2, ""), err
    # One sentence, and not one within another.
    assert re.match(r"surrogate: (Expected|\w+ must|the \w+ phase must) ", err)
    assert len(re.findall(r"\b[Rr]eceived\b", err)) == 1
    assert err.count("\n") == 1
    assert len(err) < 1000
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    return err


RANGES = {
    "tabor": (0.2, 3.2),
    "peak_indentation": (2.0, 100.0),
    "loading_rate": (0.1, 1000.0),
    "dwell_time": (1e-3, 3.0),
    "unloading_rate": (0.1, 1000.0),
    "modulus_ratio": (0.01, 1.0),
}


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """A folder as `make pretrained` leaves it, of a network that nobody trained."""
    from surrogate.training.pretrained import network

    folder = tmp_path_factory.mktemp("made") / "fast"
    folder.mkdir()
    keras.utils.set_random_seed(0)
    (folder / "model.onnx").write_bytes(network_content([network("LSTM", (4,), PHYSICAL)], "F", "fast"))
    Scaling("F", (0.0,) * 12, (1.0,) * 12, (0.7, 0.3), (1.5, 1.0), RANGES).save(folder / "scaling.json")
    rng = np.random.default_rng(0)
    errors = np.exp(rng.normal(size=(4000, 105)) - 4.0)
    known = np.exp(rng.uniform(*np.log([*RANGES.values(), (1e-4, 0.5)]).T, (4000, 7)))
    bands = Bands.calibrate(RANGES, known, errors[:, :3].T, errors[:, 3:], 2000)
    bands.quantiles[:, :64] = bands.quantiles[:, 64:65]  # of corners in which nothing was drawn
    np.savez(folder / "bands.npz", **bands.as_arrays())
    write_run(folder, {"counts": [22, 8, 72]})
    return folder


@pytest.fixture
def untrained(made, tmp_path):
    """A copy of it, to damage."""
    return shutil.copytree(made, tmp_path / "fast")


@pytest.fixture(scope="session")
def banded(made):
    return load_banded(made)
