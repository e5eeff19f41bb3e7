"""Ticks of logarithmic axes, short and long."""

import pytest

from paper_figures.style import drawing
from paper_figures.style.cost_style import sparse_ticks


@pytest.mark.parametrize("label", [sparse_ticks, lambda axes: drawing.log_labels(axes.xaxis)], ids=["sparse", "all"])
@pytest.mark.parametrize(("largest", "between"), [(50.0, True), (1e5, False)])
def test_only_a_short_logarithmic_axis_has_ticks_between_powers_of_ten(label, largest, between):
    axes = drawing.figure(height=2.0).subplots()
    axes.set(xscale="log", xlim=(1.0, largest))
    label(axes)
    ticks = axes.get_xticks()
    assert 10.0 in ticks
    assert ({2.0, 5.0} <= set(ticks)) == between
