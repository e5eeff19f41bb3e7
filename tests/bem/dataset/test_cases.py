"""Campaigns of any scenes and protocols: what is computed, kept, resumed and read again."""

import json
from dataclasses import asdict, replace

import h5py
import numpy as np
import pytest

import bem
from bem import Cases, HardContact, Scene, load_cases, run_campaign
from bem.dataset.cases import ARRAYS, described, outcome_text, restored, restored_trajectory, with_nan
from bem.dataset.file import load_dataset
from bem.dataset.sealed_file import DamagedFileError
from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid
from bem.problem.protocol import ForceProtocol, LoadingProtocol, PiecewiseLinearProtocol
from bem.results.trajectory import Statistics
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import run_here, stop_after
from tests.data_files import editing

RAMP = LoadingProtocol(peak_indentation=2.0, loading_rate=1.0, dwell_time=0.5, unloading_rate=3.0)
CYCLES = PiecewiseLinearProtocol([0.0, 1.0, 1.5, 2.25, 3.0], [-1.0, 2.0, 0.1, 2.0, -1.0])
MATERIALS = (Elastic(), StandardLinearSolid(0.3), PronySeries([0.3, 0.1], [1.0, 1e-3 / 3.0]))
PAIRS = [
    (Scene(0.1 + mu / 3.0, material, adhesion), protocol)
    for mu in range(5)
    for material in MATERIALS
    for adhesion in (bem.LennardJones(), HardContact())
    for protocol in (RAMP, CYCLES)
]


def same(first, second):
    """Whether two trajectories are the same to the last bit, NaN included."""
    np.testing.assert_equal(asdict(first), asdict(second))
    assert [getattr(first, name).dtype for name in ARRAYS] == [getattr(second, name).dtype for name in ARRAYS]


@pytest.fixture(scope="module")
def cases_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("cases") / "cases.h5"
    summary = run_here(Cases(PAIRS), path, solver=stand_in.solve, command="made by hand")
    assert (summary.count, summary.computed, sum(summary.failures.values())) == (60, 60, 0)
    assert list(path.parent.iterdir()) == [path]
    return path


def test_cases_read_back_unchanged(cases_file):
    cases = load_cases(cases_file)
    assert [(case.scene, case.protocol) for case in cases] == PAIRS
    for case in cases:
        same(case.trajectory, stand_in.solve(case.scene, case.protocol))
        assert case.reason == ""
    assert any(np.isnan(jump.energy_lost) for case in cases for jump in case.trajectory.jumps)
    with h5py.File(cases_file) as file:  # as any program reads it
        offsets = file["native/offsets"][:]
        for row in (0, 59):
            piece = slice(offsets[row], offsets[row + 1])
            np.testing.assert_array_equal(file["native/force"][piece], cases[row].trajectory.force)
            assert file["scalars/hysteresis"][row] == cases[row].trajectory.hysteresis
            assert json.loads(file["scene"].asstr()[row])["tabor"] == cases[row].scene.tabor
            assert "NaN" not in file["outcome"].asstr()[row]
        assert file.attrs["command"] == "made by hand"


def test_an_interrupted_one_continues(cases_file, tmp_path):
    out = tmp_path / "cases.h5"
    with pytest.raises(InterruptedError):
        run_campaign(Cases(PAIRS), out, solver=stand_in.solve, workers=2, progress=stop_after(20))
    with pytest.raises(ValueError, match=r"cases '[0-9a-f]{64}' there and '[0-9a-f]{64}' here"):
        run_campaign(Cases(PAIRS[::-1]), out, solver=stand_in.solve)
    assert 0 < run_here(Cases(PAIRS), out, solver=stand_in.solve).computed < 60
    for case, uninterrupted in zip(load_cases(out), load_cases(cases_file), strict=True):
        same(case.trajectory, uninterrupted.trajectory)
    assert list(tmp_path.iterdir()) == [out]


def test_failed_cases_are_kept_or_repeated(mending):
    out, mend = mending

    def run(**options):
        return run_campaign(Cases(PAIRS), out, solver=stand_in.fails_until_mended, **options)

    assert dict(run().failures) == {"ArithmeticError: not mended yet": 20, "stopped": 20}
    for case in load_cases(out):
        assert (case.trajectory is None) == isinstance(case.scene.material, Elastic)
        if isinstance(case.scene.material, PronySeries):
            assert (case.reason, case.trajectory.completed, len(case.trajectory.time)) == ("stopped", False, 10)
    mend()
    again = run(retry_failed=True)
    assert (again.computed, dict(again.failures)) == (40, {})


