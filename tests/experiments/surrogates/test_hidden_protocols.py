import numpy as np
import pytest

from bem import simulate
from experiments.cases import EDGES, Case, hidden_protocols, regions
from experiments.measurements.statistics import quantiles
from experiments.surrogates import gradients, outside_ranges
from tests.experiments.models import shallow


@pytest.fixture(autouse=True)
def draft(monkeypatch):
    """The solver at its quickest, of shallow protocols."""

    monkeypatch.setattr(gradients, "hidden_protocols", shallow)

    def simulated(case, accuracy):
        assert accuracy in (*gradients.SOLVERS.values(), gradients.FINE)
        return case.run("draft")

    monkeypatch.setattr(Case, "simulated", simulated)


def test_hidden_protocols_in_paper_ranges():
    single, several = hidden_protocols(3, 0.1), hidden_protocols(3, (0.01, 1.0))
    assert set(single["modulus_ratio"]) == {0.1}
    assert len(set(several["modulus_ratio"])) == 3
    assert quantiles(np.array([0.0, 0.01, 0.02]))["p50"] == pytest.approx(1.0)


class Oracle:
    """A model that says what the solver says, off by one percent."""

    def predict(self, scenes, protocols):
        return [Answer(*pair) for pair in zip(scenes, protocols, strict=True)]


class Answer:
    def __init__(self, scene, protocol):
        self.pull_off_force = 1.01 * simulate(scene, protocol, "draft").pull_off_force


def test_errors_outside_ranges_are_tabulated():
    tabor = outside_ranges.beyond("high tabor", 0.25, 2, 0)["tabor"]
    np.testing.assert_allclose(tabor, 6.4)
    together = outside_ranges.beyond(outside_ranges.ALL, 0.6, 40, 0)["tabor"]
    np.testing.assert_allclose(sorted(set(together.round(9))), [0.2 * 16**-0.1, 3.2 * 16**0.1])
    study = outside_ranges.study(count=1, seed=2)
    inside, outside = (study["models"]["fast"]["high unloading_rate"][key][0] for key in ("0", "0.1"))
    assert inside < 5.0
    assert np.isfinite(outside)
    assert all(0.0 <= share <= 1.0 for shares in study["covered at the vertices"].values() for share in shares)
    text = outside_ranges.page_text(study | {"command": "some"})
    assert text.count("all ranges at once") == 3
    assert "`tabor` 0.152 to 4.222" in text


def test_gradients_of_model_with_1_percent_error(monkeypatch):
    monkeypatch.setattr(gradients.surrogate, "load", {"fast": Oracle(), "M1-concat": Oracle()}.get)
    study = gradients.study(count=5, model=["fast", "M1-concat"])
    assert all(seconds > 0.0 for row in study["seconds"].values() for seconds in row.values())
    for name in ("solver", "fast", "M1-concat"):
        assert {*study["seconds"][name]} == {"gradient"}
    slopes = study["gradients"]["errors"]
    # A constant factor does not change the gradient of a logarithm; here the solver is one of another accuracy.
    assert slopes["fast"]["p50"] == pytest.approx(slopes["solver"]["p50"], abs=1e-6)
    assert study["solvers"].keys() == {"solver", "draft"} < slopes.keys()


def test_gradient_of_power_law_is_exponents():
    hidden = hidden_protocols(3, (0.01, 1.0))
    exponents = np.array([0.3, -0.2, 0.1, 0.05, 0.4, -0.6])

    def power_law(moved):
        logs = [np.log(moved[name]) for name in gradients.QUANTITIES]
        return np.exp(exponents @ np.array(logs))

    gradient = gradients.gradient(power_law, hidden)
    np.testing.assert_allclose(gradient, np.tile(exponents, (3, 1)), atol=1e-9)
    np.testing.assert_allclose(gradients.gradient(power_law, hidden, 5), gradient[:, :5], atol=1e-9)
    wrong = gradient * [1.1, 1.1, 1.1, 1.1, 1.1, 1.0] + [0.0, 0.0, 0.0, 0.0, 0.0, 0.02]
    errors = gradients.gradient_errors(wrong, gradient)
    assert errors["p50"] == pytest.approx(10.0)
    assert gradients.gradient_errors(wrong[:, :5], gradient) == errors


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
