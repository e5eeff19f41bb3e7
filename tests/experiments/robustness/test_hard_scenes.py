"""The studies of the solver: at named extremes, at large Tabor parameters, and soaks."""

import dataclasses

import numpy as np
import pytest

from bem import ForceProtocol, LoadingProtocol, simulate
from bem.methods.closed_forms import jkr
from bem.problem.accuracy import resolve_accuracy
from experiments.cases import Case, drawn, rows_of
from experiments.robustness import hard_case_map, large_tabor, random_scenes
from experiments.robustness.hard_case_map import relative_change


def test_samples_inside_beyond_and_stiff():
    elastic, beyond, stiff = (drawn(where, 40, 11) for where in ("elastic", "beyond", "stiff"))
    assert (elastic["modulus_ratio"] == 1.0).all()
    assert (beyond["modulus_ratio"] < 1.0).all()
    assert (elastic["tabor"] == beyond["tabor"]).all()
    assert (beyond["peak_indentation"] <= 200.0 * beyond["tabor"] ** -1.5).all()
    assert set(stiff["adhesion"]) == {0.0, 1.0}
    assert stiff["modulus_ratio"].max() < 0.3


def test_extremes():
    named = hard_case_map.extremes()
    assert len(named) == 19
    for scene, protocol in named.values():
        if isinstance(protocol, LoadingProtocol):
            assert protocol.peak_indentation > protocol.start(scene.tabor)
    assert hard_case_map.creeping(3.2, 0.05, 1.0).indentations[3] == jkr.fold_indentation(3.2) + 0.05
    row = hard_case_map.extreme("jumps", *named["snap-in and snap-off, elastic"])
    assert (row["status"], row["refined_status"], row["jumps"]) == ("completed", "completed", 2)
    assert row["energy"] > 0.0
    assert row["change"] < 4e-3
    assert set(row["coarse"]) == {"draft", "0.05"}
    assert all(run["status"] == "completed" and run["change"] < 0.5 for run in row["coarse"].values())


def test_contact_without_pull_off_force():
    case = Case.of(rows_of(drawn("inside", 1, 3, "sobol"))[0])
    assert hard_case_map.compared(case.scene, case.protocol)["status"] == "completed"
    row = hard_case_map.extreme("stiff glass", *hard_case_map.extremes()["stiff glass without adhesion"])
    assert row["change"] == row["coarse"]["draft"]["change"] == 0.0
    assert relative_change(1.0, 0.0) == np.inf
    assert relative_change(1.02, 1.0) == pytest.approx(0.02)


def test_large_tabor_stays_in_its_bounds():
    scenes = [large_tabor.drawn(number, 17) for number in range(12)]
    assert all(large_tabor.TABORS[0] <= scene.tabor <= large_tabor.TABORS[-1] for scene, _, _ in scenes)
    assert {type(protocol) for _, protocol, _ in scenes} == {LoadingProtocol, ForceProtocol}
    assert {scene.spring is None for scene, _, _ in scenes} == {True, False}
    rows = [large_tabor.solved(number, 17, refine=number == 6) for number in range(9)]
    assert {row["status"] for row in rows} == {"completed"}
    assert not any(row["breaches"] for row in rows)
    assert rows[6]["change"] < resolve_accuracy("draft").target
    text = large_tabor.page_text({"scenes": rows, "target": 0.017, "command": "c", "host": "h"})
    assert "0 break a physical bound" in text


def test_breaches_of_bounds_are_seen():
    scene, protocol, _ = large_tabor.drawn(0, 17)
    trajectory = simulate(scene, protocol, "draft")
    for name, factor, bound in (("force", 50.0, "tension"), ("contact_radius", 5.0, "contact radius")):
        wrong = dataclasses.replace(trajectory, **{name: factor * getattr(trajectory, name)})
        assert bound in list(large_tabor.breaches(scene, wrong))
    backwards = dataclasses.replace(trajectory, force=-trajectory.force)
    assert "work" in list(large_tabor.breaches(scene, backwards))


PEAK = np.sin(np.linspace(0.0, 3.0, 40))


def soaked(count, beyond, folder, stiff=0):
    return random_scenes.study_soak(count=count, beyond=beyond, stiff=stiff, jobs=1, folder=folder / "chunks")


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
def test_lone_spikes_are_not_peaks_or_jumps(force, scale, shares):
    assert random_scenes.lone_spikes(np.array(force), scale) == pytest.approx(shares, rel=0.01)


def test_soak_resumes_from_its_chunks(tmp_path, monkeypatch):
    monkeypatch.setattr(random_scenes, "CHUNK", 6)
    soak = soaked(48, 12, tmp_path, stiff=6)
    inside, beyond = soak["inside"], soak["beyond"]
    assert beyond["memory_growth"] is None  # too few chunks to say
    assert inside["memory_growth"] < 0.2
    for where in ("inside", "beyond", "stiff"):
        chunk = soak[where]
        assert chunk["raised"] == chunk["silent"] == 0
        assert chunk["statuses"] == {"completed": chunk["protocols"]}
    monkeypatch.setattr(random_scenes, "simulated_row", None)
    assert soaked(48, 12, tmp_path)["inside"] == inside


def test_memory_grows():
    row = {"status": "completed", "raised": False, "silent": False, "spikes": 0, "spike_share": 0.0, "seconds": 1.0}
    chunks = [{"rows": [row], "memory": size} for size in [100] * 4 + [150] * 4]
    assert random_scenes.summary(chunks)["memory_growth"] == pytest.approx(0.5)


def test_chunks_depend_on_their_settings(tmp_path, monkeypatch):
    monkeypatch.setattr(random_scenes, "simulated_row", lambda _: {})

    def kept(seed):
        random_scenes.chunk("inside", 0, 4, seed, tmp_path)
        return len(list(tmp_path.iterdir()))

    assert [kept(1), kept(1), kept(2)] == [1, 1, 2]
    monkeypatch.setattr(random_scenes, "ACCURACY", "draft")
    assert kept(1) == 3
    monkeypatch.setattr(random_scenes, "SOLVER_VERSION", "another")
    assert kept(1) == 4


def test_soak_sees_exceptions(monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(Case, "run", broken)
    row = random_scenes.simulated_row(rows_of(drawn("inside", 1, 0))[0])
    assert row["raised"]
    assert row["status"] == "ZeroDivisionError: division by zero"


@pytest.mark.slow
def test_one_percent_of_the_soak(tmp_path, monkeypatch):
    monkeypatch.setattr(random_scenes, "CHUNK", 25)
    soak = soaked(1000, 200, tmp_path)
    for where in ("inside", "beyond"):
        assert soak[where]["statuses"] == {"completed": soak[where]["protocols"]}
        assert soak[where]["silent"] == 0
        assert soak[where]["memory_growth"] < 0.05
