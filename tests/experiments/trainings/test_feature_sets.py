"""Trainings of feature sets at two kinds of steps, compared across steps by the solver's own results."""

import json

import numpy as np
import pytest
import typer

from bem.dataset.campaign import Campaign
from bem.dataset.measurement_steps import PHYSICAL
from experiments.measurements.cases import Hidden
from experiments.surrogates.measurement_floor import READINGS
from experiments.trainings import feature_sets
from surrogate.data.dataset import TrajectoryDataset
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import run_here
from tests.experiments.shallow import shallow

SETTINGS = {"architecture": "M1-concat", "recipe": "swift", "epochs": 1, "sets": ["A", "D"], "physical": ["D"]}
SETTINGS |= {"hidden": 3, "jobs": 1}


@pytest.fixture(scope="module")
def physical(tmp_path_factory):
    """The protocols of `dataset` at physical steps."""
    path = tmp_path_factory.mktemp("data") / "physical.h5"
    run_here(Campaign(count=60, seed=2, counts=PHYSICAL, steps="physical"), path, solver=stand_in.solve)
    return path


@pytest.fixture
def scored(monkeypatch):
    """Stands in for the comparison on hidden protocols; the models that it was asked for."""
    asked = []

    def compared(folders, count):
        asked.append({label: kind for label, (_, kind) in folders.items()})
        return {label: {"count": count} for label in folders}, {"uniform": {"count": count}}

    monkeypatch.setattr(feature_sets, "hidden_errors", compared)
    return asked


def run(tmp_path, dataset, file, **changes):
    """One call; returns the content of the result file."""
    out = tmp_path / "out.json"
    feature_sets.study(SETTINGS | changes, dataset, tmp_path / "published", out, work=tmp_path, physical=file)
    return json.loads(out.read_text(encoding="utf-8"))


@pytest.mark.parametrize(("waits_for", "sets", "summary"), [("D", "A", None), ("D-physical", "AD", 1.0)])
def test_the_summary_waits_for_the_papers_sets_only(
    waits_for, sets, summary, tmp_path, dataset, physical, queue, scored
):
    queue[0].add(f"features-{waits_for}")
    with pytest.raises(typer.Exit):
        run(tmp_path, dataset, physical)
    content = json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))
    assert (list(content["sets"]), content["complete"]) == (list(sets), False)
    assert content["summary"].get("factor_a_over_d") == summary
    assert (content["physical"], scored) == ({}, [])


def test_sets_at_physical_steps_are_trained_on_their_own_data_set(tmp_path, dataset, physical, queue, scored):
    content = run(tmp_path, dataset, physical)
    assert queue[1] == ["features-A", "features-D", "features-D-physical"]
    assert (content["complete"], list(content["sets"]), list(content["physical"])) == (True, ["A", "D"], ["D"])
    digests = [one["training"] for part in ("sets", "physical") for one in content[part].values()]
    assert len(set(digests)) == 3
    trained = json.loads((tmp_path / "models" / "features-D-physical" / "run.json").read_text(encoding="utf-8"))
    assert trained["dataset_sha256"] == TrajectoryDataset.load(physical).sha256
    assert scored == [{"features-A": "uniform", "features-D": "uniform", "features-D-physical": "physical"}]
    assert content["physical"]["D"]["hidden"] == {"count": 3}
    assert content["floor"] == {"uniform": {"count": 3}}


def test_published_errors_are_kept_where_the_weights_are_not(tmp_path, dataset, physical, queue, scored):
    first = run(tmp_path, dataset, physical)
    (tmp_path / "models").rename(tmp_path / "gone")
    again = run(tmp_path, dataset, physical)
    assert (again["sets"], again["physical"], again["floor"]) == (first["sets"], first["physical"], first["floor"])
    assert (len(queue[1]), len(scored)) == (3, 1)
    # A training whose weights are gone keeps its errors; one that is there is measured on as many protocols as asked.
    (tmp_path / "models").mkdir()
    (tmp_path / "gone" / "features-D").rename(tmp_path / "models" / "features-D")
    (tmp_path / "gone" / "features-A").rename(tmp_path / "models" / "features-A")
    (tmp_path / "models" / "features-A" / "model.weights.h5").unlink()
    more = run(tmp_path, dataset, physical, hidden=4)
    assert scored[1:] == [{"features-D": "uniform"}]
    assert [more["sets"][name]["hidden"]["count"] for name in "AD"] == [3, 4]


