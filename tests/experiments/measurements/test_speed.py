"""Two solvers take turns on the same protocols."""

import pytest

from experiments.cases import drawn, rows_of
from experiments.measurements.speed import ROOT, Solver, checkout, compared


@pytest.mark.slow
def test_solver_has_no_error_against_itself():
    cells = compared((ROOT, ROOT), rows_of(drawn("inside", 2, 1)), "draft", 1)
    assert cells[0] == "draft"
    assert cells[-2:] == ["0.0e+00", "0.0e+00"]


@pytest.mark.slow
def test_a_solver_from_elsewhere_is_refused(tmp_path):
    solver = Solver(tmp_path)
    with pytest.raises(RuntimeError, match="the solver must come from"):
        solver(rows_of(drawn("inside", 1, 1)), "draft")
    solver.close()


def test_checkout_has_the_revision_and_ends():
    with checkout("HEAD") as folder:
        assert (folder / "bem" / "__init__.py").is_file()
    assert not folder.exists()
