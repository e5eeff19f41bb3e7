"""The canonical protocols: measured seconds are published, and the study and what shows it only read them."""

import json
import time
from types import SimpleNamespace

import numpy as np
import pytest

from experiments import common
from experiments.measurements import canonical_times
from experiments.measurements import harness as timing
from experiments.paper import canonical_regimes
from experiments.paper_numbers import paper_rows
from experiments.places import Places
from surrogate.data.scaling import Scaling


class Trained:
    """A surrogate that predicts no force."""

    scaling = Scaling(
        features="D", channel_mean=(0.0,) * 4, channel_scale=(1.0,) * 4, tabor=(0.0, 1.0), force=(0.0, 1.0)
    )
    network = SimpleNamespace()

    def predict_history(self, _times, indentations, *_):
        return np.sin(indentations)


WAYS = ("solver", "keras_call", "predictor", "predictor_batch")


@pytest.fixture(autouse=True)
def quick(monkeypatch, tmp_path):
    protocols = paper_rows("canonical_protocols")[:2]
    for module in (canonical_regimes, canonical_times):
        monkeypatch.setattr(module, "paper_rows", lambda _: protocols)
    monkeypatch.setattr(common, "load_surrogate", lambda *_, **__: Trained())
    config = tmp_path / "config.toml"
    config.write_text('model = "M1-concat"\nmodulus_ratio = 0.1\naccuracy = "draft"\n', encoding="utf-8")
    return config


def slow_clocks(patch):
    """Clocks on which every call takes longer than the one before, as on a machine that grows busier."""
    hands = iter(np.cumsum(np.arange(10_000.0) ** 2).tolist())
    for name in ("perf_counter", "process_time", "monotonic"):
        patch.setattr(time, name, lambda: next(hands))


def test_measured_seconds_are_the_processors(quick, tmp_path, monkeypatch):
    ticks = iter(np.arange(10_000.0).tolist())
    monkeypatch.setattr(timing, "CLOCK", timing.Clock(processor=lambda: next(ticks), wall=lambda: 0.0))
    ways = dict.fromkeys(("Keras call", "ONNX"), lambda times, *_: np.zeros(times.shape))
    monkeypatch.setattr(canonical_times.tools, "ways_to_call", lambda *_: (ways, {}))
    config = {"model": "any", "modulus_ratio": 0.1, "accuracy": "draft", "repetitions": 3, "batch": 2}
    found = canonical_times.study(config, tmp_path)
    one = {"solver": 1.0, "keras_call": 1.0, "predictor": 1.0, "predictor_batch": 0.5}
    assert found["seconds"] == {"1": one, "2": one}
    assert found["config"]["batch"] == 2


def test_the_study_is_the_same_whatever_the_clocks_say(quick, tmp_path):
    seconds = dict.fromkeys(WAYS, 0.01)
    times = tmp_path / "times.json"
    content = {"host": "a machine", "config": {"batch": 256}, "seconds": {"1": seconds, "2": seconds}}
    times.write_text(json.dumps(content), encoding="utf-8")
    arguments = Places(taken={"config": quick, "canonical_times": times}).arguments(canonical_regimes.study, "figure-6")
    found = canonical_regimes.study(**arguments)
    with pytest.MonkeyPatch.context() as patch:
        slow_clocks(patch)
        again = canonical_regimes.study(**arguments)
    assert json.dumps(again, default=np.ndarray.tolist) == json.dumps(found, default=np.ndarray.tolist)
    assert found["summary"]["median_keras_call_seconds"] == 0.01
    row = paper_rows("canonical_protocols")[0]
    theirs = {"solver": row["bem_seconds"], "surrogate": row["surrogate_seconds"]}
    assert found["regimes"][0]["paper_seconds"] == theirs


def test_factors_are_summed_up_by_their_median():
    regimes = [{"seconds": {"solver": seconds, "predictor": 0.1}} for seconds in (0.1, 1.0, 100.0)]
    found = canonical_regimes.summary(regimes)
    assert (found["median_solver_seconds"], found["orders_of_magnitude"]) == pytest.approx((1, 1))


def test_without_published_seconds_the_target_that_measures_them_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match="`make measure-canonical-times` makes it"):
        Places(tmp_path, tmp_path).arguments(canonical_regimes.study, "figure-6")


def test_what_is_published_covers_all_protocols():
    found = Places().read("canonical_times", "figure-6")
    assert list(found["seconds"]) == [str(number) for number in range(1, 13)]
    assert all(set(one) == set(WAYS) for one in found["seconds"].values())
