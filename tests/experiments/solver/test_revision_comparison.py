"""The comparison with another revision's solver: checked out, run beside this one, and judged."""

import numpy as np
import pytest

from experiments.solver import bench_solver, revision_comparison, solver_processes
from experiments.solver.revision_comparison import NOW
from experiments.solver.solver_processes import ROOT, WORK


def test_an_unknown_baseline_is_refused(tmp_path):
    for revision in ("no-such-revision", "--output=x"):
        with pytest.raises(ValueError, match="baseline must be a git revision; received"):
            revision_comparison.checked_out(revision, tmp_path)
    assert not list(tmp_path.iterdir())


def test_an_unknown_accuracy_is_refused_before_anything_runs():
    for words in ("fine", "0", "nan"):
        with pytest.raises(ValueError, match="accuracy must be 'draft'"):
            bench_solver.main(baseline="HEAD", accuracy=[words])


def test_the_package_of_a_revision_is_checked_out_once(tmp_path, monkeypatch):
    monkeypatch.setattr(revision_comparison, "KEPT", tmp_path)
    source = revision_comparison.source_of("HEAD")
    assert (source / "bem" / "__init__.py").is_file()
    monkeypatch.setattr(revision_comparison, "checked_out", None)
    assert revision_comparison.source_of("HEAD") == source


def test_a_solver_beside_itself_does_and_errs_the_same(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(solver_processes, "KEPT", tmp_path)
    monkeypatch.setattr(solver_processes, "EXACT_TARGET", 4e-3)
    monkeypatch.setattr(revision_comparison, "source_of", lambda _: ROOT)
    found = revision_comparison.compare("HEAD", "HEAD", ["standard", 1.7e-2], 2, 1, 1, 1)
    same, other = found["levels"]
    for level in (same, other):
        old, new = level["solvers"]["HEAD"], level["solvers"][NOW]
        assert old["errors"] == new["errors"]
        assert old["work"] == new["work"]
        assert set(new["work"]) == set(WORK)
        assert old["compared"] == 2
    assert same["solvers"][NOW]["errors"]["force"]["largest"] == 0.0
    assert other["solvers"][NOW]["errors"]["force"]["largest"] > 0.0
    assert len(list(tmp_path.glob("*.npy"))) == 1
    revision_comparison.show(found)
    said = capsys.readouterr().out
    assert "standard" in said
    assert said.count(NOW) == 4


def test_the_interval_of_the_ratio_holds_it():
    old = np.linspace(1.0, 2.0, 50)
    speed, low, high = revision_comparison.ratio(0.5 * old, old)
    assert low == speed == high == 0.5
    speed, low, high = revision_comparison.ratio(old[::-1], old)
    assert low < speed == 1.0 < high
    new = np.random.default_rng(3).normal(1.0, 0.2, 400)
    _, low, high = revision_comparison.ratio(new, np.ones(400))
    assert high - low == pytest.approx(2 * 1.96 * new.std() / np.sqrt(400), rel=0.1)
