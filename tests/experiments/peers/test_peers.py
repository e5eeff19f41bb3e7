"""The comparison with other software: its own parts without it, and coarse grids where it is installed."""

import json
import math

import numpy as np
import pytest

from bem.tractions import traction
from experiments import timing
from experiments.peers import other_software, peers


def test_the_top_of_a_parabola():
    x = np.linspace(-1.0, 1.0, 6)
    assert other_software.highest(2.0 - 3.0 * (x - 0.1) ** 2) == pytest.approx(2.0)
    assert other_software.highest(x) == 1.0
    assert other_software.highest(np.array([1.0, 1.0, 1.0])) == 1.0


def test_the_force_beyond_a_square_is_that_of_an_undeformed_sphere():
    half, indentation = 2.0, 0.5
    x = np.linspace(-60.0, 60.0, 1201)
    squared = np.add.outer(x**2, x**2)
    outside = np.maximum(np.abs(x)[:, np.newaxis], np.abs(x)) > half + 0.05
    law = traction.py_func(1.0 + 0.5 * squared - indentation)
    summed = float(law[outside].sum()) * 0.1**2 / math.pi
    assert other_software.force_beyond(half + 0.05, indentation) == pytest.approx(summed, rel=0.01)


def test_without_them_the_others_run_and_nothing_is_published(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(peers, "installed", dict)
    monkeypatch.setattr(peers, "NOT_PUBLISHED", tmp_path / "kept")
    for name, value in {"ACCURACIES": ("draft",), "NODES": (20,), "STEPS": 20, "EXACT_TARGET": 4e-3}.items():
        monkeypatch.setattr(peers, name, value)
    out = tmp_path / "peers.json"
    unpublished = r"measurement without Adhesion and tamaas is in '.*kept.*' and not published"
    with pytest.raises(RuntimeError, match=unpublished):
        peers.main(32, out, busy=True)
    assert not out.exists()
    content = json.loads((tmp_path / "kept" / "peers.json").read_text(encoding="utf-8"))
    assert (content["missing"], content["packages"]) == (["Adhesion", "tamaas"], {})
    found = {(run["problem"], run["tool"], run["setting"]): run for run in content["runs"]}
    assert found["tabor 3", "closed form", "JKR"]["error"] == pytest.approx(1.0 - 1.5 / content["exact"]["tabor 3"])
    assert found["Hertz", "solver", "draft"]["error"] < 1e-3
    assert found["tabor 1", "paper's discretisation", "20 nodes"]["error"] < 0.1
    first, *_ = capsys.readouterr().err.splitlines()
    assert first == f"Adhesion and tamaas not found and left out; install with {other_software.INSTALL}"
    with pytest.raises(ValueError, match="finest must be one of 32, 64, 128, 256; received 100"):
        peers.main(100)


def test_the_time_left_counts_how_long_things_take(monkeypatch, capsys):
    now = iter([0.0, 1.0, 3.0, 63.0])
    monkeypatch.setattr(timing, "SAID_EVERY", -1.0)
    monkeypatch.setattr(timing.time, "perf_counter", lambda: next(now))
    assert list(timing.progress("abc", "letters", shares=[1.0, 2.0, 60.0])) == ["a", "b", "c"]
    first, second, third = capsys.readouterr().err.splitlines()
    assert first == "letters: 1 of 3"
    assert second == "letters: 2 of 3, 0:01:00 left"
    assert third == "letters: 3 of 3, 0:00:00 left"


def test_adhesion_on_a_coarse_grid():
    pytest.importorskip("Adhesion")
    assert other_software.adhesion_largest_tension(1.0, 16, 2.0) == pytest.approx(1.67, rel=0.06)


def test_tamaas_on_coarse_grids():
    pytest.importorskip("tamaas")
    errors = [abs(other_software.tamaas_hertz(1.0, grid, 2.0) - 1.0) for grid in (16, 64)]
    assert errors[1] < 0.1 * errors[0] < 1e-3
