"""Studies of the paper that simulate: canonical protocols, cracks and contradictions; settings read off the code."""

import json
import time
import types
from pathlib import Path

import numpy as np
import pytest

from bem.methods.closed_forms import persson_brener as theory
from experiments import common
from experiments import harness as timing
from experiments.cases import Case
from experiments.common import CONFIGS, MODELS, read_config, read_result
from experiments.measurements import canonical_times
from experiments.paper import adopted_settings, canonical_regimes, persson_brener
from experiments.paper.inconsistencies import SLIPS
from experiments.paper_numbers import paper_rows


def test_the_settings_are_the_papers_own(monkeypatch):
    recipe = adopted_settings.recipe()
    assert (recipe["batch_size"], recipe["learning_rate"], recipe["stop_after"]) == (8, 1e-4, 30)
    assert "plateau" not in recipe
    protocol = adopted_settings.crack_protocol()
    assert protocol["tabor"] == 3.24
    assert protocol["alpha"] == pytest.approx(0.349066, rel=1e-5)
    assert protocol["radius_over_gap"] == 100.0
    monkeypatch.setattr(adopted_settings, "layers", dict)
    forms = adopted_settings.study(read_config(CONFIGS / "feature_sets.toml"))["closed_forms"]
    assert forms == pytest.approx({"jkr_pull_off": 1.5, "dmt_pull_off": 2.0})
    rows = [dict.fromkeys(adopted_settings.QUANTITIES, value) for value in (1.0, 2.0)]
    monkeypatch.setattr(adopted_settings, "paper_rows", lambda _: rows)
    with pytest.raises(ValueError, match="differ in the unloading rate alone"):
        adopted_settings.crack_protocol()


TIMES = Path("published/measurements/canonical_times.json")
WAYS = ("solver", "keras_call", "predictor", "predictor_batch")


def test_measured_seconds_are_the_processors(tmp_path, monkeypatch):
    ticks = iter(np.arange(10_000.0).tolist())
    monkeypatch.setattr(timing, "clock_seconds", lambda: (0.0, next(ticks)))
    ways = dict.fromkeys(("Keras call", "ONNX"), lambda cases: np.zeros((len(cases), 122)))
    monkeypatch.setattr(canonical_times.tools, "ways_to_call", lambda *_: (ways, {}))
    monkeypatch.setattr(canonical_times, "paper_rows", lambda name: paper_rows(name)[:2])
    config = {"model": "any", "modulus_ratio": 0.1, "accuracy": "draft", "repetitions": 3, "batch": 2}
    times = canonical_times.study(config, tmp_path)
    seconds = {"solver": 1.0, "keras_call": 1.0, "predictor": 1.0, "predictor_batch": 0.5}
    assert times["seconds"] == {"1": seconds, "2": seconds}
    assert times["config"]["batch"] == 2


def test_regimes_do_not_depend_on_clocks(monkeypatch):
    """Clocks on which every call takes longer than the one before, as on a machine that grows busier."""
    monkeypatch.setattr(canonical_regimes, "paper_rows", lambda name: paper_rows(name)[4:6])
    config = read_config(CONFIGS / "canonical_regimes.toml") | {"accuracy": "draft"}
    times = read_result(TIMES) | {"seconds": dict.fromkeys("56", dict.fromkeys(WAYS, 0.01))}
    study = canonical_regimes.study(config, MODELS, times)
    hands = iter(np.cumsum(np.arange(10_000.0) ** 2).tolist())
    for name in ("perf_counter", "process_time", "monotonic"):
        monkeypatch.setattr(time, name, lambda: next(hands))
    again = canonical_regimes.study(config, MODELS, times)
    assert json.dumps(again, default=np.ndarray.tolist) == json.dumps(study, default=np.ndarray.tolist)
    assert study["summary"]["median_keras_call_seconds"] == 0.01
    row = paper_rows("canonical_protocols")[4]
    theirs = {"solver": row["bem_seconds"], "surrogate": row["surrogate_seconds"]}
    assert study["regimes"][0]["paper_seconds"] == theirs


def test_published_seconds_and_their_medians(tmp_path):
    regimes = [
        {
            "seconds": {"solver": seconds, "keras_call": 10.0, "predictor": 0.1},
            "predicted": {"paper": {"errors_percent": {"pull_off_force": 6.0 * seconds}}},
        }
        for seconds in (0.1, 1.0, 100.0)
    ]
    summary = canonical_regimes.summary(regimes)
    assert (summary["median_solver_seconds"], summary["orders_of_magnitude_by_predictor"]) == pytest.approx((1, 1))
    assert (summary["orders_of_magnitude"], summary["solver_faster_than_call"]) == pytest.approx((-1, 10))
    assert summary["agreement"] == {"paper": {"close": 1, "largest_percent": 600.0}}
    with pytest.raises(FileNotFoundError, match="`make measure-canonical-times` makes it"):
        read_result(tmp_path / "measurements" / "canonical_times.json")
    times = read_result(TIMES)
    assert list(times["seconds"]) == [str(number) for number in range(1, 13)]
    assert all(set(ways) == set(WAYS) for ways in times["seconds"].values())


