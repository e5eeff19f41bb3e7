"""Small soaks: what they count, keep and continue."""

import numpy as np
import pytest

from experiments.measurements.cases import Case, drawn, rows_of
from experiments.robustness import soak

PEAK = np.sin(np.linspace(0.0, 3.0, 40))


def soaked(count, beyond, folder, stiff=0):
    return soak.study(count=count, beyond=beyond, stiff=stiff, jobs=1, folder=folder / "chunks")


FLAT = np.concatenate([np.linspace(0.0, -1.0, 50)[:20], np.zeros(30)])


@pytest.mark.parametrize(
    ("force", "scale", "shares"),
    [
        (PEAK, 1.0, []),
        (np.concatenate([PEAK[:20], PEAK[:20] - 3.0]), 1.0, []),
        ([0.0, 0.0, 1.0, 0.2, 0.1, 0.0], 1.0, []),
        ([0.0, 9.0, 0.0], 1.0, []),
        (np.insert(PEAK, 10, 868.0), 1.0, [1.0]),
        (np.insert(PEAK, 10, -0.5), 1.0, [0.76]),
        # Rounding is no spike where there is no pull-off force.
        (np.insert(FLAT, 40, 1e-16), 0.0, []),
        (np.insert(FLAT, 40, 0.1), 0.0, [0.205]),
    ],
)
def test_lone_spikes_are_seen_and_peaks_and_jumps_are_none(force, scale, shares):
    assert soak.lone_spikes(np.array(force), scale) == pytest.approx(shares, rel=0.01)


def test_a_soak_counts_and_is_not_computed_again(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, "CHUNK", 6)
    content = soaked(48, 12, tmp_path, stiff=6)
    inside, beyond = content["inside"], content["beyond"]
    assert beyond["memory_growth"] is None  # too few chunks to say
    assert inside["memory_growth"] < 0.2
    for where in ("inside", "beyond", "stiff"):
        found = content[where]
        assert found["raised"] == found["silent"] == 0
        assert found["statuses"] == {"completed": found["protocols"]}
    monkeypatch.setattr(soak, "soaked", None)
    assert soaked(48, 12, tmp_path)["inside"] == inside


def test_memory_grows_and_stiff_contacts_are_with_and_without_adhesion():
    row = {"status": "completed", "raised": False, "silent": False, "spikes": 0, "spike_share": 0.0, "seconds": 1.0}
    chunks = [{"rows": [row], "memory": size} for size in [100] * 4 + [150] * 4]
    assert soak.summary(chunks)["memory_growth"] == pytest.approx(0.5)
    columns = drawn("stiff", 40, 11)
    assert set(columns["adhesion"]) == {0.0, 1.0}
    assert columns["modulus_ratio"].max() < 0.3


def test_chunks_belong_to_their_solver_accuracy_and_protocols(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, "soaked", lambda _: {})

    def kept(seed):
        soak.chunk("inside", 0, 4, seed, tmp_path)
        return len(list(tmp_path.iterdir()))

    assert [kept(1), kept(1), kept(2)] == [1, 1, 2]
    monkeypatch.setattr(soak, "ACCURACY", "draft")
    assert kept(1) == 3
    monkeypatch.setattr(soak, "SOLVER_VERSION", "another")
    assert kept(1) == 4


def test_soak_sees_exceptions(monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(Case, "run", broken)
    found = soak.soaked(rows_of(drawn("inside", 1, 0))[0])
    assert found["raised"]
    assert found["status"] == "ZeroDivisionError: division by zero"


@pytest.mark.slow
def test_one_percent_of_the_soak(tmp_path, monkeypatch):
    monkeypatch.setattr(soak, "CHUNK", 25)
    content = soaked(1000, 200, tmp_path)
    for where in ("inside", "beyond"):
        assert content[where]["statuses"] == {"completed": content[where]["protocols"]}
        assert content[where]["silent"] == 0
        assert content[where]["memory_growth"] < 0.05
