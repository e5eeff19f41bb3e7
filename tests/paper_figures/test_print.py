"""Everything published is drawn, and every figure is fit for print: width, texts and their sizes, and colours."""

from importlib import import_module
from itertools import combinations

import pytest

from bem.results.plots import COLOURS
from paper_figures.__main__ import modules
from paper_figures.style import drawing
from paper_figures.style.writing import Table
from tests.paper_figures import printed
from tests.paper_figures.inputs import read_inputs

LEAST = 6.5  # points
APART = 10.0  # in CIELAB; two patches side by side differ from about 2
SEVERAL = {
    "table-accuracy-cost": {"accuracy-cost", "fastest-tool"},
    "table-protocols-dataset": {"protocols-dataset", "dataset-summary"},
    "table-ranking": {"ranking", "ranking-orders"},
    "figure-amortisation": {"figure-amortisation", "amortisation"},
    "figure-features": {"figure-features", "features"},
}
"""Names of what is drawn, where it is more than one thing."""


@pytest.mark.parametrize("name", modules())
def test_figures_are_fit_for_print(name, tmp_path):
    """From the results of this repository, as far as these are there; what is published is."""
    compose = import_module(modules()[name]).compose
    try:
        results = read_inputs(name)
    except FileNotFoundError as missing:
        if "/studies/" not in str(missing):
            raise
        pytest.skip(str(missing))
    products = compose(*results)
    products = products if isinstance(products, dict) else {name: products}
    assert products.keys() == SEVERAL.get(name, {name})
    for stem, product in products.items():
        assert isinstance(product, Table) != stem.startswith(("figure-", "graphical-"))
        if isinstance(product, Table):
            check_table(product, stem, tmp_path)
        else:
            check_figure(product)


def check_table(table, stem, folder):
    assert {len(row) for row in table.rows} == {len(table.header)}
    table.save(stem, folder)
    # A contact without adhesion has no pull-off force, by which the table of hard cases divides.
    assert ("nan" in (folder / f"{stem}.md").read_text(encoding="utf-8").lower()) == (stem == "table-hard-cases")


def check_figure(figure):
    """Its panels have data; it is as wide as a column or two; its texts are readable and lie on no other."""
    assert all(axes.has_data() or not axes.axison for axes in figure.axes)
    drawing.write_decades_plainly(figure)
    assert round(figure.get_figwidth() * printed.MILLIMETRES) in (88, 180)
    texts = printed.texts(figure)
    assert [text.get_text() for text in texts if text.get_fontsize() < LEAST] == []
    assert [text.get_text() for text in texts if "10^" in text.get_text()] == []  # exponents are smaller
    assert printed.overlaps(figure, texts) == []
    # Colours that a legend tells apart differ for every eye.
    for named in printed.colors(figure):
        pairs = [pair for pair in combinations(named, 2) if len({named[label] for label in pair}) == 2]
        assert [pair for pair in pairs if printed.distance(*(named[label] for label in pair)) < APART] == []


def test_every_tool_has_a_colour_of_its_own():
    assert len(set(COLOURS.values())) == len(COLOURS)


@pytest.mark.parametrize(("largest", "between"), [(50.0, True), (1e5, False)])
def test_short_log_axes_have_minor_ticks(largest, between):
    axes = drawing.figure(height=2.0).subplots()
    axes.set(xscale="log", xlim=(1.0, largest))
    drawing.log_labels(axes.xaxis)
    ticks = axes.get_xticks()
    assert 10.0 in ticks
    assert ({2.0, 5.0} <= set(ticks)) == between
