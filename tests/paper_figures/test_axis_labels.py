"""Ticks of logarithmic axes, short and long, and the folders that figures and tables go to."""

import pytest

from paper_figures.__main__ import save
from paper_figures.style import drawing
from paper_figures.style.cost_style import sparse_ticks
from paper_figures.style.writing import Table


@pytest.mark.parametrize("label", [sparse_ticks, lambda axes: drawing.log_labels(axes.xaxis)], ids=["sparse", "all"])
@pytest.mark.parametrize(("largest", "between"), [(50.0, True), (1e5, False)])
def test_only_a_short_logarithmic_axis_has_ticks_between_powers_of_ten(label, largest, between, kept):
    axes = drawing.figure(height=2.0).subplots()
    axes.set(xscale="log", xlim=(1.0, largest))
    label(axes)
    ticks = axes.get_xticks()
    assert 10.0 in ticks
    assert ({2.0, 5.0} <= set(ticks)) == between


def test_figures_and_tables_have_folders_of_their_own(kept, tmp_path):
    figures, tables = tmp_path / "figures", tmp_path / "tables"
    save({"one": Table(["n"], [["1"]], "."), "two": drawing.figure(height=2.0)}, "both", figures, tables)
    assert (len(kept), figures.exists()) == (1, False)
    assert {path.name for path in tables.iterdir()} == {"one.md", "one.csv", "one.tex"}
