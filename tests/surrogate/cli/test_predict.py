"""`surrogate predict` from its options and files to what it prints, draws and writes, beside the solver too."""

import csv
import dataclasses
import errno
import json
import re
from pathlib import Path

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol, PiecewiseLinearProtocol, simulate
from bem.results.plots import COLOURS
from surrogate import ExtrapolationWarning
from surrogate.cli.comparison import plot_predictions, solver_errors
from surrogate.files import PUBLISHED
from surrogate.trajectory import INTERVALS, predicted_trajectories
from tests.bem.results.test_trajectory import trajectory_of
from tests.surrogate.conftest import FLAGS, PROTOCOL, SCENE, refused, scenes

LOADING = LoadingProtocol(**PROTOCOL)
ONE = ("--tabor", 1.0, *FLAGS)


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_protocol_of_options(command, published):
    code, out, err = command("predict", "M1-concat", *ONE)
    assert (code, err) == (0, "")
    expected = surrogate.load("M1-concat", published).predict(SCENE, LOADING)
    rows = dict(re.findall(r"^(.*?)  +(\S+)  +[a-z]", out, flags=re.MULTILINE))
    assert rows["pull-off force"] == f"{expected.pull_off_force:.5g}"
    assert rows["pull-off time"] == f"{expected.pull_off_time:.5g}"


def test_default_is_the_first_sample(program):
    (found,) = json.loads(program("predict", "fast", "--json", "--check")[1])
    assert found["time"][-1] == pytest.approx((5.0 + np.pi ** (2 / 3)) * (1 / 10 + 1 / 200) + 1.0)
    assert found["check"]["pull_off_percent"] < 1.0
    code, out, err = program("predict", "fast", "--loading-rate", "3")
    assert (code, out) == (2, "")
    assert "received no --peak-indentation, --dwell-time, --unloading-rate" in err
    code, out, err = program("predict", "fast", "--steps")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("surrogate: --steps must go with --out FILE.csv")


@pytest.mark.parametrize(("words", "ratio"), [((), 0.1), (("--modulus-ratio", 0.3), 0.3)])
def test_interval_and_band_equal_pythons(program, words, ratio):
    code, out, err = program("predict", "fast", *ONE, *words)
    assert (code, err) == (0, "")
    found = surrogate.load("fast").predict(scenes([1.0], ratio)[0], LOADING)
    low, high = found.pull_off_interval
    assert "90 % interval" in out
    assert re.search(
        rf"^pull-off force +{found.pull_off_force:.5g} +{low:.5g} to {high:.5g} +pi R dgamma$", out, re.MULTILINE
    )
    largest = 0.5 * (found.force_upper - found.force_lower).max()
    assert f"median, {largest:.3g} at most; --out and --json give it" in out


def test_files_in_and_out(command, published, tmp_path):
    given = [PROTOCOL | {"tabor": 1.0}, PROTOCOL | {"tabor": 2.0, "dwell_time": 0.1}]
    (tmp_path / "in.json").write_text(json.dumps(given))
    lines = [given[0], *(one.values() for one in given)]
    (tmp_path / "in.csv").write_text("".join(",".join(map(str, line)) + "\n" for line in lines))
    for kind in ("csv", "json"):
        words = ["--in", tmp_path / f"in.{kind}", "--out", tmp_path / f"out.{kind}", "--plot", tmp_path / f"{kind}.png"]
        code, out, _ = command("predict", "M1-concat", *words, "--steps")
        assert (code, out) == (0, f"2 trajectories are predicted\nWritten: {words[3]}, {words[5]}\n")
        assert (tmp_path / f"{kind}.png").stat().st_size > 10_000
    expected = surrogate.load("M1-concat", published).predict(
        scenes([1.0, 2.0]), [LoadingProtocol(**{key: row[key] for key in PROTOCOL}) for row in given]
    )
    before = (tmp_path / "in.csv").read_bytes()
    code, _, error = command("predict", "M1-concat", "--in", tmp_path / "in.csv", "--out", tmp_path / "in.csv")
    assert (code, "--out must be another file than --in" in error) == (2, True)
    assert (tmp_path / "in.csv").read_bytes() == before
    for one, two in zip(json.loads((tmp_path / "out.json").read_text()), expected, strict=True):
        assert (one["force"], one["hysteresis"], one["extrapolated"]) == (two.force.tolist(), two.hysteresis, [])
    table = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[120:, 3], expected[1].force, rtol=1e-9)
    assert (tmp_path / "out.csv").read_text().startswith("trajectory,time,indentation,force\n")


