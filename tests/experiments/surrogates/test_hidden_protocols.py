import numpy as np
import pytest

from bem import simulate
from bem.dataset.designs import PAPER_RANGES
from experiments.cases import EDGES, Case, Hidden, regions
from experiments.measurements.statistics import quantiles
from experiments.surrogates import errors_by_place, measurement_steps, outside_ranges, ways_to_call
from tests.experiments.models import DRAW, shallow

CORNERS = Hidden.corners


@pytest.fixture(autouse=True)
def draft(monkeypatch):
    """The solver at its quickest, of shallow protocols; of the corners, one."""

    monkeypatch.setattr(Hidden, "draw", shallow)
    monkeypatch.setattr(Hidden, "corners", lambda ratio: CORNERS(ratio).part(slice(0, 1)))

    def simulated(case, accuracy):
        assert accuracy in (*ways_to_call.SOLVERS.values(), ways_to_call.FINE)
        return case.run("draft")

    monkeypatch.setattr(Case, "simulated", simulated)


def test_hidden_protocols_in_paper_ranges():
    single, several = Hidden.draw(3, 0.1), Hidden.draw(3, (0.01, 1.0))
    assert set(single.quantities["modulus_ratio"]) == {0.1}
    assert len(set(several.quantities["modulus_ratio"])) == 3
    assert quantiles(np.array([0.0, 0.01, 0.02]))["p50"] == pytest.approx(1.0)
    corners = CORNERS(0.1).quantities
    assert len({*zip(*corners.values(), strict=True)}) == 32
    assert {
        name: (values.min(), values.max()) for name, values in corners.items() if name in PAPER_RANGES
    } == PAPER_RANGES


def test_the_floor_of_both_kinds_of_steps():
    floor_study = measurement_steps.study_measurement_floor(count=6)
    floors = [floor_study["kinds"][steps_name]["pull_off"]["p90"] for steps_name in ("uniform", "physical")]
    assert all(floor >= 0.0 for floor in floors)
    assert len(floor_study["kinds"]["physical"]["pull_off_errors"]) == 6
    steps = floor_study["example"]["steps"]
    peak = max(floor_study["example"]["force"])
    assert max(steps["uniform"]["force"]) < 0.8 * peak < 0.95 * peak < max(steps["physical"]["force"])


class Oracle:
    """A model that says what the solver says, off by one percent."""

    def predict(self, scenes, protocols, coverage=0.9):
        assert coverage == ways_to_call.COVERAGE == errors_by_place.COVERAGE
        return [Answer(*pair) for pair in zip(scenes, protocols, strict=True)]


class Answer:
    def __init__(self, scene, protocol):
        true = simulate(scene, protocol, "draft")
        self.pull_off_force, self.hysteresis, self.time = 1.01 * true.pull_off_force, true.hysteresis, true.time
        self.pull_off_interval = (0.995 * true.pull_off_force, 1.5 * true.pull_off_force)
        self.pull_off_time_interval = (true.pull_off_time + 1.0, true.pull_off_time + 2.0)
        self.hysteresis_interval = (0.5 * true.hysteresis, 1.5 * true.hysteresis)
        self.curve_lower, self.curve_upper = -np.inf, np.inf
        self.force_lower, self.force_upper = (
            true.force - 0.1,
            true.force + np.where(true.time < true.time[-1], 0.1, -0.1),
        )


def test_coverage_of_model_1_percent_off(monkeypatch, capsys):
    monkeypatch.setattr(errors_by_place.surrogate, "load", lambda _: Oracle())
    models = errors_by_place.study(count=4, corner=1, seed=3)["models"]
    printed = [[cell.strip() for cell in line.split("\u2502")[1:4]] for line in capsys.readouterr().out.splitlines()]
    assert ["worst of 64 corners", "1", "1 1 1"] in printed
    assert list(models["M1-concat"]) == ["paper", "vertices"]
    for region in ("paper", "box"):
        errors = models["fast"][region]
        np.testing.assert_allclose(errors["pull_off"], 1.0, rtol=1e-9)
        np.testing.assert_allclose(errors["hysteresis"], 0.0, atol=1e-9)
        assert [errors[f"inside/{name}"] for name in errors_by_place.RESULTS] == [1.0, 0.0, 1.0]
        assert 0.9 < errors["inside/force"] < errors["inside/curve"] == 1.0
        np.testing.assert_allclose(errors["width/pull_off"], 50.5, rtol=1e-9)
    assert models["M1-concat"]["paper"] == {"count": 4, **{key: errors[key] for key in ("pull_off", "hysteresis")}}
    assert sum(corner["count"] for corner in models["fast"]["corners"]) == 64
    assert models["fast"]["vertices"]["count"] == 1


