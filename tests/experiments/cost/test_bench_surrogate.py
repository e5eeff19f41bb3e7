"""The latency measurements measure what they say."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

import surrogate
from experiments.cost import bench_surrogate
from surrogate.data.scaling import Scaling
from surrogate.inference.keras_backend import KerasBackend
from surrogate.inference.predictor import Surrogate
from tools import manifest


@pytest.fixture
def stand_in(monkeypatch):
    scaling = Scaling(
        features="D",
        channel_mean=(0.6, 2.0, 0.5, 0.0),
        channel_scale=(0.3, 1.4, 3.0, 0.1),
        tabor=(0.7, 0.4),
        force=(-2.0, 2.5),
    )
    model = Surrogate(KerasBackend(surrogate.build("M1-gated"), scaling, name="M1-gated"))
    monkeypatch.setattr(surrogate, "load", lambda *_, **__: model)
    monkeypatch.setattr("surrogate.backend.limit_threads", lambda _: None)


def test_stream(stand_in, tmp_path, capsys):
    bench_surrogate.main(stream=True, steps=500, out=tmp_path / "stream.json", busy=True)
    content = json.loads((tmp_path / "stream.json").read_text())
    spread = content["microseconds"]
    assert content["steps"] == 500
    assert 1.0 < spread["median"] <= spread["p99"] <= spread["p99_9"] <= spread["worst"]
    assert "M1-gated, 500 steps: median " in capsys.readouterr().out


def test_percentiles_of_a_stream_are_those_of_their_names(monkeypatch):
    """Steps of 0, 1, ... 1000 microseconds, from when they begin to when they end."""
    instants = iter(np.stack([np.zeros(1001), 1e3 * np.arange(1001)], axis=1).ravel().tolist())
    monkeypatch.setattr(bench_surrogate, "time", SimpleNamespace(perf_counter_ns=lambda: next(instants)))
    stream = SimpleNamespace(name="any", reset=lambda: None, step=lambda *_: None)
    monkeypatch.setattr(surrogate, "load", lambda *_: SimpleNamespace(stream=lambda **_: stream))
    found = bench_surrogate.measure_stream("any", None, 1001)
    expected = {"median": 500.0, "p99": 990.0, "p99_9": 999.0, "worst": 1000.0}
    assert found["microseconds"] == pytest.approx(expected)
    assert found["share_above_50_microseconds"] == 950 / 1001


def test_predictions(stand_in, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(bench_surrogate, "BATCH", 4)
    monkeypatch.setattr(bench_surrogate, "_start_seconds", lambda *_: 0.5)
    bench_surrogate.main(repeats=3, out=tmp_path / "predictions.json", busy=True)
    content = json.loads((tmp_path / "predictions.json").read_text())
    assert [row["way"] for row in content["rows"]][-1] == "ONNX, batch of 4"
    assert content["rows"][0]["times_faster_than_model_predict"] == 1.0
    assert content["largest_difference_of_scaled_force"] < 1e-5
    assert "times faster than model.predict" in capsys.readouterr().out


def test_what_is_measured_can_be_published(stand_in, tmp_path):
    bench_surrogate.main(stream=True, steps=200, out=tmp_path / "stream.json", busy=True)
    assert manifest.add(tmp_path, [tmp_path / "stream.json"]) == ["stream.json"]
    entry = manifest.read(tmp_path)["stream.json"]
    assert entry["command"] == "python -m experiments bench_surrogate --stream --model M1-concat --steps 200"
    assert {"python", "numba", "onnxruntime", "keras"} <= entry["versions"].keys()