def test_edge_velocity_of_a_known_history():
    time = np.linspace(0.0, 2.0, 41)
    history = types.SimpleNamespace(
        time=time,
        force=10.0 - (time - 1.0) ** 2,
        contact_radius=3.0 - 0.7 * (time - 1.0) - 0.2 * (time - 1.0) ** 2,
        unloading=np.ones(41, dtype=bool),
        pull_off_time=time[20],
        pull_off_force=10.0,
    )
    assert persson_brener.edge_velocity(history, 0.01) == pytest.approx(0.7)


def test_length_scale_and_deviations():
    beta_over_gap = np.sqrt(3.24 * 100.0)
    assert theory.length_scale(3.24) == pytest.approx(4.252, rel=1e-3)
    assert theory.beta_over_length_scale(3.24) == pytest.approx(beta_over_gap / theory.length_scale(3.24))
    summary = persson_brener.summary([dict.fromkeys(POINT, 1.0) | {"solver": solver} for solver in (1.0, 1.1, 4.0)])
    assert summary["solver_against_theory_median_percent"] == pytest.approx(10.0)
    assert summary["solver_against_theory_largest_percent"] == pytest.approx(300.0)
    rows = [dict.fromkeys(POINT, 1.0) | {"paper": 1.5 if index == 2 else 1.0} for index in range(14)]
    summary = persson_brener.summary(rows)
    assert summary["paper_against_theory_largest_percent"] == pytest.approx(50.0)
    assert not summary["paper_against_theory_largest_when_fast"]


@pytest.mark.parametrize(("trained_up_to", "beyond"), [(3.2, 1.25), (4.0, 0.0)])
def test_extrapolation_in_tabor_is_stated(trained_up_to, beyond, monkeypatch):
    trained = types.SimpleNamespace(scaling=types.SimpleNamespace(ranges={"tabor": (0.2, trained_up_to)}))
    monkeypatch.setattr(common, "load_surrogate", lambda *_: trained)
    monkeypatch.setattr(persson_brener, "point", lambda *_: dict.fromkeys(POINT, 1.0))
    monkeypatch.setattr(persson_brener, "by_recipe", lambda *_: {"paper": "any"})
    summary = persson_brener.study({"model": "any", "modulus_ratio": 0.1}, None)["summary"]
    assert summary["extrapolation_percent"] == pytest.approx(beyond)


POINT = ("crack_velocity", "solver", "theory", "theory_at_own_velocity", "paper")


def test_solver_follows_crack_theory():
    protocols = {row["point"]: row for row in paper_rows("persson_brener_protocols")}
    assert len(protocols) == 14
    trajectory = Case.of(protocols[7]).simulated("standard")
    own = persson_brener.edge_velocity(trajectory, 0.01) * theory.beta_over_length_scale(3.24)
    assert own == pytest.approx(protocols[7]["crack_velocity"], rel=0.05)
    assert trajectory.pull_off_force / 1.5 == pytest.approx(float(theory.effective_energy(own, 0.1)), rel=0.05)


@pytest.mark.parametrize(
    ("name", "quantity", "value"),
    [
        ("start-force", "force at the start, mu = 0.2", 1.5063),
        ("influence-scaling", "exact", 12.0),
        ("concatenation-point", "after the last block", 228_993),
        ("concatenation-point", "before the first block", 229_185),
        ("inference-time", "median of the table (s)", 0.16),
        ("halving", "half of 3.125 (%)", 1.5625),
        ("quartile-mean", "mean of the quartile means", 5.128e-4),
        ("concatenation-superiority", "of these with concatenation best", 2),
        ("percent-mse", "highlights, as a bare number", 5e-4),
        ("longest-pull-off-time", "duration of the slowest loading", 1068.6),
        ("mean-time", "mean (s)", 138.2),
        ("modulus", "1 / (1 - nu^2) of an incompressible solid", 4 / 3),
        ("two-betas", "as a number", 0.97428),
        ("influence-diagonal", "G r at distance 0.01 from a node", 4.2738),
        ("four-groups", "remainder of 1,245 by four", 1),
    ],
)
def test_slips_come_to(name, quantity, value):
    assert SLIPS[name]()[quantity] == pytest.approx(value, rel=1e-3)


def test_order_of_history_sums():
    errors = SLIPS["history-sum"]()
    for reading in ("appendix's sum", "increments at the ends of steps"):
        assert errors[f"{reading}, step 0.1"] / errors[f"{reading}, step 0.05"] == pytest.approx(2.0, rel=0.1)
    ours = [errors[f"linear traction in each step, step {step}"] for step in (0.1, 0.05)]
    assert ours[0] / ours[1] == pytest.approx(4.0, rel=0.1)
