"""Small soaks: what they count, keep and continue."""

import json

import numpy as np
import pytest

from experiments.robustness import soak


def soak_summary(count, beyond, folder, stiff=0):
    out = folder / "soak.json"
    soak.main(count, beyond, stiff, 11, 1, folder / "chunks", out)
    return json.loads(out.read_text(encoding="utf-8"))


def test_a_lone_spike_is_told_from_peaks_and_jumps():
    peak = np.sin(np.linspace(0.0, 3.0, 40))
    assert len(soak.lone_spikes(peak, 1.0)) == 0
    assert len(soak.lone_spikes(np.concatenate([peak[:20], peak[:20] - 3.0]), 1.0)) == 0
    assert len(soak.lone_spikes(np.array([0.0, 0.0, 1.0, 0.2, 0.1, 0.0]), 1.0)) == 0
    for spike, share in ((868.0, 1.0), (-0.5, 0.76)):
        assert soak.lone_spikes(np.insert(peak, 10, spike), 1.0) == pytest.approx([share], rel=0.01)
    assert len(soak.lone_spikes(np.array([0.0, 9.0, 0.0]), 1.0)) == 0


def test_rounding_is_no_spike_where_there_is_no_pull_off_force():
    force = np.linspace(0.0, -1.0, 50)
    force[20:] = 0.0
    force[40] = 1e-16
    assert soak.lone_spikes(force, 0.0).size == 0
    force[40] = 0.1
    assert soak.lone_spikes(force, 0.0).size == 1


def test_a_small_soak_raises_nothing_and_keeps_its_memory(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, "CHUNK", 6)
    content = soak_summary(48, 12, tmp_path)
    inside, beyond = content["inside"], content["beyond"]
    assert inside["chunks"] == 8
    assert inside["memory_growth"] < 0.2
    assert beyond["memory_growth"] is None  # too few chunks to say
    for found in (inside, beyond):
        assert found["raised"] == found["silent"] == 0
        assert found["statuses"] == {"completed": found["protocols"]}


def test_memory_grows_from_the_first_half_of_the_chunks_to_the_second():
    common = {"statuses": {}, "count": 1, "raised": 0, "silent": 0, "spikes": 0, "notable": [], "slowest": 1.0}
    chunks = [common | {"mean_seconds": 1.0, "memory_bytes": size} for size in [100] * 4 + [150] * 4]
    assert soak.summary(chunks)["memory_growth"] == pytest.approx(0.5)


def test_chunks_belong_to_their_solver_accuracy_and_protocols(tmp_path, monkeypatch):
    monkeypatch.setattr(
        soak, "soaked", lambda _: {"status": "completed", "raised": False, "silent": False, "spikes": 0, "seconds": 1}
    )
    soak.chunk("inside", 0, 4, 1, tmp_path)
    soak.chunk("inside", 0, 4, 1, tmp_path)
    assert len(list(tmp_path.iterdir())) == 1
    soak.chunk("inside", 0, 4, 2, tmp_path)
    monkeypatch.setattr(soak, "ACCURACY", "draft")
    soak.chunk("inside", 0, 4, 1, tmp_path)
    monkeypatch.setattr(soak, "SOLVER_VERSION", "another")
    soak.chunk("inside", 0, 4, 1, tmp_path)
    assert len(list(tmp_path.iterdir())) == 4


def test_soak_counts_and_continues(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, "CHUNK", 10)
    content = soak_summary(20, 5, tmp_path)
    assert (content["inside"]["protocols"], content["beyond"]["protocols"]) == (20, 5)
    assert all(content[where]["raised"] == content[where]["silent"] == 0 for where in ("inside", "beyond"))

    def never(*_):
        raise AssertionError("chunks that are there must not be computed again")

    monkeypatch.setattr(soak, "simulate", never)
    assert soak_summary(20, 5, tmp_path)["inside"] == content["inside"]


def test_soak_sees_exceptions(monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(soak, "simulate", broken)
    point = {name: float(values[0]) for name, values in soak.protocols("inside", 1, 0).items()}
    found = soak.soaked(point)
    assert found["raised"]
    assert found["status"] == "ZeroDivisionError: division by zero"


@pytest.mark.slow
def test_one_percent_of_the_soak(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, "CHUNK", 25)
    content = soak_summary(1000, 200, tmp_path)
    for where in ("inside", "beyond"):
        assert content[where]["chunks"] >= 8
        assert content[where]["statuses"] == {"completed": content[where]["protocols"]}
        assert content[where]["silent"] == 0
        assert content[where]["memory_growth"] < 0.05


def test_stiff_contacts_are_soaked_with_and_without_adhesion(tmp_path):
    drawn = soak.protocols("stiff", 40, 11)
    assert set(drawn["adhesion"]) == {0.0, 1.0}
    assert drawn["modulus_ratio"].max() < 0.3
    found = soak_summary(0, 0, tmp_path, stiff=20)["stiff"]
    assert found["statuses"] == {"completed": 20}
    assert found["raised"] == found["silent"] == 0
