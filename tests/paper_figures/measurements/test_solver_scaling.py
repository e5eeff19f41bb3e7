"""The figure of the solver's growing cost."""

import json

import pytest

from paper_figures.measurements import figure_solver_scaling
from tests.paper_figures.results import made


def test_the_growth_of_the_cost_is_drawn(tmp_path):
    points = [{"nodes": n, "steps": 10.0 * n, "seconds": {"median": 1e-4 * n}} for n in (50.0, 100.0, 200.0)]
    curve = {"points": points, "exponent": 1.0}
    growth = {"solver": {"nodes": curve, "steps": curve}}
    for axes, unit in zip(figure_solver_scaling.compose(growth).axes, (1e-6, 1e-3), strict=True):
        (measured,) = (line for line in axes.lines if line.get_label() == "measured")
        assert unit * measured.get_ydata() == pytest.approx([5e-3, 1e-2, 2e-2])
    (tmp_path / "growth.json").write_text(json.dumps(growth), encoding="utf-8")
    made(figure_solver_scaling, tmp_path / "growth.json", folder=tmp_path)
    assert (tmp_path / "figure-solver-scaling.pdf").is_file()
