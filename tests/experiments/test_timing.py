"""What the measurements share: numbers for JSON, spreads, errors, progress, the clock."""

import json

import numpy as np
import pytest

from experiments import timing
from experiments.timing import Clock, exponent, force_error, plain, spread


def test_plain_holds_nothing_json_cannot():
    content = {"a": np.array([1.0, np.nan]), "b": (np.int64(3), np.inf), "c": np.bool_(True)}
    assert json.dumps(plain(content), allow_nan=False) == '{"a": [1.0, null], "b": [3, null], "c": true}'


def test_spread_and_exponent():
    assert spread([1.0, 2.0, 3.0, np.nan])["median"] == 2.0
    assert spread([])["count"] == 0
    found = spread(range(101))
    assert [found[name] for name in ("low", "high", "p95", "largest")] == [25.0, 75.0, 95.0, 100.0]
    # A straight line through 0, 1, 0 at -1, 0, 1: slope 0, sum of squares 2/3 with one degree of freedom, over 2.
    assert exponent(np.exp([-1.0, 0.0, 1.0]), np.exp([0.0, 1.0, 0.0])) == pytest.approx((0.0, 3.0**-0.5))
    slope, error = exponent([1.0, 2.0, 4.0], [3.0, 12.0, 48.0])
    assert (slope, error) == (pytest.approx(2.0), pytest.approx(0.0, abs=1e-12))


def test_force_error_counts_what_is_said():
    exact = np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]])
    found = np.array([[0.5, 1.0, np.nan], [np.nan, np.nan, np.nan]])
    np.testing.assert_allclose(force_error(found, exact), [0.125, np.nan])


def test_progress_says_what_is_left(monkeypatch, capsys):
    monkeypatch.setattr(timing, "SAID_EVERY", -1.0)
    assert list(timing.progress(iter("abc"), "letters", 3)) == ["a", "b", "c"]
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(",")[0] for line in lines] == ["letters: 1 of 3", "letters: 2 of 3", "letters: 3 of 3"]
    assert all(line.endswith(" left") for line in lines[1:])


def test_a_compilation_during_the_first_item_is_not_expected_of_the_others(monkeypatch, capsys):
    now = iter([0.0, 40.0, 41.0, *range(42, 141)])
    monkeypatch.setattr(timing, "SAID_EVERY", -1.0)
    monkeypatch.setattr(timing.time, "perf_counter", lambda: float(next(now)))
    assert list(timing.progress(range(100), "numbers")) == list(range(100))
    first, second, third, *_, last = capsys.readouterr().err.splitlines()
    assert (first, second) == ("numbers: 1 of 100", "numbers: 2 of 100, 0:01:38 left")
    assert (third, last) == ("numbers: 3 of 100, 0:01:37 left", "numbers: 100 of 100, 0:00:00 left")


@pytest.fixture
def clock(monkeypatch):
    """A clock whose two hands the test moves."""
    hands = {"processor": 0.0, "wall": 0.0}
    clock = Clock(processor=lambda: hands["processor"], wall=lambda: hands["wall"])
    clock.hands = hands
    monkeypatch.setattr(timing, "CLOCK", clock)
    return clock


def work(clock, processor, wall):
    clock.hands["processor"] += processor
    clock.hands["wall"] += wall


def test_seconds_are_the_processors_and_do_not_grow_when_others_compete(clock):
    assert timing.timed(lambda: work(clock, 2.0, 2.0), 2) == [2.0, 2.0]
    assert clock.share == 1.0
    assert timing.timed(lambda: work(clock, 2.0, 8.0), 2) == [2.0, 2.0]
    assert clock.share == 8.0 / 20.0


def test_a_second_core_hides_nothing(clock):
    with clock:
        work(clock, 8.0, 4.0)
    with clock:
        work(clock, 0.5, 1.0)
    assert (clock.seconds, clock.wall, clock.share) == (0.5, 1.0, 4.5 / 5.0)


def test_what_a_busy_machine_measured_is_kept_and_not_published(clock, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(timing, "NOT_PUBLISHED", tmp_path / "kept")
    out = tmp_path / "times.json"
    timing.timed(lambda: work(clock, 1.0, 1.05), 3)
    timing.publish(out, "times", {"seconds": np.float64(1.0)}, busy=False)
    quiet = out.read_bytes()
    found = json.loads(quiet)
    assert (found["seconds"], found["command"]) == (1.0, "python -m experiments times")
    assert found["processor_share"] == pytest.approx(1.0 / 1.05)
    timing.timed(lambda: work(clock, 1.0, 2.0), 5)
    with pytest.raises(RuntimeError, match=r"too busy .* at least 90 % of the wall's; received 61 %; they are kept in"):
        timing.publish(out, "times", {"seconds": 2.0}, busy=False)
    assert out.read_bytes() == quiet
    assert capsys.readouterr().err == ""
    assert json.loads((tmp_path / "kept" / "times.json").read_text(encoding="utf-8"))["seconds"] == 2.0
    timing.publish(out, "times", {"seconds": 3.0}, busy=True)
    assert "too busy" in capsys.readouterr().err
    assert json.loads(out.read_text(encoding="utf-8"))["processor_share"] == pytest.approx(8.0 / 13.15)
