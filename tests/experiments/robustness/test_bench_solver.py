"""The solver beside another revision: in processes of their own, in turn, and judged."""

from pathlib import Path

import numpy as np
import pytest

from experiments.measurements.cases import drawn, rows_of
from experiments.robustness import bench_solver
from experiments.robustness.bench_solver import ROOT, compared, solved


@pytest.mark.parametrize(
    ("options", "said"),
    [
        *(({"accuracy": [words]}, "accuracy must be 'draft'") for words in ("fine", "0", "nan")),
        ({"baseline": Path("/nowhere")}, "baseline must be a checkout with the package `bem`; received '/nowhere'"),
    ],
)
def test_what_cannot_be_compared_is_refused_before_anything_runs(options, said):
    with pytest.raises(ValueError, match=said):
        bench_solver.study(**options)


def test_a_solver_of_its_own_answers_or_has_no_results(tmp_path):
    stiff = rows_of(drawn("stiff", 6, 1))
    found = solved(ROOT, [*stiff, stiff[0] | {"tabor": -1.0}], "draft")
    assert (found[:, 0] > 0.0).all()
    assert np.isfinite(found[:, 1:]).all(axis=1).tolist() == [True] * 6 + [False]
    assert [pull_off > 0.0 for pull_off in found[:6, 1]] == [row["adhesion"] > 0.0 for row in stiff]
    with pytest.raises(RuntimeError, match=r"the solver must come from '/nowhere'; received "):
        solved(Path("/nowhere"), stiff, "draft")


def test_two_solvers_take_turns_and_are_compared_where_both_completed(monkeypatch):
    """Seconds, pull-off force and hysteresis of four scenes, of which each solver leaves another one."""
    said = {
        "old": [(1.0, 1.0, 2.0), (10.0, 1.0, 2.0), (1.0, np.nan, np.nan), (1.0, 1.0, 2.0)],
        "new": [(5.0, 1.1, 2.0), (5.0, 1.1, 2.0), (5.0, 1.1, 2.0), (5.0, np.nan, np.nan)],
    }
    asked = []

    def answer(source, *_):
        asked.append(source)
        return np.add(said[source], [1.0 if asked.count(source) == 1 else 0.0, 0.0, 0.0])

    monkeypatch.setattr(bench_solver, "solved", answer)
    cells = compared(["old", "new"], [{}] * 4, "draft", 2, np.tile([1.0, 2.0], (4, 1)))
    assert asked == ["old", "new", "new", "old"]
    assert cells[:4] == ["3.25e+03 / 5e+03", f"{10.0 / 11.0:.3f}", "5.00", "1 / 1"]
    assert cells[4:] == ["0, 0, 0 / 10, 10, 10", "0, 0, 0 / 0, 0, 0"]
    assert compared(["old", "new"], [{}] * 4, "draft", 1, None)[4:] == ["", ""]


def test_samples_of_elastic_solids_are_those_beyond_the_box():
    elastic, beyond = (drawn(where, 20, 1) for where in ("elastic", "beyond"))
    assert (elastic["modulus_ratio"] == 1.0).all()
    assert (beyond["modulus_ratio"] < 1.0).all()
    assert (elastic["tabor"] == beyond["tabor"]).all()