def test_errors_outside_ranges_are_tabulated():
    tabor = outside_ranges.beyond("high tabor", 0.25, 2, 0).quantities["tabor"]
    np.testing.assert_allclose(tabor, 6.4)
    together = outside_ranges.beyond(outside_ranges.ALL, 0.6, 40, 0).quantities["tabor"]
    np.testing.assert_allclose(sorted(set(together.round(9))), [0.2 * 16**-0.1, 3.2 * 16**0.1])
    study = outside_ranges.study(count=1, seed=2)
    inside, outside = (study["models"]["fast"]["high unloading_rate"][key][0] for key in ("0", "0.1"))
    assert inside < 5.0
    assert np.isfinite(outside)
    text = outside_ranges.page_text(study | {"command": "some"})
    assert text.count("all ranges at once") == 3
    assert "`tabor` 0.152 to 4.222" in text


def test_cost_of_model_with_1_percent_error(monkeypatch):
    monkeypatch.setattr(ways_to_call.surrogate, "load", {"fast": Oracle(), "M1-concat": Oracle()}.get)
    study = ways_to_call.study(count=5, model=["fast", "M1-concat"])
    assert all(seconds > 0.0 for row in study["seconds"].values() for seconds in row.values())
    for name in ("solver", "fast", "M1-concat"):
        assert {*study["seconds"][name]} == {"batch", "single", "gradient"}
    slopes = study["gradients"]["errors"]
    # A constant factor does not change the gradient of a logarithm; here the solver is one of another accuracy.
    assert slopes["fast"]["p50"] == pytest.approx(slopes["solver"]["p50"], abs=1e-6)
    assert study["solvers"].keys() == {"solver", "draft"} < slopes.keys()


def test_gradient_of_power_law_is_exponents():
    hidden = DRAW(3, (0.01, 1.0))
    exponents = np.array([0.3, -0.2, 0.1, 0.05, 0.4, -0.6])

    def power_law(moved):
        logs = [np.log(moved.quantities[name]) for name in ways_to_call.QUANTITIES]
        return np.exp(exponents @ np.array(logs))

    gradient = ways_to_call.gradient(power_law, hidden)
    np.testing.assert_allclose(gradient, np.tile(exponents, (3, 1)), atol=1e-9)
    np.testing.assert_allclose(ways_to_call.gradient(power_law, hidden, 5), gradient[:, :5], atol=1e-9)
    wrong = gradient * [1.1, 1.1, 1.1, 1.1, 1.1, 1.0] + [0.0, 0.0, 0.0, 0.0, 0.0, 0.02]
    errors = ways_to_call.gradient_errors(wrong, gradient)
    assert errors["p50"] == pytest.approx(10.0)
    assert ways_to_call.gradient_errors(wrong[:, :5], gradient) == errors


def test_regions_divide_protocols_once():
    drawn = {name: np.geomspace(edges[0], edges[-1], 50) for name, (_, edges) in EDGES.items()}
    masks = regions(drawn)
    assert masks["all"].all()
    for title, edges in EDGES.values():
        parts = [rows for region, rows in masks.items() if region.startswith(title)]
        assert len(parts) == len(edges) - 1
        np.testing.assert_array_equal(np.sum(parts, axis=0), 1)
    masks = regions({"tabor": np.array([0.19, 1.0, 3.25]), "modulus_ratio": np.full(3, 0.1)})
    assert {name: rows.tolist() for name, rows in masks.items() if name != "all"} == {
        "Tabor parameter 0.2 to 1": [True, False, False],
        "Tabor parameter 1 to 2": [False, True, False],
        "Tabor parameter 2 to 3.2": [False, False, True],
    }
