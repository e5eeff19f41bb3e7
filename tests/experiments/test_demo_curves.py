import json
from pathlib import Path

import numpy as np
import pytest

from bem.dataset.designs import QUANTITIES
from experiments import demo_curves
from experiments.paper_numbers import paper_rows
from surrogate.data.dataset import Split, TrajectoryDataset

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tracked():
    return json.loads((ROOT / demo_curves.OUT).read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def dataset():
    return TrajectoryDataset.load(ROOT / demo_curves.DATASET)


def test_spread_takes_the_nearest_free_protocol():
    corners = np.array([1.0, 10.0])
    grid = np.stack(np.meshgrid(*[corners] * 5), axis=-1).reshape(-1, 5)
    protocols = dict(zip(QUANTITIES, grid.T, strict=True))
    chosen = demo_curves.spread(protocols, 32)
    assert sorted(chosen) == list(range(32))
    assert list(demo_curves.spread(protocols, 5)) == list(chosen[:5])


def test_protocols_are_spread_over_magnitudes():
    """Of magnitudes from 1 to 10000, half lie below 100."""
    values = np.geomspace(1.0, 1e4, 401)
    chosen = values[demo_curves.spread(dict.fromkeys(QUANTITIES, values), 16)]
    assert 4 <= np.sum(chosen < 100.0) <= 12


def test_no_more_than_there_are():
    protocols = {name: np.array([1.0, 2.0, 3.0]) for name in QUANTITIES}
    with pytest.raises(ValueError, match="count must lie between 1 and the 3 held-out protocols; received 4"):
        demo_curves.spread(protocols, 4)


def test_tracked_curves_are_of_the_published_data_set(tracked, dataset):
    """Fails when the data set was published anew: run `make demo-curves`."""
    assert tracked["dataset_sha256"] == dataset.sha256
    assert tuple(tracked["counts"]) == dataset.points_per_phase
    test_part = set(
        (Split.load(ROOT / demo_curves.SPLIT) if (ROOT / demo_curves.SPLIT).is_file() else dataset.split()).test
    )
    held_out = [curve for curve in tracked["curves"] if curve["kind"] == "test"]
    assert len(held_out) == demo_curves.COUNT
    for curve in held_out:
        row = int(curve["name"].removeprefix("data-set-"))
        assert row in test_part
        assert curve["protocol"] == {name: dataset.protocols[name][row] for name in QUANTITIES}
        np.testing.assert_allclose(curve["force"], dataset.force[row], rtol=1e-6)


def test_tracked_curves_hold_the_papers_samples(tracked):
    rows = paper_rows("canonical_protocols")
    curves = [curve for curve in tracked["curves"] if curve["kind"] == "paper"]
    assert [curve["name"] for curve in curves] == [f"paper-{row['sample']:g}" for row in rows]
    assert [curve["protocol"] for curve in curves] == [{name: row[name] for name in QUANTITIES} for row in rows]


def test_a_sample_is_simulated_on_the_measurement_steps(tracked):
    row = {"sample": 12.0, **tracked["curves"][11]["protocol"]}
    curve = demo_curves.paper_curve(row)
    assert curve["results"]["pull_off_force"] == pytest.approx(
        tracked["curves"][11]["results"]["pull_off_force"], rel=5e-3
    )
    assert len(curve["force"]) == 120
    assert max(curve["force"][69:]) <= curve["results"]["pull_off_force"]