def test_the_two_data_sets_must_hold_the_same_protocols(tmp_path, dataset, physical, queue, scored):
    with pytest.raises(FileNotFoundError, match="`make feature-sets` makes it"):
        run(tmp_path, dataset, tmp_path / "absent.h5")
    with pytest.raises(ValueError, match="received 60 trajectories at uniform steps"):
        run(tmp_path, dataset, dataset)
    other = tmp_path / "other.h5"
    run_here(Campaign(count=60, seed=3, counts=PHYSICAL, steps="physical"), other, solver=stand_in.solve)
    with pytest.raises(ValueError, match=r"must hold the protocols of .* received 60 trajectories at physical steps"):
        run(tmp_path, dataset, other)
    assert queue[1] == []
    assert run(tmp_path, dataset, tmp_path / "absent.h5", physical=[])["physical"] == {}


def test_the_papers_ranking_is_of_the_papers_sets():
    errors = {"A": 7.0, "B": 3.0, "C": 0.5, "D": 1.0, "E": 0.4, "F": 0.1}
    found = feature_sets.summary({name: {"validation_mse": error} for name, error in errors.items()})
    wanted = {"order": ["C", "D", "B", "A"], "best": "C", "all_improve_over_a": True, "d_better_than_c": False}
    assert found == wanted | {"factor_a_over_d": 7.0}
    two = feature_sets.summary({"A": {"validation_mse": 7.0}, "D": {"validation_mse": 1.0}})
    assert two == {"order": ["D", "A"], "best": "D", "factor_a_over_d": 7.0}
    assert feature_sets.summary({"F": {"validation_mse": 0.1}})["best"] is None


class Copy:
    """A model that predicts the solver's forces, a share too large."""

    def __init__(self, share):
        self.share = share

    def predict_history(self, times, indentations, scenes):
        assert times.shape == indentations.shape
        trajectories = Hidden.draw(len(scenes), feature_sets.common.MODULUS_RATIO).simulated("draft")
        pairs = zip(trajectories, times, strict=True)
        return (1.0 + self.share) * np.array([one.at(np.minimum(row, one.time[-1])) for one, row in pairs])


def test_models_of_any_steps_are_compared_with_the_solvers_own_results(monkeypatch, tmp_path):
    simulated = Hidden.simulated
    monkeypatch.setattr(Hidden, "draw", shallow)
    monkeypatch.setattr(Hidden, "simulated", lambda self, *_: simulated(self, "draft"))
    shares = {"exact": 0.0, "off": 0.5}
    monkeypatch.setattr(feature_sets.common, "load_surrogate", lambda name, _: Copy(shares[name]))
    folders = {f"{name}-{kind}": (tmp_path / name, kind) for name in shares for kind in feature_sets.STEPS}
    found, floor = feature_sets.hidden_errors(folders, 4)
    for kind in feature_sets.STEPS:
        assert floor[kind]["count"] == 4
        for reading in READINGS:
            exact, off = (found[f"{name}-{kind}"][reading] for name in ("exact", "off"))
            assert floor[kind][reading]["p50"] < 5.0
            assert exact == pytest.approx(floor[kind][reading], abs=1e-6)
            assert off["p50"] == pytest.approx(50.0, abs=2.0 * floor[kind][reading]["p99"])
    assert floor["uniform"]["pull_off"]["p50"] != floor["physical"]["pull_off"]["p50"]
