"""The comparison with other software: its own parts without it, and coarse grids where it is installed."""

import math

import numpy as np
import pytest

from bem.problem.tractions import traction
from experiments.measurements import peers


def test_parabola_top_and_force_beyond_grid():
    x = np.linspace(-1.0, 1.0, 6)
    assert peers.highest(2.0 - 3.0 * (x - 0.1) ** 2) == pytest.approx(2.0)
    assert peers.highest(x) == 1.0
    assert peers.highest(np.array([1.0, 1.0, 1.0])) == 1.0
    half, indentation = 2.0, 0.5
    x = np.linspace(-60.0, 60.0, 1201)
    squared = np.add.outer(x**2, x**2)
    outside = np.maximum(np.abs(x)[:, np.newaxis], np.abs(x)) > half + 0.05
    law = traction.py_func(1.0 + 0.5 * squared - indentation)
    summed = float(law[outside].sum()) * 0.1**2 / math.pi
    assert peers.force_beyond(half + 0.05, indentation) == pytest.approx(summed, rel=0.01)


def test_the_other_software_is_required(monkeypatch):
    monkeypatch.setattr(peers, "PACKAGES", ("Adhesion", "no-such-package"))
    monkeypatch.setattr(peers, "EXACT_TARGET", 4e-3)
    with pytest.raises(RuntimeError, match=r"Adhesion and no-such-package must be installed: .*peers"):
        peers.study(finest=32)
    with pytest.raises(ValueError, match="finest must be one of 32, 64, 128, 256; received 100"):
        peers.study(finest=100)


def test_every_tool_finds_its_number(monkeypatch):
    for name, value in {"ACCURACIES": ("draft",), "NODES": (20,), "STEPS": 20, "REPEATS": 1}.items():
        monkeypatch.setattr(peers, name, value)
    ours = [run for run in peers.runs(32) if run.tool not in ("Adhesion", "tamaas")]
    exact = {"tabor 1": 1.67066, "tabor 3": 1.55096, "Hertz": 1.0}
    results = {(run.problem, run.tool, run.setting): peers.measured(run, exact[run.problem]) for run in ours}
    assert results["tabor 3", "closed form", "JKR"]["error"] == pytest.approx(1.0 - 1.5 / 1.55096)
    assert results["tabor 1", "solver", "draft"]["error"] < 0.02
    assert results["Hertz", "solver", "draft"]["error"] < 1e-3
    assert results["tabor 1", "paper's discretisation", "20 nodes"]["error"] < 0.1


def test_adhesion_on_a_coarse_grid():
    pytest.importorskip("Adhesion")
    assert peers.adhesion_largest_tension(1.0, 16, 2.0) == pytest.approx(1.67, rel=0.06)


def test_tamaas_on_coarse_grids():
    pytest.importorskip("tamaas")
    errors = [abs(peers.tamaas_hertz(1.0, grid, 2.0) - 1.0) for grid in (16, 64)]
    assert errors[1] < 0.1 * errors[0] < 1e-3
