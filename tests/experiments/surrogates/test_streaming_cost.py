import json
from types import SimpleNamespace

import numpy as np
import pytest

import surrogate
from experiments.surrogates import streaming_cost
from experiments.surrogates.one_step_model import Solid, step_model
from surrogate.data.scaling import Scaling
from surrogate.inference.streaming import Stream
from surrogate.network.graph import SEQUENCE, TABOR, Graph

UNITS, POINTS = 5, 3
SCALING = Scaling("D", (0.6, 2.0, 0.5, 0.0), (0.3, 1.4, 3.0, 0.1), tabor=(0.7, 0.4), force=(-2.0, 2.5))


def tiny(*, dilation=1, appends=True):
    """Convolution, LSTM and readout with random weights, on the four channels of D."""
    random, graph, width = np.random.default_rng(0), Graph(), 4 + appends

    def weights(**shapes):
        return {key: random.normal(size=shape) for key, shape in shapes.items()}

    source = graph.add("append", "append", [SEQUENCE, TABOR]) if appends else SEQUENCE
    kernel = weights(kernel=(UNITS, width, POINTS), bias=(UNITS,))
    source = graph.add("convolve", "convolve", [source], kernel, dilation=dilation)
    shapes = {"W": (1, 4 * UNITS, UNITS), "R": (1, 4 * UNITS, UNITS), "B": (1, 8 * UNITS)}
    source = graph.add("lstm", "lstm", [source], weights(**shapes))
    source = graph.add("relu", "relu", [source])
    graph.add("dense", "force", [source], weights(kernel=(UNITS, 1), bias=(1,)))
    return graph


@pytest.fixture(params=[True, False], ids=["with the Tabor parameter", "without"])
def stand_in(request, monkeypatch):
    graph = tiny(appends=request.param)
    model = SimpleNamespace(
        scaling=SCALING,
        backend=SimpleNamespace(graph=lambda: graph),
        stream=lambda tabor: Stream(graph, SCALING, tabor=tabor),
    )
    monkeypatch.setattr(surrogate, "load", lambda *_: model)
    monkeypatch.setattr("surrogate.backend.limit_threads", lambda _: None)


def agree(ways, scaling):
    """Each way gives the forces of the stream, and again after it began anew."""
    expected = np.array(ways["stream"]())
    assert np.ptp(expected) > 1e-2
    for _ in range(2):
        found = [scaling.unscale_force(np.array(ways[way]())) for way in ("network", "plain")]
        for forces in (np.array(ways["whole"]()), *found):
            np.testing.assert_allclose(forces, expected, rtol=0.0, atol=1e-5 * np.ptp(expected))


def test_sessions_that_keep_their_states_give_the_forces_of_the_stream(stand_in):
    ways, difference = streaming_cost.walks("tiny", None)
    agree(ways, SCALING)
    assert difference < 1e-5


def test_a_session_of_a_pretrained_model_gives_the_forces_of_its_stream():
    ways, difference = streaming_cost.walks("fast", None)
    agree(ways, surrogate.load("fast").scaling)
    assert difference < 1e-5


def test_a_dilated_convolution_is_refused():
    with pytest.raises(ValueError, match="'convolve' of dilation 2"):
        step_model(tiny(dilation=2), SCALING, Solid(1.0), features=False)


def test_sessions_of_other_forces_are_not_timed(stand_in, monkeypatch):
    monkeypatch.setattr(streaming_cost, "AGREEMENT", 0.0)
    with pytest.raises(RuntimeError, match="Received: tiny, which differs by"):
        streaming_cost.compared("tiny", None, 1)


def test_factors_are_those_of_the_medians_and_the_page_says_who_wins(stand_in, monkeypatch, tmp_path):
    out = tmp_path / "streaming_cost.json"
    streaming_cost.main(["tiny"], None, 3, out, busy=True)
    content = json.loads(out.read_text())
    (row,) = content["models"]
    spent = row["microseconds"]
    assert row["factor"] == pytest.approx(spent["whole"] / spent["stream"])
    assert row["network_factor"] == pytest.approx(min(spent["network"], spent["plain"]) / spent["stream"])
    row |= {"factor": 2.5, "network_factor": 1.2}
    text = streaming_cost.page_text(content)
    assert "Against the whole step, the stream reaches it for tiny; it does not for no model." in text
    assert "Against the network alone, the stream reaches it for no model; it does not for tiny." in text
    assert "python -m experiments streaming_cost --model tiny --blocks 3" in text
