import json
from base64 import b64decode

import numpy as np
import pytest

import surrogate
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import PULL_OFF
from experiments import demo_curves, demo_model
from experiments.paper_numbers import paper_rows
from surrogate.data.dataset import Split, TrajectoryDataset
from tests.processes import ROOT

TRACKED, SOLIDS = (
    json.loads((ROOT / path).read_text(encoding="utf-8")) for path in (demo_curves.OUT, demo_curves.SOLIDS_OUT)
)


def test_spread_takes_nearest_free_protocol():
    corners = np.array([1.0, 10.0])
    grid = np.stack(np.meshgrid(*[corners] * 5), axis=-1).reshape(-1, 5)
    protocols = dict(zip(QUANTITIES, grid.T, strict=True))
    chosen = demo_curves.spread(protocols, 32)
    assert sorted(chosen) == list(range(32))
    assert sorted(demo_curves.spread(dict.fromkeys(QUANTITIES, np.ones(4)), 4)) == [0, 1, 2, 3]
    assert list(demo_curves.spread(protocols, 5)) == list(chosen[:5])
    # Of magnitudes from 1 to 10000, half lie below 100.
    values = np.geomspace(1.0, 1e4, 401)
    chosen = values[demo_curves.spread(dict.fromkeys(QUANTITIES, values), 16)]
    assert 4 <= np.sum(chosen < 100.0) <= 12
    protocols = {name: np.array([1.0, 2.0, 3.0]) for name in QUANTITIES}
    with pytest.raises(ValueError, match="count must lie between 1 and the 3 held-out protocols; received 4"):
        demo_curves.spread(protocols, 4)


def test_tracked_curves_are_published_ones():
    """Fails when the data set was published anew: run `make demo-curves`."""
    dataset = TrajectoryDataset.load(ROOT / demo_curves.DATASET)
    assert TRACKED["dataset_sha256"] == dataset.sha256
    assert tuple(TRACKED["counts"]) == dataset.points_per_phase
    test_part = set(Split.load(ROOT / demo_curves.SPLIT).test)
    held_out = [curve for curve in TRACKED["curves"] if curve["kind"] == "test"]
    assert len(held_out) == demo_curves.COUNT
    for curve in held_out:
        row = int(curve["name"].removeprefix("data-set-"))
        assert row in test_part
        assert curve["protocol"] == {name: dataset.protocols[name][row] for name in QUANTITIES}
        np.testing.assert_allclose(curve["force"], dataset.force[row], rtol=1e-6)
    rows = paper_rows("canonical_protocols")
    curves = [curve for curve in TRACKED["curves"] if curve["kind"] == "paper"]
    assert [curve["name"] for curve in curves] == [f"paper-{row['sample']:g}" for row in rows]
    assert [curve["protocol"] for curve in curves] == [{name: row[name] for name in QUANTITIES} for row in rows]


def test_curves_are_simulated_on_their_steps():
    curve = demo_curves.simulated_curve(TRACKED["curves"][11], demo_curves.equal_steps)
    assert curve["results"]["pull_off_force"] == pytest.approx(
        TRACKED["curves"][11]["results"]["pull_off_force"], rel=5e-3
    )
    assert len(curve["force"]) == 120
    assert max(curve["force"][69:]) <= curve["results"]["pull_off_force"]
    tracked = SOLIDS["curves"][-1]
    curve = demo_curves.simulated_curve(tracked, demo_curves.steps_around_pull_off)
    np.testing.assert_allclose(curve["force"], tracked["force"], rtol=5e-3, atol=5e-3 * np.abs(tracked["force"]).max())
    assert len(curve["force"]) == sum(PULL_OFF)
    # One step lies at the pull-off.
    assert max(curve["force"][sum(PULL_OFF[:2]) :]) == pytest.approx(curve["results"]["pull_off_force"], rel=1e-6)


def test_tracked_solids_have_contacts():
    """Fails when one of the two files was written alone: run `make demo-curves`."""
    assert SOLIDS["dataset_sha256"] == TRACKED["dataset_sha256"]
    assert tuple(SOLIDS["counts"]) == PULL_OFF
    count = len(TRACKED["curves"])
    for solid, tracked in zip(SOLIDS["curves"][:count], TRACKED["curves"], strict=True):
        assert (solid["name"], solid["kind"]) == (tracked["name"], tracked["kind"])
        assert solid["protocol"] == {"modulus_ratio": 0.1} | tracked["protocol"]
        assert solid["results"]["pull_off_force"] == pytest.approx(tracked["results"]["pull_off_force"], rel=2e-2)
    solids = SOLIDS["curves"][count:]
    drawn = demo_curves.other_solids(demo_curves.SOLIDS)
    for curve, solid in zip(solids, drawn, strict=True):
        assert (curve["name"], curve["kind"]) == (solid["name"], solid["kind"])
        assert curve["protocol"] == pytest.approx(solid["protocol"], rel=1e-12)
    ratios = [curve["protocol"]["modulus_ratio"] for curve in solids]
    assert min(ratios) < 0.03
    assert max(ratios) > 0.3
    # Fails when the file was not written with the others: run `make demo-curves`.
    path = ROOT / demo_curves.CONTACTS_OUT
    contacts = json.loads(path.read_text(encoding="utf-8"))
    assert contacts["dataset_sha256"] == SOLIDS["dataset_sha256"]
    assert [contact["name"] for contact in contacts["contacts"]] == [curve["name"] for curve in SOLIDS["curves"]]
    assert path.stat().st_size < 400_000
    assert all(np.diff(film["times"]).min() > 0.0 for film in contacts["contacts"])


def test_pressed_contact_lies_on_the_sphere():
    curve = SOLIDS["curves"][3]
    film = demo_curves.contact(curve)
    shape = len(film["times"]), demo_curves.NODES
    heights, levels = (
        np.frombuffer(b64decode(film[name]), dtype).reshape(shape)
        for name, dtype in (("surface", "<u2"), ("traction", "u1"))
    )
    protocol = curve["protocol"]
    start = -(np.pi ** (2 / 3)) * protocol["tabor"]
    loaded = (protocol["peak_indentation"] - start) / protocol["loading_rate"]
    pressed = int(np.argmin(np.abs(np.array(film["times"]) - loaded)))
    surface = film["low"] + (film["high"] - film["low"]) * heights[pressed] / 65535
    radius = np.linspace(0.0, film["reach"], demo_curves.NODES)[:8]
    sphere = 1.0 - protocol["peak_indentation"] + 0.5 * protocol["tabor"] * radius**2
    np.testing.assert_allclose(surface[:8], sphere, atol=1.1)  # the gap of a pressed contact is below that of rest
    assert (sphere >= surface[:8]).all()
    assert levels[pressed, 0] < 128 < levels.max()  # pushed in the middle, pulled elsewhere


def test_tracked_model_is_the_published_one():
    """Fails when `fast` was trained anew: run `make demo-models`."""
    tracked = (ROOT / demo_model.OUT).read_bytes()
    assert tracked == demo_model.packed(surrogate.load(demo_model.NAME))
    with pytest.raises(ValueError, match="model must be one of any linear solid with intervals; received M1-concat"):
        demo_model.packed(surrogate.load("M1-concat"))
