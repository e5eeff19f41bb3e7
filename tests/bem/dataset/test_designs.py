import csv

import numpy as np
import pytest

from bem.cli.arguments import parse_ranges, parse_ratio
from bem.dataset.designs import DESIGNS, PAPER_RANGES, QUANTITIES, Design
from tests.processes import ROOT

PAPER_VALUES = ROOT / "experiments" / "paper_values"


def stacked(protocols):
    return np.stack([protocols[name] for name in QUANTITIES], axis=1)


def test_paper_grid_holds_the_papers_own_protocols():
    grids = dict(zip(QUANTITIES, Design("paper")._grids(), strict=True))
    with (PAPER_VALUES / "figure_2_protocols.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    for row in rows:
        for name in QUANTITIES:
            # The table rounds to three digits.
            assert np.min(np.abs(grids[name] / float(row[name]) - 1.0)) < 5e-3, (row["panel"], name)


def test_paper_grid_is_drawn_without_duplicates():
    design = Design("paper")
    assert design.largest_count == 18 * 18 * 12**3
    rows = stacked(design.protocols(12_450, seed=0))
    assert len(np.unique(rows, axis=0)) == 12_450


@pytest.mark.parametrize("name", DESIGNS)
def test_protocol_depends_on_seed_and_place_only(name):
    design = Design(name)
    many, few = stacked(design.protocols(100, seed=5)), stacked(design.protocols(33, seed=5))
    np.testing.assert_array_equal(many[:33], few)
    assert not np.array_equal(few, stacked(design.protocols(33, seed=6)))


@pytest.mark.parametrize("name", DESIGNS)
def test_ranges_are_filled_and_kept(name):
    ranges = {**PAPER_RANGES, "tabor": (1.0, 2.0), "dwell_time": (0.5, 0.5)}
    protocols = Design(name, {"tabor": (1.0, 2.0), "dwell_time": (0.5, 0.5)}).protocols(500, seed=1)
    for quantity, (low, high) in ranges.items():
        values = protocols[quantity]
        assert low <= values.min() <= low * (high / low) ** 0.05
        assert high / (high / low) ** 0.05 <= values.max() <= high


def test_sobol_covers_each_octant_evenly():
    protocols = Design("sobol").protocols(256, seed=2)
    for quantity, (low, high) in PAPER_RANGES.items():
        place = np.log(protocols[quantity] / low) / np.log(high / low)
        np.testing.assert_array_equal(np.histogram(place, 16, (0.0, 1.0))[0], 16)


def test_a_phase_that_vanishes_in_double_precision_is_refused():
    design = Design("log-uniform", {"loading_rate": (1e-12, 1e-12), "unloading_rate": (1e12, 1e12)})
    with pytest.raises(ValueError, match=r"strictly increasing"):
        design.protocols(3, seed=0)


@pytest.mark.parametrize("name", ["log-uniform", "sobol"])
def test_modulus_ratios_are_drawn_with_the_protocols(name):
    drawn = Design(name, modulus_ratio=(0.01, 1.0)).protocols(256, seed=3)
    ratios = drawn.pop("modulus_ratio")
    assert list(drawn) == list(QUANTITIES)
    places = np.log(ratios / 0.01) / np.log(100.0)
    assert 0.0 <= places.min() < 0.02
    assert 0.98 < places.max() <= 1.0
    assert abs(np.corrcoef(places, np.log(drawn["tabor"]))[0, 1]) < 0.2
    assert Design(name, modulus_ratio=(0.1, 0.1)) == Design(name, modulus_ratio=0.1)


@pytest.mark.parametrize(
    ("read", "text", "found"),
    [
        (parse_ratio, "0.1", 0.1),
        (parse_ratio, "0.01:1", (0.01, 1.0)),
        (parse_ratio, "a", "modulus-ratio must read VALUE or LOW:HIGH; received 'a'"),
        (parse_ranges, ["tabor=0.2:3.2"], {"tabor": (0.2, 3.2)}),
        (parse_ranges, ["tabor=1"], {"tabor": (1.0, 1.0)}),
        *((parse_ranges, [f"tabor{end}"], "range must read NAME=LOW:HIGH") for end in ("", "=", "=a:b", "=1:2:3")),
    ],
)
def test_what_is_typed_is_read_or_refused(read, text, found):
    if isinstance(found, str):
        with pytest.raises(ValueError, match=found):
            read(text)
    else:
        assert read(text) == found


def test_edges_are_denser_and_corners_hold_the_outermost_fifths_only():
    ranges = Design().ranges
    for name, share in (("edges", 0.5903), ("corners", 1.0), ("sobol", 0.4)):
        drawn = Design(name).protocols(4096, seed=1)
        for quantity, (low, high) in ranges.items():
            place = np.log(drawn[quantity] / low) / np.log(high / low)
            assert np.mean((place <= 0.2) | (place >= 0.8)) == pytest.approx(share, abs=2e-3)
            assert np.mean(place < 0.5) == pytest.approx(0.5, abs=1e-3)
