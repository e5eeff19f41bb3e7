"""The latency of a stream, step by step."""

from types import SimpleNamespace

import numpy as np
import pytest

import surrogate
from experiments.surrogates import stream_latency


@pytest.fixture
def instants(monkeypatch):
    """Steps of 0, 1, ... 1000 microseconds, from when they begin to when they end; the steps that were taken."""
    taken = []
    ticks = iter(np.stack([np.zeros(1001), 1e3 * np.arange(1001)], axis=1).ravel().tolist())
    monkeypatch.setattr(stream_latency, "time", SimpleNamespace(perf_counter_ns=lambda: next(ticks)))
    stream = SimpleNamespace(reset=lambda: taken.append("reset"), step=lambda *point: taken.append(point[-1]))
    monkeypatch.setattr(surrogate, "load", lambda *_: SimpleNamespace(stream=lambda _: stream))
    monkeypatch.setattr(stream_latency, "in_fresh_process", lambda *_, **__: [0.5])
    return taken


def test_percentiles_of_a_stream_are_those_of_their_names(instants):
    found = stream_latency.study(model="any", steps=1001)
    assert found["microseconds"] == pytest.approx({"median": 500.0, "p99": 990.0, "p99_9": 999.0, "worst": 1000.0})
    assert found["share_above_50_microseconds"] == 950 / 1001
    assert instants[0] == "reset"
    assert [place for place, edge in enumerate(instants[1:121]) if edge is True] == [49, 69]
    assert instants.count("reset") == 9
    assert {"python", "numba", "onnxruntime"} <= found["versions"].keys()


def test_a_stream_of_a_published_model_is_timed():
    spent = stream_latency.step_microseconds("M1-concat", None, 240)
    assert spent.shape == (240,)
    assert 0.1 < np.median(spent) < 1e4