def test_solids_and_bands_in_files(program, tmp_path):
    given = [PROTOCOL | {"tabor": 1.0, "modulus_ratio": 0.1}, PROTOCOL | {"tabor": 2.0, "modulus_ratio": 0.7}]
    (tmp_path / "in.json").write_text(json.dumps(given))
    for kind in ("csv", "json"):
        words = ["--in", tmp_path / "in.json", "--coverage", 0.5, "--out", tmp_path / f"out.{kind}"]
        assert program("predict", "fast", *words, "--steps", "--plot", tmp_path / "p.png")[0] == 0
    expected = surrogate.load("fast").predict(scenes([1.0, 2.0], [0.1, 0.7]), LOADING, coverage=0.5)
    for one, two in zip(json.loads((tmp_path / "out.json").read_text()), expected, strict=True):
        assert one["pull_off_interval"] == list(two.pull_off_interval)
        assert one["coverage"] == 0.5
        assert (one["force_lower"], one["force_upper"]) == (two.force_lower.tolist(), two.force_upper.tolist())
    for name in ("force", "force_lower", "force_upper"):
        wanted = np.concatenate([getattr(one, name) for one in expected])
        np.testing.assert_array_equal([float(row[name]) for row in rows(tmp_path / "out.csv")], wanted)


def test_table_has_a_row_for_each_solid(program, tmp_path):
    ratios = [0.009, 0.1, 0.0095, 0.7]
    (tmp_path / "in.json").write_text(json.dumps([PROTOCOL | {"tabor": 1.0, "modulus_ratio": one} for one in ratios]))
    words = ["--in", tmp_path / "in.json", "--out", tmp_path / "table.csv"]
    code, out, err = program("predict", "fast", *words, "--check")
    assert (code, out.count("\n"), err.count("\n")) == (0, 2, 1)
    assert "2 of 4 trajectories extrapolate; trajectory 0 extrapolates: modulus_ratio 0.009, outside 0.01 to 1" in err
    table = rows(tmp_path / "table.csv")
    assert [float(row["modulus_ratio"]) for row in table] == ratios
    assert [bool(row["extrapolated"]) for row in table] == [True, False, True, False]
    for row, one in zip(table[1::2], surrogate.load("fast").predict(scenes(1.0, [0.1, 0.7]), LOADING), strict=True):
        assert float(row["pull_off_force"]) == pytest.approx(one.pull_off_force, rel=1e-6)
        for name in INTERVALS:
            ends = [float(row[name.replace("interval", end)]) for end in ("lower", "upper")]
            assert ends == pytest.approx(getattr(one, name), rel=1e-6)
        assert float(row["check_pull_off_percent"]) < 20.0
    assert table[0]["pull_off_lower"] == table[0]["hysteresis_upper"] == ""


def test_each_extrapolation_warns_once(command):
    code, out, err = command("predict", "M1-concat", "--tabor", 3.4, *FLAGS)
    assert (code, err.count("\n")) == (0, 1)
    assert "\npull-off force" in out
    assert "extrapolates: tabor = 3.4 lies outside [" in err
    assert "; compare with the solver before you trust" in err


def test_no_band_outside_the_training(program, tmp_path, recwarn):
    code, out, err = program("predict", "accurate", *ONE, "--modulus-ratio", 0.009, "--out", tmp_path / "out.csv")
    assert (code, err.count("\n")) == (0, 1)
    assert "trajectory 0 extrapolates: modulus_ratio 0.009, outside 0.01 to 1" in err
    assert "interval" not in out
    assert "no band: outside the training of accurate" in out
    assert not [one for one in recwarn if issubclass(one.category, ExtrapolationWarning)]
    assert {(row["force_lower"], row["force_upper"]) for row in rows(tmp_path / "out.csv")} == {("", "")}


@pytest.mark.parametrize("name", ["fast", "accurate", "M1-concat"])
def test_far_outside_exits_with_1(name, program, tmp_path):
    words = ["--tabor", 9, *FLAGS, "--out", tmp_path / "out.csv"]
    code, out, err = program("predict", name, *words)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert re.search(r"received (tabor )?9\b", err)
    assert not (tmp_path / "out.csv").exists()


