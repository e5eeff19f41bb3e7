"""The exported models with bands against the predictor, run from Python, from C and from JavaScript."""

import json
import shutil
import subprocess
import warnings
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest

import surrogate
from bem import LoadingProtocol
from bem.dataset.designs import QUANTITIES
from bem.dataset.physical_steps import physical_grid
from surrogate import ExtrapolationWarning
from surrogate.data.features import edge_from_counts
from surrogate.files import PUBLISHED_BANDED as PUBLISHED
from surrogate.onnx.file import checked_content, is_intact, session_of
from surrogate.onnx.graph import OnnxGraph
from surrogate.onnx.intervals_graph import add_bands, banded_content
from surrogate.trajectory import INTERVALS, predicted_trajectories
from tests.processes import ROOT
from tests.surrogate.conftest import scenes

RESULTS = ("pull_off_force", "pull_off_time", "hysteresis")
CURVES = ("force", "force_lower", "force_upper", "curve_lower", "curve_upper")
OUTPUTS = (*CURVES, *RESULTS, *INTERVALS)
OUTSIDE = 4


@pytest.fixture(scope="module", params=["fast", "accurate"])
def model(request):
    return surrogate.load(request.param)


@pytest.fixture(scope="module")
def path(model, tmp_path_factory):
    path = tmp_path_factory.mktemp("exported") / "model.onnx"
    path.write_bytes(banded_content(model))
    return path


@pytest.fixture(scope="module")
def solids(model):
    """Protocols over the whole training, its corners, where steps are shortest and rates fastest, and some outside."""
    rng = np.random.default_rng(5)
    low, high = np.log([model.scaling.ranges[name] for name in (*QUANTITIES, "modulus_ratio")]).T
    corners = np.array([[(row >> bit) & 1 for bit in range(6)] for row in range(64)], dtype=float)
    values = np.exp(low + (high - low) * np.concatenate([corners, rng.random((64, 6))]))
    values = np.clip(values, np.exp(low), np.exp(high))
    # Faster, softer and of other Tabor parameters than any of the training.
    values[np.arange(-OUTSIDE, 0), [4, 5, 0, 0]] = [1.3e3, 0.009, 0.185, 3.5]
    return dict(zip((*QUANTITIES, "modulus_ratio"), values.T.copy(), strict=True))


@pytest.fixture(scope="module")
def inputs(model, solids):
    """In the order in which the programs read them."""
    times, indentations = physical_grid(**solids, counts=model.counts)
    histories = {"times": times, "indentations": indentations, "edge": edge_from_counts(model.counts, len(times))}
    return histories | {name: solids[name] for name in ("tabor", "modulus_ratio")}


@pytest.fixture(scope="module")
def expected(model, solids):
    """What the predictor says, by output."""
    protocols = [
        LoadingProtocol(**dict(zip(QUANTITIES[1:], row, strict=True)))
        for row in np.array([solids[name] for name in QUANTITIES[1:]]).T.tolist()
    ]
    with warnings.catch_warnings(action="ignore", category=ExtrapolationWarning):
        found = model.predict(scenes(solids["tabor"], solids["modulus_ratio"]), protocols)
    assert [bool(one.extrapolated) for one in found] == [False] * (len(found) - OUTSIDE) + [True] * OUTSIDE
    return {name: np.array([getattr(one, name) for one in found]) for name in OUTPUTS}


def of_force(model, inputs, solids, force):
    """What the predictor says of a force, by output."""
    turn, histories = sum(model.counts[:2]) - 1, (inputs["times"], inputs["indentations"], force)
    doubts = model.bands.around(*histories, model.scaling, solids, model.counts, 0.9)
    found = predicted_trajectories(*histories, unloading_from=turn, seconds=0.0, doubts=doubts)
    with np.errstate(over="ignore"):  # intervals of sharp peaks have no end
        return {name: np.array([getattr(one, name) for one in found]) for name in OUTPUTS}


def require_same(found, expected, indentations, scaling):
    """Compare what comes from a network in single precision; where the expectation is infinite, exactly.

    The width of a band depends on the sharpness of the peak, a difference of two forces, and an elastic loop is a
    difference of large areas, so that they are known less well.
    """
    areas = np.abs(expected["force"]).max(axis=1) * np.ptp(indentations, axis=1)
    assert found.keys() >= expected.keys()
    for name, values in expected.items():
        assert found[name].shape == values.shape
        finite = np.isfinite(values)
        np.testing.assert_array_equal(found[name][~finite], values[~finite], err_msg=name)
        assert finite.all() == (name in ("force", *RESULTS))
        pair = found[name][finite], values[finite]
        if name in CURVES:
            atol = 2e-5 if name == "force" else 2e-4
            np.testing.assert_allclose(*map(scaling.scale_force, pair), rtol=0.0, atol=atol, err_msg=name)
            continue
        rounding = 2e-5 * areas if name.startswith("hysteresis") else np.zeros(len(areas))
        allowed = np.broadcast_to(rounding.reshape(-1, *[1] * (values.ndim - 1)), values.shape)[finite]
        assert np.all(np.abs(pair[0] - pair[1]) <= 1e-4 * (1.0 + np.abs(pair[1])) + allowed), name