def test_neither_file_is_taken_for_the_other(cases_file, undisturbed):
    with pytest.raises(ValueError, match="an HDF5 file of another kind"):
        load_dataset(cases_file)
    with pytest.raises(ValueError, match="an HDF5 file of another kind"):
        load_cases(undisturbed)
    data = undisturbed.read_bytes()
    with pytest.raises(ValueError, match="an HDF5 file of another kind"):
        run_campaign(Cases(PAIRS), undisturbed, replace=True)
    assert undisturbed.read_bytes() == data


@pytest.mark.parametrize(
    "harm",
    [
        lambda file: file.__delitem__("outcome"),
        lambda file: file["outcome"].__setitem__(0, "{"),
        lambda file: file["outcome"].__setitem__(0, '{"status": "completed"}'),
        lambda file: file["scene"].__setitem__(0, '{"type": "Path"}'),
        lambda file: file["protocol"].__setitem__(0, '{"type": "__name__"}'),
        lambda file: file["scene"].__setitem__(0, "[" * 10**5),
        lambda file: file.attrs.__delitem__("campaign"),
        lambda file: file.attrs.__setitem__("wall_seconds", "long"),
    ],
)
def test_unfitting_files_are_refused(harm, cases_file, tmp_path):
    path = tmp_path / "cases.h5"
    path.write_bytes(cases_file.read_bytes()[:-1])
    with pytest.raises(DamagedFileError, match="truncated or damaged"):
        load_cases(path)
    path.write_bytes(cases_file.read_bytes())
    with editing(path) as file:
        harm(file)
    with pytest.raises(DamagedFileError, match="expected a complete file of cases") as error:
        load_cases(path)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 1000


class Own(Elastic):
    """A material that a file could not name."""


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ([], "cases must hold at least one pair"),
        ([3], "case 0 must be a Scene and a protocol; received 3"),
        ([PAIRS[0], (RAMP, PAIRS[0][0])], "case 1 must be a Scene and a protocol"),
        ([(Scene(1.0), LoadingProtocol(peak_indentation=-5.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0))],
         "case 0: peak_indentation must lie above the start"),
        ([(Scene(1.0, Own()), RAMP)], "must be made of the public classes of bem; received 'Own'"),
    ],
)  # fmt: skip
def test_impossible_cases_are_refused(pairs, message):
    with pytest.raises(ValueError, match=message):
        Cases(pairs)
    with pytest.raises(ValueError, match="accuracy must be"):
        Cases(PAIRS, "superb")


def test_springs_and_forces_are_kept(tmp_path):
    pairs = [(Scene(1.0, spring=2.0), RAMP), (Scene(1.0), ForceProtocol([0.0, 1.0, 2.0], [0.0, -2.0, 3.0]))]
    run_here(Cases(pairs, "draft"), tmp_path / "cases.h5")
    behind, pushed = load_cases(tmp_path / "cases.h5")
    assert [(case.scene, case.protocol) for case in (behind, pushed)] == pairs
    for case in (behind, pushed):
        again = bem.simulate(case.scene, case.protocol, "draft")
        same(case.trajectory, replace(again, stats=case.trajectory.stats))
    assert behind.trajectory.spring == 2.0
    np.testing.assert_allclose(behind.trajectory.stage, RAMP.history(1.0).indentation_at(behind.trajectory.time))
    assert pushed.trajectory.by_force
    assert pushed.trajectory.detached


def test_description_names_law_and_spring():
    laws = (bem.LennardJones(), bem.ConstantStress(), bem.ConstantStress(width=0.2), bem.Exponential())
    scenes = [Scene(1.0, adhesion=law) for law in laws] + [Scene(1.0, spring=2.0)]
    assert described(scenes[0])["adhesion"] == {"type": "LennardJones"}  # as before there were others
    assert "spring" not in described(scenes[0])  # as before there were springs
    assert [restored(described(scene)) for scene in scenes] == scenes
    assert len({Cases([(scene, RAMP)]).identity()["cases"] for scene in scenes}) == len(scenes)


def test_older_file_lacks_attempt_counts():
    stats = Statistics(**with_nan(Statistics, {"steps": 3}))
    assert (stats.steps, stats.attempts, stats.failed_attempts) == (3, 1, 0)
    assert (stats.method, stats.left_out, stats.steps_by_phase) == ("boundary elements", (), {})
    assert np.isnan(stats.nodes)


def test_files_that_say_rung_are_read():
    trajectory = bem.simulate(Scene(1.0), RAMP, "draft")
    arrays = {f"native/{name}": getattr(trajectory, name) for name in ARRAYS}
    former = outcome_text(trajectory).replace('"method"', '"rung"')
    again = restored_trajectory(arrays | {"outcome": former})
    assert again.stats.method == trajectory.stats.method == "elastic branch"
