import numpy as np
import pytest

from bem.dataset.campaign import Campaign
from bem.dataset.file import load_dataset
from bem.dataset.records import untabulate
from bem.dataset.verification import JUDGED, differences, identical, verify
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import altered, command, put

ALLOWED = 8e-3


pytestmark = pytest.mark.usefixtures("in_this_process")


def scaled(record, name, factor):
    return record | {name: record[name] * factor}


@pytest.fixture
def first(undisturbed):
    """The record of the first trajectory that jumps, and its indentation at the steps."""
    dataset = load_dataset(undisturbed, native=True)
    records = untabulate(dataset.columns, Campaign.of(dataset.attributes["campaign"]).layout)
    row = int(dataset.scalars["jump_count"].argmax())
    return records[row], dataset.grid()[1][row]


def judged(path, **more):
    return verify(path, sample=120, solver=stand_in.solve, **more)


def test_a_sample_is_computed_again(undisturbed):
    seen = []
    check = verify(undisturbed, sample=10, seed=0, solver=stand_in.solve, progress=lambda *counts: seen.append(counts))
    assert check.agrees
    assert (len(check.indices), check.identical.sum(), check.allowed) == (10, 10, ALLOWED)
    assert set(check.indices.tolist()) <= set(range(120))
    assert {name: values.max() for name, values in check.differences.items()} == dict.fromkeys(JUDGED, 0.0)
    assert (seen[0], seen[-1]) == ((0, 0, 10), (10, 0, 10))
    assert len(judged(undisturbed).indices) == 120


def test_stated_accuracy_decides(undisturbed, tmp_path):
    def spoil(file):
        file.attrs["campaign"] = file.attrs["campaign"].replace('"standard"', '"draft"')
        file.attrs["accuracy"] = "draft"
        file["fms/force"][16, 60] += 1e-3 * np.ptp(file["fms/force"][16])
        file["fms/force"][17, 60] += 0.1 * np.ptp(file["fms/force"][17])

    check = judged(altered(undisturbed, tmp_path, spoil))
    assert (check.disagreeing.tolist(), check.identical.sum(), check.allowed) == ([17], 118, 3.4e-2)
    assert check.differences["force history, mean"].max() < ALLOWED < check.differences["force history, any step"].max()


def test_results_are_judged_relatively(first):
    record, path = first
    for column, name in (("pull_off_force", "pull-off force"), ("hysteresis", "hysteresis")):
        for error in (0.9 * ALLOWED, -1.1 * ALLOWED):
            apart = differences(record, scaled(record, f"scalars/{column}", 1.0 / (1.0 + error)), path)
            assert apart == {**dict.fromkeys(JUDGED, 0.0), name: pytest.approx(abs(error), rel=1e-9)}
    assert max(differences(record, scaled(record, "fms/force", 1.0 + 1e-4), path).values()) < ALLOWED
    shifted = record | {"fms/force": np.append(record["fms/force"][1:], record["fms/force"][-1])}
    assert differences(record, shifted, path)["force history, mean"] > ALLOWED


def test_jump_may_fall_on_either_side(first):
    record, path = first
    late, early = record["fms/force"].copy(), record["fms/force"].copy()
    drop = 0.3 * np.ptp(record["fms/force"])
    early[50:] -= drop
    late[51:] -= drop
    errors = differences(record | {"fms/force": late}, record | {"fms/force": early}, path)
    assert errors["force history, any step"] < ALLOWED
    assert 0.0 < errors["force history, mean"] < ALLOWED


def test_nearly_closed_loop_uses_energy(first):
    record, path = first
    thin = [record | {"scalars/hysteresis": area} for area in (1e-9, 3e-9)]
    assert differences(*thin, path)["hysteresis"] < 1e-6


def test_completed_only_once_disagrees(undisturbed):
    check = verify(undisturbed, sample=120, solver=stand_in.sometimes_fails)
    tabor = load_dataset(undisturbed).protocols["tabor"]
    failing = np.flatnonzero((tabor > 3.0) | (tabor < 0.25))
    assert check.disagreeing.tolist() == failing.tolist()
    assert np.isinf(check.differences["hysteresis"]).sum() == len(failing)


def test_agreement_and_identity_of_columns(first):
    record, path = first
    assert len(record["jumps/time"]) == 1
    for name in record.keys() - {"index", "status"}:
        for replacement in ["because"] if name == "reason" else [record[name] + 1e6, 0 * record[name]]:
            changed = record | {name: replacement}
            assert identical(changed, record) == (name == "scalars/solver_seconds")
            agrees = max(differences(changed, record, path).values()) < ALLOWED
            assert agrees == (name not in ("fms/force", "scalars/pull_off_force", "scalars/hysteresis"))


def test_protocols_match_but_for_last_digits(undisturbed, tmp_path):
    def nudge(file):
        for name in ("dwell_time", "peak_indentation"):
            file[f"protocols/{name}"][...] = np.nextafter(file[f"protocols/{name}"][...], np.inf)

    assert judged(altered(undisturbed, tmp_path, nudge)).agrees
    with pytest.raises(ValueError, match="protocols must be those of the design"):
        judged(altered(undisturbed, tmp_path, put("protocols/tabor", 1.234, 3)))


def test_command_prints_its_verdict(undisturbed, tmp_path, monkeypatch):
    monkeypatch.setattr("bem.dataset.executors.warm_solver", lambda: stand_in.solve)
    good = command("verify", undisturbed, "--sample", 7)
    lines = good.stdout.splitlines()
    assert (good.exit_code, lines[0]) == (0, "7 trajectories computed again, 7 of them identical to the last bit")
    assert [line.split("  ")[0] for line in lines[2:6]] == list(JUDGED)
    assert lines[2].split()[-2:] == ["0.0e+00", "0.008"]
    assert lines[-1] == "PASS: all agree"
    bad = command("verify", altered(undisturbed, tmp_path, put("scalars/hysteresis", 99.0)), "--sample", 200)
    assert bad.exit_code == 1
    assert bad.stdout.splitlines()[-1].startswith("FAIL: 120 of 120 do not agree: 0, 1, 2, ")
    none = command("verify", undisturbed, "--sample", 0)
    assert (none.exit_code, "sample must be a whole number from 1" in none.stderr) == (2, True)
