"""The exported models with bands against the predictor: forces, and what a page needs besides."""

import json

import numpy as np
import onnx
import onnxruntime
import pytest

import surrogate
from bem import LoadingProtocol
from bem.dataset.designs import QUANTITIES
from bem.dataset.physical_steps import physical_grid
from surrogate.data.features import edge_from_counts
from surrogate.export.onnx_file import is_intact
from surrogate.prediction.bands import Bands
from surrogate.prediction.files import PUBLISHED_BANDED as PUBLISHED
from surrogate.training.exporting import banded_content
from tests.surrogate.conftest import scenes

pytestmark = pytest.mark.skipif(not (PUBLISHED / "fast").is_dir(), reason="`make pretrained` writes the models")


@pytest.fixture(scope="module", params=["fast", "accurate"])
def model(request):
    return surrogate.load(request.param)


@pytest.fixture(scope="module")
def solids(model):
    """Protocols over the whole training, and its corners, where steps are shortest and rates fastest."""
    rng = np.random.default_rng(5)
    low, high = np.log([model.scaling.ranges[name] for name in (*QUANTITIES, "modulus_ratio")]).T
    corners = np.array([[(row >> bit) & 1 for bit in range(6)] for row in range(64)], dtype=float)
    values = np.exp(low + (high - low) * np.concatenate([corners, rng.random((64, 6))]))
    return dict(zip((*QUANTITIES, "modulus_ratio"), np.clip(values, np.exp(low), np.exp(high)).T.copy(), strict=True))


def run(content, model, solids, *outputs):
    times, indentations = physical_grid(**solids, counts=model.counts)
    inputs = {"times": times, "indentations": indentations, "edge": edge_from_counts(model.counts, len(times))}
    inputs |= {name: solids[name] for name in ("tabor", "modulus_ratio")}
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    return times, indentations, session.run(list(outputs), inputs)


def test_forces_are_those_of_the_model(model, solids):
    _, _, (force,) = run(banded_content(model), model, solids, "force")
    protocols = [
        LoadingProtocol(**{name: float(solids[name][row]) for name in QUANTITIES if name != "tabor"})
        for row in range(len(force))
    ]
    expected = model.predict(scenes(solids["tabor"], solids["modulus_ratio"]), protocols)
    assert not any(one.extrapolated for one in expected)
    scaled = [model.scaling.scale_force(values) for values in (force, [one.force for one in expected])]
    np.testing.assert_allclose(*scaled, atol=2e-5)


def test_the_file_holds_its_bands_ranges_and_counts(model):
    content = banded_content(model)
    assert is_intact(content)
    assert content == banded_content(model)
    found = {entry.key: entry.value for entry in onnx.load_model_from_string(content).metadata_props}
    assert found["format"] == "viscoelastic-contact-pretrained-onnx"
    assert json.loads(found["counts"]) == list(model.counts)
    assert {name: tuple(bounds) for name, bounds in json.loads(found["ranges"]).items()} == model.scaling.ranges
    arrays = json.loads(found["bands"])
    del arrays["levels"]
    stored = Bands(**{name: np.array(values) for name, values in arrays.items()})
    quantities = np.exp(np.random.default_rng(1).uniform(-3.0, 3.0, (40, 7)))
    for coverage in (0.5, 0.9, 0.95):
        widths = (kept.widths(quantities, coverage) for kept in (stored, model.bands))
        for one, other in zip(*(found.values() for found in widths), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-6)


def test_the_package_loads_it_by_name_only(model, tmp_path):
    (tmp_path / "page.onnx").write_bytes(banded_content(model))
    with pytest.raises(ValueError, match=rf"page\.onnx, which holds the pretrained model {model.name} for other"):
        surrogate.load(tmp_path / "page.onnx")