@pytest.fixture(scope="module")
def found(path, inputs):
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    assert {one.name for one in session.get_outputs()} == {*OUTPUTS}
    return dict(zip(OUTPUTS, session.run(list(OUTPUTS), inputs), strict=True))


def test_outputs_are_those_of_the_model(model, found, inputs, expected):
    require_same(found, expected, inputs["indentations"], model.scaling)


def test_graph_agrees_for_any_force(model, inputs, solids):
    """In double precision, without networks, for peaks that are broad, between two steps, and at the last step."""
    counts, scaling, turn = model.counts, model.scaling, sum(model.counts[:2]) - 1
    batch, steps = inputs["times"].shape
    rng = np.random.default_rng(12)
    centre = np.append([turn, steps - 1], rng.integers(turn, steps, batch - 2))[:, np.newaxis]
    width = rng.uniform(0.5, 6.0, (batch, 1))
    peak = np.exp(-(((np.arange(steps) - centre - rng.uniform(-0.4, 0.4, (batch, 1))) / width) ** 2))
    force = 5.0 * peak - np.clip(inputs["indentations"], 0.0, None) ** 1.5 * (np.arange(steps) < turn)
    graph, mean, deviation = OnnxGraph(), *scaling.force
    (graph.named("scaled") * deviation + mean).symexp("force")
    outputs = add_bands(graph, graph.named("scaled"), model.bands, scaling, counts)
    given = inputs | {"scaled": scaling.scale_force(force)}
    del given["edge"]
    shapes = {name: [*values.shape] for name, values in given.items()}
    content = checked_content(graph.finish("bands", shapes, outputs))
    found = dict(zip(outputs, session_of(content).run([*outputs], given), strict=True))
    expected = of_force(model, inputs, solids, force)
    assert found.keys() == {*OUTPUTS} - {"force"}
    for name, values in found.items():
        said = expected[name][:-OUTSIDE]
        np.testing.assert_allclose(values[:-OUTSIDE], said, rtol=1e-8, atol=1e-10, err_msg=name)


def compiled(tmp_path):
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler")
    libraries = sorted(Path(onnxruntime.__file__).parent.glob("capi/libonnxruntime.so*"))
    if not libraries:
        pytest.skip("needs the shared library of ONNX Runtime")
    source, program = Path(__file__).with_name("run_model.c"), tmp_path / "run_model"
    subprocess.run([compiler, "-O1", "-Wall", "-Werror", "-o", program, source, "-ldl"], check=True)
    return [program, libraries[0]]


def scripted(_):
    if shutil.which("node") is None or not (ROOT / "demo" / "node_modules" / "onnxruntime-web").is_dir():
        pytest.skip("needs Node and `make demo-build`")
    return ["node", Path(__file__).with_name("run_model.mjs")]


@pytest.mark.parametrize("program", [compiled, scripted])
def test_other_languages_run_the_file(program, model, path, inputs, solids, expected, tmp_path):
    batch, steps = inputs["times"].shape
    command = [*program(tmp_path), path, str(batch), str(steps), *OUTPUTS]
    given = b"".join(values.tobytes() for values in inputs.values())
    done = subprocess.run(command, input=given, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    shapes = [expected[name].shape for name in OUTPUTS]
    parts = np.split(np.frombuffer(done.stdout), np.cumsum([np.prod(shape) for shape in shapes])[:-1])
    found = {name: part.reshape(shape) for name, part, shape in zip(OUTPUTS, parts, shapes, strict=True)}
    # Near the vertices bands are wide and multiply the rounding of a network: these are those of the force it computed.
    of_it = of_force(model, inputs, solids, found["force"])
    for name in (*CURVES[1:], *INTERVALS):
        of_it[name][-OUTSIDE:] = expected[name][-OUTSIDE:]
        expected = expected | {name: of_it[name]}
    require_same(found, expected, inputs["indentations"], model.scaling)


def test_the_file_says_what_it_is(model, path):
    content = path.read_bytes()
    assert is_intact(content)
    assert content == banded_content(model)
    found = {entry.key: entry.value for entry in onnx.load_model_from_string(content).metadata_props}
    assert found["format"] == "viscoelastic-contact-pretrained-onnx"
    assert (json.loads(found["counts"]), found["coverage"]) == (list(model.counts), "0.9")
    assert {name: tuple(bounds) for name, bounds in json.loads(found["ranges"]).items()} == model.scaling.ranges


def test_export_never_replaces_the_network(program, path, model, tmp_path):
    network = (PUBLISHED / model.name / "model.onnx").read_bytes()
    code, out, err = program("export", model.name)
    assert (code, out) == (2, "")
    assert err.startswith("surrogate: --out must name the file ")
    assert program("export", model.name, "--out", tmp_path / "fast.onnx")[0] == 0
    assert (tmp_path / "fast.onnx").read_bytes() == path.read_bytes()
    assert (PUBLISHED / model.name / "model.onnx").read_bytes() == network


def test_the_package_loads_it_by_name_only(model, path):
    with pytest.raises(ValueError, match=rf"model\.onnx, which holds the pretrained model {model.name} for other"):
        surrogate.load(path)
