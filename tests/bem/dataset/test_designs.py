"""Which protocols a campaign draws and where it samples them: designs, uniform and physical steps, any solid."""

import csv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem.cli.arguments import parse_ranges, parse_ratio
from bem.dataset.designs import DESIGNS, PAPER_RANGES, QUANTITIES, Design
from bem.dataset.file import load_dataset
from bem.dataset.measurement_steps import FMS, PULL_OFF, measurement_grid, proportional_counts
from bem.dataset.sealed_file import DamagedFileError
from bem.dataset.verification import verify
from surrogate.data.dataset import TrajectoryDataset
from tests.bem.dataset.helpers import altered, command
from tests.processes import ROOT


def stacked(protocols):
    return np.stack([protocols[name] for name in QUANTITIES], axis=1)


def places(drawn, ranges=PAPER_RANGES):
    """Where each quantity lies in its range, from 0 to 1."""
    return [np.log(drawn[name] / low) / np.log(high / low) for name, (low, high) in ranges.items()]


def test_paper_grid_holds_paper_protocols():
    design = Design("paper")
    grids = dict(zip(QUANTITIES, design._grids(), strict=True))
    with (ROOT / "experiments" / "paper_values" / "figure_2_protocols.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    for row in rows:
        for name in QUANTITIES:
            # The table rounds to three digits.
            assert np.min(np.abs(grids[name] / float(row[name]) - 1.0)) < 5e-3, (row["panel"], name)
    assert design.largest_count == 18 * 18 * 12**3
    assert len(np.unique(stacked(design.protocols(12_450, seed=0)), axis=0)) == 12_450


@pytest.mark.parametrize("name", DESIGNS)
def test_protocols_depend_on_seed_and_place(name):
    design = Design(name)
    many, few = stacked(design.protocols(100, seed=5)), stacked(design.protocols(33, seed=5))
    np.testing.assert_array_equal(many[:33], few)
    assert not np.array_equal(few, stacked(design.protocols(33, seed=6)))
    changed = {"tabor": (1.0, 2.0), "dwell_time": (0.5, 0.5)}
    protocols = Design(name, changed).protocols(500, seed=1)
    for quantity, (low, high) in (PAPER_RANGES | changed).items():
        values = protocols[quantity]
        assert low <= values.min() <= low * (high / low) ** 0.05
        assert high / (high / low) ** 0.05 <= values.max() <= high


def test_designs_cover_octants_and_corners():
    for column in places(Design("sobol").protocols(256, seed=2)):
        np.testing.assert_array_equal(np.histogram(column, 16, (0.0, 1.0))[0], 16)
    for name, share in (("edges", 0.5903), ("corners", 1.0), ("sobol", 0.4)):
        for column in places(Design(name).protocols(4096, seed=1)):
            assert np.mean((column <= 0.2) | (column >= 0.8)) == pytest.approx(share, abs=2e-3)
            assert np.mean(column < 0.5) == pytest.approx(0.5, abs=1e-3)


def test_vanishing_phase_is_refused():
    design = Design("log-uniform", {"loading_rate": (1e-12, 1e-12), "unloading_rate": (1e12, 1e12)})
    with pytest.raises(ValueError, match=r"strictly increasing"):
        design.protocols(3, seed=0)


@pytest.mark.parametrize("name", ["log-uniform", "sobol"])
def test_modulus_ratios_are_drawn_too(name):
    drawn = Design(name, modulus_ratio=(0.01, 1.0)).protocols(256, seed=3)
    assert list(drawn) == [*QUANTITIES, "modulus_ratio"]
    (column,) = places(drawn, {"modulus_ratio": (0.01, 1.0)})
    assert 0.0 <= column.min() < 0.02
    assert 0.98 < column.max() <= 1.0
    assert abs(np.corrcoef(column, np.log(drawn["tabor"]))[0, 1]) < 0.2
    assert Design(name, modulus_ratio=(0.1, 0.1)) == Design(name, modulus_ratio=0.1)


@pytest.mark.parametrize(
    ("read", "text", "expected"),
    [
        (parse_ratio, "0.1", 0.1),
        (parse_ratio, "0.01:1", (0.01, 1.0)),
        (parse_ratio, "a", "modulus-ratio must read VALUE or LOW:HIGH; received 'a'"),
        (parse_ranges, ["tabor=0.2:3.2"], {"tabor": (0.2, 3.2)}),
        (parse_ranges, ["tabor=1"], {"tabor": (1.0, 1.0)}),
        *((parse_ranges, [f"tabor{end}"], "range must read NAME=LOW:HIGH") for end in ("", "=", "=a:b", "=1:2:3")),
    ],
)
def test_what_is_typed_is_read_or_refused(read, text, expected):
    if isinstance(expected, str):
        with pytest.raises(ValueError, match=expected):
            read(text)
    else:
        assert read(text) == expected


@given(st.integers(6, 5000))
def test_counts_are_the_papers_or_scaled(total):
    assert [proportional_counts(points) for points in (120, 100, 140)] == [FMS, (42, 16, 42), (58, 24, 58)]
    counts = proportional_counts(total)
    assert sum(counts) == total
    assert min(counts) >= 1


def test_phases_are_sampled_uniformly():
    cycle = {"peak_indentation": 15.0, "loading_rate": 1e3, "dwell_time": 8e-3, "unloading_rate": 1e2}
    protocol, times = LoadingProtocol(**cycle), measurement_grid(tabor=3.2, **cycle)[0][0]
    assert (times[0], times[49], times[69], times[119]) == protocol.phase_times(3.2)
    for phase in (times[:50], times[49:70], times[69:]):
        np.testing.assert_allclose(np.diff(phase), np.diff(phase)[0], rtol=1e-9)


@given(
    tabor=st.floats(0.2, 3.2),
    peak=st.floats(2.0, 100.0),
    load=st.floats(-1.0, 3.0),
    dwell=st.floats(1e-3, 3.0),
    unload=st.floats(-1.0, 3.0),
)
def test_grid_agrees_with_the_protocol(tabor, peak, load, dwell, unload):
    cycle = {"peak_indentation": peak, "loading_rate": 10.0**load, "dwell_time": dwell, "unloading_rate": 10.0**unload}
    protocol, second_axis = LoadingProtocol(**cycle), {"tabor": [tabor, tabor], "unloading_rate": [10.0**unload, 1.0]}
    times, indentations = measurement_grid(**cycle | second_axis)
    assert times.shape == indentations.shape == (2, 120)
    assert np.all(np.diff(times, axis=1) > 0.0)
    np.testing.assert_allclose(indentations[0], protocol.history(tabor).indentation_at(times[0]), atol=1e-9 * peak)
    assert indentations[0, 0] == indentations[0, -1] == protocol.start(tabor)
    np.testing.assert_array_equal(indentations[0, 49:70], peak)


def test_no_dwell_has_no_dwell_points():
    shallow = {"tabor": 0.2, "peak_indentation": -0.1, "loading_rate": 1.0, "dwell_time": 0.1, "unloading_rate": 1.0}
    times, _ = measurement_grid(**shallow | {"dwell_time": 0.0}, counts=(50, 0, 50))
    assert times.shape == (1, 100)
    assert np.all(np.diff(times) > 0.0)
    assert measurement_grid(**shallow)[1].max() == -0.1


OPTIONS = ("--design", "sobol", "--count", "4", "--accuracy", "draft", "--range", "peak_indentation=2:5")
ANY = (*OPTIONS, "--modulus-ratio", "0.02:1", "--steps", "pull-off")


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    out = tmp_path_factory.mktemp("campaign") / "any.h5"
    done = command("campaign", *ANY, "--out", out, solver=simulate)
    assert done.exit_code == 0, done.output
    return out


def test_each_has_its_own_solid_and_steps(path):
    dataset = load_dataset(path)
    drawn = Design("sobol", {"peak_indentation": (2.0, 5.0)}, (0.02, 1.0)).protocols(4, seed=0)
    np.testing.assert_array_equal(dataset.modulus_ratios, drawn["modulus_ratio"])
    assert (dataset.steps, dataset.counts) == ("pull-off", PULL_OFF)
    times, _ = dataset.grid()
    row = int(np.argmin(dataset.modulus_ratios))
    quantities = {name: float(values[row]) for name, values in dataset.protocols.items()}
    scene = Scene(quantities.pop("tabor"), StandardLinearSolid(float(drawn["modulus_ratio"][row])))
    again = simulate(scene, LoadingProtocol(**quantities), "draft")
    np.testing.assert_allclose(dataset.force[row], again.at(times[row]), rtol=1e-5, atol=1e-5)


@pytest.mark.usefixtures("in_this_process")
def test_any_solid_data_set_is_like_others(path, tmp_path):
    assert verify(path, sample=4).agrees
    with pytest.raises(DamagedFileError, match=r"without /protocols/modulus_ratio"):
        load_dataset(altered(path, tmp_path, lambda file: file.__delitem__("protocols/modulus_ratio")))


def test_other_steps_and_solids_are_refused_by_trainings(tmp_path):
    out = tmp_path / "other.h5"
    for options in (["--steps", "pull-off"], ["--modulus-ratio", "0.02:1"]):
        assert command("campaign", *OPTIONS, *options, "--out", out, "--replace", solver=simulate).exit_code == 0
        with pytest.raises(ValueError, match="must have uniform steps and one standard linear solid; received"):
            TrajectoryDataset.load(out)
    digests = set()
    for options in ([], ["--modulus-ratio", "0.3"]):
        assert command("campaign", *OPTIONS, *options, "--out", out, "--replace", solver=simulate).exit_code == 0
        digests.add(TrajectoryDataset.load(out).sha256)
    assert len(digests) == 2
    dataset = load_dataset(out)
    assert "steps" not in dataset.attributes["campaign"]
    assert (dataset.steps, "protocols/modulus_ratio" in dataset.columns) == ("uniform", False)
    np.testing.assert_array_equal(dataset.modulus_ratios, 0.3)
