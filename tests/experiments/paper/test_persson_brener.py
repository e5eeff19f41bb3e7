import types

import numpy as np
import pytest

from bem.reference_solutions import persson_brener as theory
from experiments import common
from experiments.measurements.cases import Case
from experiments.paper import persson_brener
from experiments.paper.inconsistencies import SLIPS
from experiments.paper_numbers import paper_rows


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


def test_lengths_agree_with_the_papers_and_deviations_are_summed_up():
    beta_over_gap = np.sqrt(3.24 * 100.0)
    assert theory.length_scale(3.24) == pytest.approx(4.252, rel=1e-3)
    assert persson_brener.beta_over_length_scale(3.24) == pytest.approx(beta_over_gap / theory.length_scale(3.24))
    found = persson_brener.summary([dict.fromkeys(POINT, 1.0) | {"solver": solver} for solver in (1.0, 1.1, 4.0)])
    assert found["solver_against_theory_median_percent"] == pytest.approx(10.0)
    assert found["solver_against_theory_largest_percent"] == pytest.approx(300.0)


@pytest.mark.parametrize(("trained_up_to", "beyond"), [(3.2, 1.25), (4.0, 0.0)])
def test_extrapolation_beyond_the_trained_tabor_parameters_is_stated(trained_up_to, beyond, monkeypatch):
    trained = types.SimpleNamespace(scaling=types.SimpleNamespace(ranges={"tabor": (0.2, trained_up_to)}))
    monkeypatch.setattr(common, "load_surrogate", lambda *_: trained)
    monkeypatch.setattr(persson_brener, "point", lambda *_: dict.fromkeys(POINT, 1.0))
    found = persson_brener.study({"model": "any", "modulus_ratio": 0.1}, None)["summary"]
    assert found["extrapolation_percent"] == pytest.approx(beyond)


POINT = ("crack_velocity", "solver", "theory", "theory_at_own_velocity", "surrogate")


def test_solver_follows_theory_and_the_table_of_crack_velocities():
    protocols = {row["point"]: row for row in paper_rows("persson_brener_protocols")}
    assert len(protocols) == 14
    trajectory = Case.of(protocols[7]).simulated("standard")
    own = persson_brener.edge_velocity(trajectory, 0.01) * persson_brener.beta_over_length_scale(3.24)
    assert own == pytest.approx(protocols[7]["crack_velocity"], rel=0.05)
    assert trajectory.pull_off_force / 1.5 == pytest.approx(float(theory.effective_energy(own, 0.1)), rel=0.05)


@pytest.mark.parametrize(
    ("name", "what", "value"),
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
    ],
)
def test_slips_come_to(name, what, value):
    assert SLIPS[name]()[what] == pytest.approx(value, rel=1e-3)


def test_the_papers_history_sum_is_of_first_order_ours_of_second():
    found = SLIPS["history-sum"]()
    for reading in ("appendix's sum", "increments at the ends of steps"):
        assert found[f"{reading}, step 0.1"] / found[f"{reading}, step 0.05"] == pytest.approx(2.0, rel=0.1)
    ours = [found[f"linear traction in each step, step {step}"] for step in (0.1, 0.05)]
    assert ours[0] / ours[1] == pytest.approx(4.0, rel=0.1)
