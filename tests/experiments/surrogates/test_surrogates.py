import json

import numpy as np
import pytest

from bem import simulate
from experiments import common
from experiments.surrogates import measurement_floor, pretrained_errors
from experiments.surrogates.hidden_protocols import Hidden, quantiles

DRAW = Hidden.draw


@pytest.fixture(autouse=True)
def draft(monkeypatch):
    """The solver at its quickest, of shallow protocols."""

    def drawn(count, ratio):
        whole = DRAW(40 * count, ratio)
        shallow = np.argsort(whole.quantities["peak_indentation"])[:count]
        return Hidden({name: values[shallow] for name, values in whole.quantities.items()})

    monkeypatch.setattr(measurement_floor.Hidden, "draw", drawn)

    def simulated(row, *, accuracy, modulus_ratio=0.1):
        assert accuracy == "standard"
        return simulate(*common.problem(row, modulus_ratio), "draft")

    monkeypatch.setattr(common, "simulated", simulated)


def test_hidden_protocols_are_in_the_papers_ranges_and_of_the_asked_solids():
    one, several = Hidden.draw(3, 0.1), Hidden.draw(3, (0.01, 1.0))
    assert set(one.quantities["modulus_ratio"]) == {0.1}
    assert len(set(several.quantities["modulus_ratio"])) == 3
    assert one.row(2)[1] == 0.1
    assert quantiles(np.array([0.0, 0.01, 0.02]))["p50"] == pytest.approx(1.0)


def test_the_floor_of_both_kinds_of_steps(tmp_path):
    out = tmp_path / "floor.json"
    measurement_floor.main(6, out)
    content = json.loads(out.read_text())
    floors = [content["kinds"][kind]["pull_off"]["p90"] for kind in ("uniform", "physical")]
    assert all(floor >= 0.0 for floor in floors)
    assert len(content["kinds"]["physical"]["pull_off_errors"]) == 6
    steps = content["example"]["steps"]
    peak = max(content["example"]["force"])
    assert max(steps["uniform"]["force"]) < 0.8 * peak < 0.95 * peak < max(steps["physical"]["force"])


class Oracle:
    """A model that says what the solver says, off by one percent."""

    def trajectories(self, protocols, *, tabor, modulus_ratio=None, coverage=0.9):
        assert coverage == pretrained_errors.COVERAGE
        ratios = np.broadcast_to(0.1 if modulus_ratio is None else modulus_ratio, len(protocols))
        return [Answer(*row) for row in zip(protocols, tabor, ratios, strict=True)]


class Answer:
    def __init__(self, protocol, tabor, ratio):
        row = {"tabor": tabor} | {name: getattr(protocol, name) for name in common.QUANTITIES if name != "tabor"}
        true = simulate(*common.problem(row, ratio), "draft")
        self.pull_off_force, self.hysteresis = 1.01 * true.pull_off_force, true.hysteresis
        self.pull_off_interval = (0.995 * true.pull_off_force, 1.5 * true.pull_off_force)


def test_errors_coverage_and_cost_of_a_model_that_errs_by_one_percent(tmp_path, monkeypatch):
    monkeypatch.setattr(pretrained_errors.surrogate, "load", {"fast": Oracle(), "M1-concat": Oracle()}.get)
    out = tmp_path / "errors.json"
    pretrained_errors.main(5, ["fast", "M1-concat"], out)
    content = json.loads(out.read_text())
    for kind in ("paper", "any"):
        found = content["models"]["fast"][kind]
        assert found["pull_off"]["p50"] == pytest.approx(1.0)
        assert found["hysteresis"]["p90"] == pytest.approx(0.0, abs=1e-9)
        assert found["covered"] == 1.0
    assert list(content["models"]["M1-concat"]) == ["paper"]
    assert all(seconds > 0.0 for row in content["seconds"].values() for seconds in row.values())