def test_a_table_keeps_what_is_not_refused(program, tmp_path):
    (tmp_path / "in.json").write_text(json.dumps([PROTOCOL | {"tabor": tabor} for tabor in (1.0, 9.0, 3.4)]))
    words = ["--in", tmp_path / "in.json", "--out", tmp_path / "out.csv", "--plot", tmp_path / "out.png"]
    code, out, err = program("predict", "fast", *words)
    assert (code, err.count("\n")) == (1, 2)
    assert "warning: 1 of 3 trajectories are NaN; 1: the contact must be like those of the training" in err
    assert "1 of 3 trajectories extrapolate; trajectory 2 extrapolates: tabor 3.4, outside 0.2 to 3.2" in err
    assert out.startswith("2 trajectories are predicted")
    table = rows(tmp_path / "out.csv")
    assert [row["pull_off_force"] != "" for row in table] == [True, False, True]
    assert table[1]["hysteresis"] == table[1]["pull_off_lower"] == ""
    assert "received tabor 9, outside 0.2 to 3.2" in table[1]["status"]


def test_check_reports_the_solver_s_answer(command, tmp_path):
    words = [*ONE, "--check", "--out", tmp_path / "out.json", "--plot", tmp_path / "both.svg"]
    code, out, _ = command("predict", "M1-concat", *words)
    assert code == 0
    assert "against the solver: pull-off force off by" in out
    (found,) = json.loads((tmp_path / "out.json").read_text())
    assert found["check"]["pull_off_percent"] > 0.0
    assert 0.0 < found["check"]["force_rms"] < 2.0
    assert "stroke-dasharray" in (tmp_path / "both.svg").read_text()  # the solver's curve


def test_the_check_is_of_the_same_solid(program):
    (found,) = json.loads(program("predict", "fast", *ONE, "--modulus-ratio", 0.3, "--check", "--json")[1])
    assert (found["check"]["modulus_ratio"], found["check"]["model_modulus_ratio"]) == (0.3, None)
    assert found["check"]["pull_off_percent"] < 5.0


@pytest.mark.parametrize("ratio", [[], ["--modulus-ratio", 0.1], ["--modulus-ratio", 0.5]])
def test_check_of_another_material_says_so(ratio, command):
    place = PUBLISHED / "M1-concat"
    code, out, err = command("predict", place, "--tabor", 1.0, *FLAGS, "--check", *ratio)
    assert code == 0
    other = ratio[-1:] == [0.5]
    assert ("against the solver of another material (modulus ratio 0.5): pull-off" in out) == other
    assert err.startswith("warning: M1-concat was trained on the modulus ratio 0.1 only;") == other
    assert err.count("\n") == other
    code, out, err = command("predict", place, "--tabor", 1.0, *FLAGS, *ratio)
    assert code == (2 if other else 0)
    if other:
        assert err.startswith("surrogate: --modulus-ratio must be 0.1, on which M1-concat was trained, or --check")
    else:
        assert err == ""


def test_check_of_unrecorded_material_warns(command, monkeypatch):
    monkeypatch.setattr("surrogate.model.Surrogate.modulus_ratio", None)
    words = ["predict", "M1-concat", "--tabor", 1.0, *FLAGS, "--check"]
    _, _, err = command(*words)
    assert err.startswith("warning: M1-concat does not record the modulus ratio it was trained on; the solver uses 0.1")
    assert "does not record" not in command(*words, "--modulus-ratio", 0.3)[2]


