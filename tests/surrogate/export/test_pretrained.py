"""The exported pretrained models against `surrogate.pretrained`: inputs F, forces, and what a page needs besides."""

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
from surrogate.export.pretrained import file_content
from surrogate.network.onnx_file import is_intact
from surrogate.pretrained.bands import Bands
from surrogate.pretrained.kernels import scaled_inputs
from surrogate.pretrained.model import PUBLISHED

pytestmark = pytest.mark.skipif(not (PUBLISHED / "fast").is_dir(), reason="`make pretrained` writes the models")


@pytest.fixture(scope="module", params=["fast", "accurate"])
def model(request):
    return surrogate.load(request.param)


@pytest.fixture(scope="module")
def solids(model):
    """Protocols over the whole training, and its corners, where steps are shortest and rates fastest."""
    rng = np.random.default_rng(5)
    low, high = np.log([model.ranges[name] for name in (*QUANTITIES, "modulus_ratio")]).T
    corners = np.array([[(row >> bit) & 1 for bit in range(6)] for row in range(64)], dtype=float)
    values = np.exp(low + (high - low) * np.concatenate([corners, rng.random((64, 6))]))
    return dict(zip((*QUANTITIES, "modulus_ratio"), np.clip(values, np.exp(low), np.exp(high)).T.copy(), strict=True))


def run(content, model, solids, *outputs):
    times, indentations = physical_grid(**solids, counts=model.counts.tolist())
    inputs = {"times": times, "indentations": indentations, "edge": edge_from_counts(model.counts, len(times))}
    inputs |= {name: solids[name] for name in ("tabor", "modulus_ratio")}
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    return times, indentations, session.run(list(outputs), inputs)


def test_forces_are_those_of_the_model(model, solids):
    _, _, (force,) = run(file_content(**model.parts()), model, solids, "force")
    protocols = [
        LoadingProtocol(**{name: float(solids[name][row]) for name in QUANTITIES if name != "tabor"})
        for row in range(len(force))
    ]
    expected = model.trajectories(protocols, tabor=solids["tabor"], modulus_ratio=solids["modulus_ratio"])
    assert not any(one.extrapolated for one in expected)
    scaled = [model.scaling.scale_force(values) for values in (force, [one.force for one in expected])]
    np.testing.assert_allclose(*scaled, atol=2e-5)


def test_inputs_are_those_of_the_kernels(model, solids):
    graph = onnx.load_model_from_string(file_content(**model.parts()))
    shape = ["steps", "batch", 13]
    graph.graph.output.append(onnx.helper.make_tensor_value_info("network/inputs", onnx.TensorProto.FLOAT, shape))
    times, indentations, (found,) = run(graph.SerializeToString(), model, solids, "network/inputs")
    moments = [*zip(model.scaling.channel_mean, model.scaling.channel_scale, strict=True), model.scaling.tabor]
    expected = scaled_inputs(
        times, indentations, solids["tabor"], solids["modulus_ratio"], model.counts, *np.array(moments).T.copy()
    )
    np.testing.assert_allclose(found, expected, atol=2e-6)


def test_the_file_holds_its_bands_ranges_and_counts(model):
    content = file_content(**model.parts())
    assert is_intact(content)
    assert content == file_content(**model.parts())
    found = {entry.key: entry.value for entry in onnx.load_model_from_string(content).metadata_props}
    assert found["format"] == "viscoelastic-contact-pretrained-onnx"
    assert json.loads(found["counts"]) == model.counts.tolist()
    assert {name: tuple(bounds) for name, bounds in json.loads(found["ranges"]).items()} == model.ranges
    arrays = json.loads(found["bands"])
    del arrays["levels"]
    stored = Bands(**{name: np.array(values) for name, values in arrays.items()})
    quantities = np.exp(np.random.default_rng(1).uniform(-3.0, 3.0, (40, 7)))
    for coverage in (0.5, 0.9, 0.95):
        widths = (kept.widths(quantities, coverage) for kept in (stored, model.bands))
        for one, other in zip(*widths, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-6)


def test_the_package_loads_it_by_name_only(model, tmp_path):
    (tmp_path / "page.onnx").write_bytes(file_content(**model.parts()))
    with pytest.raises(ValueError, match=rf"page\.onnx, which holds the pretrained model {model.name} for other"):
        surrogate.load(tmp_path / "page.onnx")
