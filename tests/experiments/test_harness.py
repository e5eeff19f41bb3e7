"""The harness: numbers for JSON, spreads, errors, progress, the clock, what is run how often, and what is published."""

import json

import numpy as np
import pytest

from experiments import harness
from experiments.harness import Clock, plain
from experiments.measurements.statistics import force_error, spread


def test_plain_numbers_spreads_and_errors():
    values = {"a": np.array([1.0, np.nan]), "b": (np.int64(3), np.inf), "c": np.bool_(True)}
    assert json.dumps(plain(values), allow_nan=False) == '{"a": [1.0, null], "b": [3, null], "c": true}'
    assert spread([1.0, 2.0, 3.0, np.nan])["median"] == 2.0
    assert spread([])["count"] == 0
    quantiles = spread(range(101))
    assert [quantiles[name] for name in ("low", "high", "p95", "largest")] == [25.0, 75.0, 95.0, 100.0]
    exact = np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 5.0]])
    forces = np.array([[0.5, 1.0, np.nan], [np.nan, np.nan, np.nan]])
    np.testing.assert_allclose(force_error(forces, exact), [0.125, np.nan])


def test_progress_ignores_first_compilation(monkeypatch, capsys):
    now = iter([0.0, 40.0, 41.0, *range(42, 141)])
    monkeypatch.setattr(harness, "SAID_EVERY", -1.0)
    monkeypatch.setattr(harness.time, "perf_counter", lambda: float(next(now)))
    assert list(harness.progress(iter(range(100)), "numbers", 100)) == list(range(100))
    first, second, third, *_, last = capsys.readouterr().err.splitlines()
    assert (first, second) == ("numbers: 1 of 100", "numbers: 2 of 100, 0:01:38 left")
    assert (third, last) == ("numbers: 3 of 100, 0:01:37 left", "numbers: 100 of 100, 0:00:00 left")


@pytest.fixture
def clock(monkeypatch):
    """A clock whose two hands the test moves."""
    clock = Clock()
    clock.processor = clock.wall = 0.0
    monkeypatch.setattr(harness, "clock_seconds", lambda: (clock.wall, clock.processor))
    monkeypatch.setattr(harness, "CLOCK", clock)
    return clock


def work(clock, processor, wall):
    clock.processor += processor
    clock.wall += wall


def test_seconds_ignore_competing_programs(clock):
    assert harness.timed(lambda: work(clock, 2.0, 2.0), 2) == [2.0, 2.0]
    assert clock.share == 1.0
    assert harness.timed(lambda: work(clock, 2.0, 8.0), 2) == [2.0, 2.0]
    assert clock.share == 8.0 / 20.0


def test_a_second_core_hides_nothing(clock):
    with clock:
        work(clock, 8.0, 4.0)
    with clock:
        work(clock, 0.5, 1.0)
    assert (clock.seconds, clock.share) == (0.5, 4.5 / 5.0)


def test_busy_measurement_is_not_published(clock, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(harness, "NOT_PUBLISHED", tmp_path / "kept")
    out = tmp_path / "times.json"
    harness.timed(lambda: work(clock, 1.0, 1.05), 3)
    harness.publish(out, "times", {"seconds": np.float64(1.0)}, busy=False)
    quiet = out.read_bytes()
    published = json.loads(quiet)
    assert (published["seconds"], published["command"]) == (1.0, "python -m experiments times")
    assert published["processor_share"] == pytest.approx(1.0 / 1.05)
    harness.timed(lambda: work(clock, 1.0, 2.0), 5)
    with pytest.raises(RuntimeError, match=r"too busy .* at least 90 % of the wall's; received 61 %; they are kept in"):
        harness.publish(out, "times", {"seconds": 2.0}, busy=False)
    assert out.read_bytes() == quiet
    assert capsys.readouterr().err == ""
    assert json.loads((tmp_path / "kept" / "times.json").read_text(encoding="utf-8"))["seconds"] == 2.0
    harness.publish(out, "times", {"seconds": 3.0}, busy=True)
    assert "too busy" in capsys.readouterr().err
    assert json.loads(out.read_text(encoding="utf-8"))["processor_share"] == pytest.approx(8.0 / 13.15)


@pytest.mark.parametrize(("share", "runs"), [(0.6, 1), (0.4, 2)])
def test_expensive_tool_runs_within_budget(share, runs, clock):
    calls, cost = [], share * harness.BUDGET
    answers, seconds = harness.run(lambda case: calls.append(case) or work(clock, cost, cost) or [case], [7], 5, "dear")
    assert (len(seconds), len(calls)) == (runs, runs + 1)
    assert (answers.tolist(), seconds.tolist()) == ([[7]], [[cost]] * runs)


def test_calls_in_turn_give_medians_per_case(clock):
    order = []

    def called(name):
        return lambda turn: order.append((name, turn)) or work(clock, turn, turn)

    assert harness.in_turn({"a": (called("a"), 1), "b": (called("b"), 2)}, 3) == {"a": 1.0, "b": 0.5}
    assert order[:4] == [("a", 0), ("b", 0), ("a", 0), ("b", 0)]  # the first round is not counted


def test_only_measurements_may_hold_nan(clock, tmp_path):
    harness.publish(tmp_path / "measurements" / "one.json", "one", {"a": np.nan}, busy=False)
    published = json.loads((tmp_path / "measurements" / "one.json").read_text(encoding="utf-8"))
    assert published["a"] is None
    assert "processor_share" not in published
    with pytest.raises(ValueError, match="not JSON compliant"):
        harness.publish(tmp_path / "studies" / "one.json", "one", {"a": np.nan}, busy=False)
    path = tmp_path / "folder" / "one.json"
    assert harness.kept(path, lambda: {"a": np.float64(1.0)}) == {"a": 1.0}
    assert harness.kept(path, None) == {"a": 1.0}
