"""`surrogate predict` from its options and files to what it prints, writes and refuses to leave behind."""

import csv
import dataclasses
import errno
import json
import warnings

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from surrogate.prediction.predictor import Surrogate
from tests.surrogate.conftest import scenes
from tests.surrogate.prediction.predicting import FLAGS, PROTOCOL, SCENE, refused


def test_a_protocol_of_options(command, published):
    code, out, err = command("predict", "M1-concat", "--tabor", 1.0, *FLAGS)
    assert (code, err) == (0, "")
    expected = surrogate.load("M1-concat", published).predict(SCENE, LoadingProtocol(**PROTOCOL))
    assert f"pull-off force {expected.pull_off_force:.5g} at time {expected.pull_off_time:.5g}" in out


def test_files_in_and_out(command, published, tmp_path):
    rows = [PROTOCOL | {"tabor": 1.0}, PROTOCOL | {"tabor": 2.0, "dwell_time": 0.1}]
    (tmp_path / "in.json").write_text(json.dumps(rows))
    with (tmp_path / "in.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    for kind in ("csv", "json"):
        words = ["--in", tmp_path / f"in.{kind}", "--out", tmp_path / f"out.{kind}", "--plot", tmp_path / f"{kind}.png"]
        code, out, _ = command("predict", "M1-concat", *words, "--steps")
        assert (code, out) == (0, f"2 trajectories are predicted; {tmp_path / f'out.{kind}'} holds them\n")
        assert (tmp_path / f"{kind}.png").stat().st_size > 10_000
    found = json.loads((tmp_path / "out.json").read_text())
    expected = surrogate.load("M1-concat", published).predict(
        scenes([1.0, 2.0]), [LoadingProtocol(**{key: row[key] for key in PROTOCOL}) for row in rows]
    )
    for one, two in zip(found, expected, strict=True):
        assert one["force"] == two.force.tolist()
        assert one["hysteresis"] == two.hysteresis
        assert one["extrapolated"] == []
    table = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[120:, 3], expected[1].force, rtol=1e-9)
    assert (tmp_path / "out.csv").read_text().startswith("trajectory,time,indentation,force\n")

    # A history predicts as its protocol does.
    points = zip(expected[0].time.tolist(), expected[0].indentation.tolist(), strict=True)
    history = "\n".join(f"{time!r},{depth!r}" for time, depth in points)
    (tmp_path / "history.csv").write_text(f"time,indentation\n{history}\n")
    code, out, err = command("predict", "M1-concat", "--in", tmp_path / "history.csv", "--tabor", 1.0, "--json")
    assert (code, err) == (0, "")
    (found,) = json.loads(out)
    assert found["pull_off_force"] == pytest.approx(expected[0].pull_off_force, rel=1e-5)


def test_check_reports_the_solver_s_answer(command, tmp_path):
    words = ["--tabor", 1.0, *FLAGS, "--check", "--out", tmp_path / "out.json", "--plot", tmp_path / "both.svg"]
    code, out, _ = command("predict", "M1-concat", *words)
    assert code == 0
    assert "against the solver: pull-off force off by" in out
    (found,) = json.loads((tmp_path / "out.json").read_text())
    assert found["check"]["pull_off_percent"] > 0.0
    assert 0.0 < found["check"]["force_rms"] < 2.0
    assert "stroke-dasharray" in (tmp_path / "both.svg").read_text()  # the solver's curve


def test_extrapolation_warns_once_per_trajectory(command):
    code, out, err = command("predict", "M1-concat", "--tabor", 30.0, *FLAGS)
    assert code == 0
    assert "trajectory 0: pull-off" in out
    assert err.count("\n") == 1
    assert "extrapolates: tabor = 30 lies outside [" in err
    assert "; compare with the solver before you trust" in err


def test_a_history_that_extrapolates_says_so_and_other_warnings_pass(command, tmp_path, monkeypatch):
    (tmp_path / "in.csv").write_text("time,indentation\n0,-2\n1,5\n2,2\n3,5\n4,-2\n")
    # A stray warning of a library is not about the range.
    predict = Surrogate.predict_history

    def warn(*arguments, **options):
        warnings.warn("of a library", UserWarning, stacklevel=2)
        return predict(*arguments, **options)

    monkeypatch.setattr(Surrogate, "predict_history", warn)
    with pytest.warns(UserWarning, match="of a library"):
        code, out, _ = command("predict", "M1-concat", "--in", tmp_path / "in.csv", "--tabor", 1.0, "--json")
    assert code == 0
    (found,) = json.loads(out)
    assert any(words.startswith("loading_points = 2 lies outside [42, 58]") for words in found["extrapolated"])
    assert not any("library" in words for words in found["extrapolated"])


def test_an_unfinished_check_is_reported(command, tmp_path, monkeypatch):
    from bem import simulate

    def stopped(scene, protocol):
        whole = simulate(scene, protocol, "draft")
        names = ("time", "indentation", "force", "contact_radius", "unloading")
        first = {name: getattr(whole, name)[: whole.time.size // 2] for name in names}
        return dataclasses.replace(whole, status="it stopped half-way", jumps=(), **first)

    monkeypatch.setattr("bem.simulate", stopped)
    for kind in ("csv", "json"):
        words = ["predict", "M1-concat", "--tabor", 1.0, *FLAGS, "--check", "--out", tmp_path / f"out.{kind}"]
        code, out, _ = command(*words)
        assert code == 0
        assert "it did not finish: it stopped half-way" in out
        assert "nan" not in out
    (found,) = json.loads((tmp_path / "out.json").read_text())
    assert found["check"]["solver_status"] == "it stopped half-way"
    assert found["check"]["hysteresis_percent"] is None
    rows = (tmp_path / "out.csv").read_text().splitlines()
    assert rows[0] == "trajectory,time,indentation,force,solver_force"
    assert float(rows[1].split(",")[-1]) == found["solver_force"][0]
    assert rows[-1].endswith(",")
    assert command("predict", "M1-concat", "--in", tmp_path / "out.csv", "--tabor", 1.0)[0] == 0


def test_a_full_disk_leaves_neither_of_two_files(command, tmp_path, monkeypatch):
    def fail(path, *_):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("surrogate.cli.comparison.plot_predictions", fail)
    (tmp_path / "out.json").write_text("before")
    places = ["--out", tmp_path / "out.json", "--plot", tmp_path / "p.png"]
    error = refused(command, ["predict", "M1-concat", "--tabor", 1.0, *FLAGS, *places], folder=tmp_path)
    assert f"{tmp_path / 'p.png'} (No space left on device)" in error