def test_an_unfinished_check_is_reported(command, tmp_path, monkeypatch):
    def stopped(scene, protocol):
        whole = simulate(scene, protocol, "draft")
        names = ("time", "indentation", "force", "contact_radius", "unloading")
        first = {name: getattr(whole, name)[: whole.time.size // 2] for name in names}
        return dataclasses.replace(whole, status="it stopped half-way", jumps=(), **first)

    monkeypatch.setattr("bem.simulate", stopped)
    for kind in ("csv", "json"):
        code, out, _ = command("predict", "M1-concat", *ONE, "--check", "--out", tmp_path / f"out.{kind}")
        assert code == 0
        assert "it did not finish: it stopped half-way" in out
        assert "nan" not in out
    (found,) = json.loads((tmp_path / "out.json").read_text())
    assert found["check"]["solver_status"] == "it stopped half-way"
    assert found["check"]["hysteresis_percent"] is None
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert lines[0] == "trajectory,time,indentation,force,solver_force"
    assert float(lines[1].split(",")[-1]) == found["solver_force"][0]
    assert lines[-1].endswith(",")


def test_full_disk_leaves_neither_file(command, tmp_path, monkeypatch):
    def fail(path, *_):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("surrogate.cli.comparison.plot_predictions", fail)
    (tmp_path / "out.json").write_text("before")
    places = ["--out", tmp_path / "out.json", "--plot", tmp_path / "p.png"]
    error = refused(command, ["predict", "M1-concat", *ONE, *places], folder=tmp_path)
    assert f"{tmp_path / 'p.png'} (No space left on device)" in error


def test_last_unloading_is_compared():
    # The first is pulled off faster, and so holds on more strongly; the second goes deeper.
    instants, depths = np.array([0.0, 1.0, 1.1, 2.1, 12.1]), np.array([-3.0, 5.0, -3.0, 6.0, -3.0])
    simulated = simulate(SCENE, PiecewiseLinearProtocol(instants, depths), "draft")
    times = np.unique(np.concatenate([instants, np.linspace(0.0, 12.1, 2000)]))
    history = np.array([times, np.interp(times, instants, depths), simulated.at(times)])[:, np.newaxis]
    (predicted,) = predicted_trajectories(*history, unloading_from=int(np.searchsorted(times, 2.1)), seconds=0.0)
    assert simulated.pull_off_force > 1.5 * predicted.pull_off_force
    assert solver_errors(predicted, simulated)["pull_off_percent"] < 1.0
    status, *errors = solver_errors(predicted, dataclasses.replace(simulated, status="stopped")).values()
    assert status == "stopped"
    assert np.isnan(errors).all()


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are saved."""
    figures = []
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, *_, **__: figures.append(self))
    return figures


def test_solver_differs_from_predictions(drawn):
    time = np.linspace(0.0, 1.0, 5)
    found = predicted_trajectories(*np.tile(time, (3, 3, 1)), unloading_from=2, seconds=0.0, model="M1-concat")
    plot_predictions(Path("a.png"), found, [trajectory_of(time, time, time)] * 3)
    for axes in drawn[0].axes:
        predicted, solver = axes.lines[1::2], axes.lines[2::2]
        assert len(solver) == len(predicted) == len({line.get_color() for line in predicted}) == 3
        assert {line.get_color() for line in solver} == {COLOURS["solver"]}
        assert predicted[0].get_color() == COLOURS["M1"]
        assert {line.get_linestyle() for line in solver} == {"--"}
        assert solver[0].get_linewidth() < predicted[0].get_linewidth()


def test_phases_have_the_solvers_widths(drawn):
    # A pull-off a thousand times as slow as the loading.
    ramp = {"peak_indentation": 5.0, "loading_rate": 10.0, "dwell_time": 1.0}
    simulated = [simulate(SCENE, LoadingProtocol(**ramp, unloading_rate=rate), "draft") for rate in (0.01, 0.02)]
    kept = {"unloading_from": 0, "model": "fast", "seconds": 0.0}
    histories = [np.array([one.time, one.indentation, one.force])[:, np.newaxis] for one in simulated]
    predicted = [predicted_trajectories(*history, **kept)[0] for history in histories]
    plot_predictions(Path("a.png"), predicted[:1], simulated[:1])
    plot_predictions(Path("b.png"), predicted, simulated)
    one, several = (figure.axes[0] for figure in drawn)
    expected = simulated[0].plot().axes[0]
    ticks, wanted = ([(*text.get_position(), text.get_text()) for text in a.get_xticklabels()] for a in (one, expected))
    assert (ticks, one.get_xlabel()) == (wanted, expected.get_xlabel())
    for line in one.lines[1:3]:
        assert line.get_xdata()[[0, -1]].tolist() == [0.0, 1.0]
        assert line.get_xdata()[line.get_ydata().argmin()] > 0.1
    assert [text.get_text().split()[0] for text in one.texts] == ["pull-off"]
    # Protocols of different phases share plain time.
    assert several.lines[3].get_xdata()[-1] == pytest.approx(simulated[1].time[-1] / simulated[0].time[-1])
    assert not several.texts
    assert "scale" not in several.get_xlabel()
