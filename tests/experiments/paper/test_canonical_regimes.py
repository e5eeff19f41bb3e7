"""The canonical protocols: measured seconds are published, and the study only reads them."""

import json
import time

import numpy as np
import pytest

from experiments.measurements import canonical_times
from experiments.measurements import harness as timing
from experiments.paper import canonical_regimes
from experiments.paper_numbers import paper_rows
from experiments.places import Places

WAYS = ("solver", "keras_call", "predictor", "predictor_batch")


def test_measured_seconds_are_the_processors(tmp_path, monkeypatch):
    ticks = iter(np.arange(10_000.0).tolist())
    monkeypatch.setattr(timing, "hands", lambda: (0.0, next(ticks)))
    ways = dict.fromkeys(("Keras call", "ONNX"), lambda cases: np.zeros((len(cases), 122)))
    monkeypatch.setattr(canonical_times.tools, "ways_to_call", lambda *_: (ways, {}))
    monkeypatch.setattr(canonical_times, "paper_rows", lambda name: paper_rows(name)[:2])
    config = {"model": "any", "modulus_ratio": 0.1, "accuracy": "draft", "repetitions": 3, "batch": 2}
    found = canonical_times.study(config, tmp_path)
    one = {"solver": 1.0, "keras_call": 1.0, "predictor": 1.0, "predictor_batch": 0.5}
    assert found["seconds"] == {"1": one, "2": one}
    assert found["config"]["batch"] == 2


def test_the_study_is_the_same_whatever_the_clocks_say(monkeypatch):
    """Clocks on which every call takes longer than the one before, as on a machine that grows busier."""
    monkeypatch.setattr(canonical_regimes, "paper_rows", lambda name: paper_rows(name)[:2])
    arguments = Places().arguments(canonical_regimes.study, "figure-6")
    arguments["config"] |= {"accuracy": "draft"}
    arguments["canonical_times"]["seconds"] = dict.fromkeys("12", dict.fromkeys(WAYS, 0.01))
    found = canonical_regimes.study(**arguments)
    hands = iter(np.cumsum(np.arange(10_000.0) ** 2).tolist())
    for name in ("perf_counter", "process_time", "monotonic"):
        monkeypatch.setattr(time, name, lambda: next(hands))
    again = canonical_regimes.study(**arguments)
    assert json.dumps(again, default=np.ndarray.tolist) == json.dumps(found, default=np.ndarray.tolist)
    assert found["summary"]["median_keras_call_seconds"] == 0.01
    row = paper_rows("canonical_protocols")[0]
    theirs = {"solver": row["bem_seconds"], "surrogate": row["surrogate_seconds"]}
    assert found["regimes"][0]["paper_seconds"] == theirs


def test_published_seconds_cover_all_protocols_and_are_summed_up_by_medians(tmp_path):
    regimes = [{"seconds": {"solver": seconds, "predictor": 0.1}} for seconds in (0.1, 1.0, 100.0)]
    found = canonical_regimes.summary(regimes)
    assert (found["median_solver_seconds"], found["orders_of_magnitude"]) == pytest.approx((1, 1))
    with pytest.raises(FileNotFoundError, match="`make measure-canonical-times` makes it"):
        Places(tmp_path, tmp_path).arguments(canonical_regimes.study, "figure-6")
    found = Places().read("canonical_times", "figure-6")
    assert list(found["seconds"]) == [str(number) for number in range(1, 13)]
    assert all(set(one) == set(WAYS) for one in found["seconds"].values())
