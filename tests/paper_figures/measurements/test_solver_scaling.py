"""The figure of the solver's growing cost."""

import json

from paper_figures.measurements import figure_solver_scaling
from tests.paper_figures.results import made


def test_the_growth_of_the_cost_is_drawn(tmp_path):
    points = [{"nodes": n, "steps": 10.0 * n, "seconds": {"median": 1e-4 * n}} for n in (50.0, 100.0, 200.0)]
    curve = {"points": points, "exponent": 1.0}
    (tmp_path / "growth.json").write_text(json.dumps({"solver": {"nodes": curve, "steps": curve}}), encoding="utf-8")
    made(figure_solver_scaling, tmp_path / "growth.json", folder=tmp_path)
    assert (tmp_path / "figure-solver-scaling.pdf").is_file()
