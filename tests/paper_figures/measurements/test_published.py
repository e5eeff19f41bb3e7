"""What is published is drawn: every figure and table of the measurements, and cells and curves of some of them."""

import json
from importlib import import_module

import pytest

from experiments.places import Places
from paper_figures.__main__ import modules
from paper_figures.measurements import figure_effects
from paper_figures.style import drawing
from paper_figures.style.writing import Table
from paper_figures.tables import table_recommendations
from tests.paper_figures.results import SPREAD, UNKNOWN

PARTS = (".measurements.", "table_accuracy_cost", "stand_ins", "recommendations", "peers", "hard_cases", "surrogates")
SHOWN = [name for name, module in modules().items() if any(part in module for part in PARTS)]
SEVERAL = {
    "table-accuracy-cost": {"accuracy-cost", "fastest-tool"},
    "figure-amortisation": {"figure-amortisation", "amortisation"},
}
"""Names of what is drawn, where it is more than one thing."""


def published(name):
    return json.loads(Places().path(name).read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", SHOWN)
def test_what_is_published_is_drawn(name, tmp_path):
    compose = import_module(modules()[name]).compose
    products = compose(**Places().arguments(compose, name))
    products = products if isinstance(products, dict) else {name: products}
    assert products.keys() == SEVERAL.get(name, {name})
    for stem, product in products.items():
        if isinstance(product, Table):
            assert not stem.startswith("figure-")
            assert {len(row) for row in product.rows} == {len(product.header)}
            product.save(stem, tmp_path)
            # A contact without adhesion has no pull-off force, by which the table of hard cases divides.
            missing = "nan" in (tmp_path / f"{stem}.md").read_text(encoding="utf-8").lower()
            assert missing == (stem == "table-hard-cases")
        else:
            assert stem.startswith("figure-")
            assert all(axes.has_data() or not axes.axison for axes in product.axes)


def test_tolerances_are_in_percent_and_recommendations_counted_of_those_simplified():
    axes = drawing.figure(height=2.0).subplots()
    figure_effects.draw_stand_ins(axes, published("effects") | {"tolerance": 0.07})
    assert any(list(line.get_ydata()) == pytest.approx([7.0, 7.0]) for line in axes.lines)
    numbers = {"kept": 4, "cases": 20, "worst_error": 0.2, "simplified": 5, "by_estimate": 1, "slower": 1}
    row = {"sample": "paper", "quantity": "pull_off_force", "tolerance": 0.1, **numbers}
    row |= dict.fromkeys(("full_seconds", "ratio", "seconds"), SPREAD)
    none = row | dict.fromkeys(("kept", "simplified", "slower"), 0) | {"worst_error": None}
    none |= {"full_seconds": UNKNOWN, "ratio": UNKNOWN}
    some, nothing = ([cell(one) for cell in table_recommendations.COLUMNS.values()] for one in (row, none))
    assert {"4 of 5", "0.02 (0.06)"} <= set(some)
    assert {"0 of 0", "-"} <= set(nothing)
