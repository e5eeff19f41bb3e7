import csv
import json
import re
import warnings

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from surrogate import cli
from surrogate.files import whole_file
from surrogate.recipe import Recipe
from surrogate.runs import Run, execute, publish

PROTOCOL = {"peak_indentation": 20.0, "loading_rate": 10.0, "dwell_time": 1.0, "unloading_rate": 10.0}
FLAGS = [word for key, value in PROTOCOL.items() for word in (f"--{key.replace('_', '-')}", str(value))]


@pytest.fixture(scope="module")
def models(dataset, tmp_path_factory):
    """A published model of a few weights."""
    patch = pytest.MonkeyPatch()
    import keras

    from surrogate.architectures import common
    from surrogate.layers import AppendTabor

    def build(name, features="D"):
        sequence, tabor = common.inputs(features)
        hidden = keras.layers.LSTM(4, return_sequences=True, name="lstm")(AppendTabor(name="append")(sequence, tabor))
        return keras.Model([sequence, tabor], keras.layers.Dense(1, name="force")(hidden), name=name)

    for module in ("surrogate.runs", "surrogate.backends"):
        patch.setattr(f"{module}.build", build)
    folder = tmp_path_factory.mktemp("models")
    run = Run("M1-concat", dataset, dataset.split(), Recipe.load("swift").with_overrides(epochs=1))
    execute(run, folder / "run")
    publish(folder / "run", folder / "M1-concat")
    yield folder
    patch.undo()


@pytest.fixture
def command(models, monkeypatch, capsys):
    def run(*words):
        monkeypatch.setattr("sys.argv", ["surrogate", *map(str, words), "--models", str(models)])
        with pytest.raises(SystemExit) as end:
            cli.app_main()
        result = capsys.readouterr()
        return end.value.code or 0, result.out, result.err

    return run


def refused(command, words, *, folder):
    """The one sentence a mistake ends in; nothing may be left behind."""
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    code, out, err = command(*words)
    assert (code, out) == (2, ""), err
    assert err.startswith("surrogate: Expected ")
    assert err.count("\n") == 1
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    return err


def test_a_protocol_of_options(command, models):
    code, out, err = command("predict", "M1-concat", "--tabor", 1.0, *FLAGS)
    assert (code, err) == (0, "")
    expected = surrogate.load("M1-concat", models).trajectories(LoadingProtocol(**PROTOCOL), tabor=1.0)[0]
    assert f"pull-off force {expected.pull_off_force:.5g} at time {expected.pull_off_time:.5g}" in out


def test_files_in_and_out(command, models, tmp_path):
    rows = [PROTOCOL | {"tabor": 1.0}, PROTOCOL | {"tabor": 2.0, "dwell_time": 0.1}]
    (tmp_path / "in.json").write_text(json.dumps(rows))
    with (tmp_path / "in.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    for kind in ("csv", "json"):
        words = ["--in", tmp_path / f"in.{kind}", "--out", tmp_path / f"out.{kind}", "--plot", tmp_path / f"{kind}.png"]
        assert command("predict", "M1-concat", *words)[0] == 0
        assert (tmp_path / f"{kind}.png").stat().st_size > 10_000
    found = json.loads((tmp_path / "out.json").read_text())
    expected = surrogate.load("M1-concat", models).trajectories(
        [LoadingProtocol(**{key: row[key] for key in PROTOCOL}) for row in rows], tabor=[1.0, 2.0]
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
    assert "solver" in (tmp_path / "both.svg").read_text() or (tmp_path / "both.svg").stat().st_size > 10_000


def test_extrapolation_is_said_once_per_trajectory(command):
    code, out, err = command("predict", "M1-concat", "--tabor", 30.0, *FLAGS)
    assert code == 0
    assert "trajectory 0: pull-off" in out
    assert err.count("\n") == 1
    assert "extrapolates: tabor = 30 lies outside [" in err


HEADER = "tabor,peak_indentation,loading_rate,dwell_time,unloading_rate\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "which is empty"),
        (HEADER, "at least one row"),
        (HEADER + "1,2,3\n", "5 values in every row. Received: 3 in row 1"),
        (HEADER + "1,20,10,1,ten\n", "finite numbers. Received: 'ten' as unloading_rate in row 1"),
        (HEADER + "1,20,10,1,nan\n", "'nan' as unloading_rate"),
        (HEADER + "-1,20,10,1,10\n", "Tabor parameters above zero"),
        ("tabor,depth\n1,2\n", "the columns tabor, peak_indentation.*Received: depth, tabor in"),
        ("tabor,tabor\n1,2\n", "every column once"),
        (HEADER + '"1,20,10,1,10\n', "comma-separated numbers under a header"),
    ],
)
def test_malformed_protocols(command, tmp_path, text, words):
    (tmp_path / "in.csv").write_text(text)
    kept = tmp_path / "out.csv"
    kept.write_text("what was there before")
    error = refused(command, ["predict", "M1-concat", "--in", tmp_path / "in.csv", "--out", kept], folder=tmp_path)
    assert re.search(words, error)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time,indentation\n0,1\n1,2\n1,3\n", "times that increase strictly. Received: .*1.0"),
        ("time,indentation\n0,1\n2,2\n1,3\n", "times that increase strictly"),
        ("time,indentation,force\n0,1,2\n", "the columns"),
        ("time,indentation,edge\n0,1,\n", "finite numbers. Received: '' as edge in row 1"),
    ],
)
def test_malformed_histories(command, tmp_path, text, words):
    (tmp_path / "in.csv").write_text(text)
    words_in = ["predict", "M1-concat", "--in", tmp_path / "in.csv", "--tabor", 1.0, "--out", tmp_path / "out.json"]
    assert re.search(words, refused(command, words_in, folder=tmp_path))


def test_other_mistakes(command, tmp_path, models):
    (tmp_path / "in.json").write_text("[1, 2")
    (tmp_path / "list.json").write_text("[1, 2]")
    (tmp_path / "uneven.json").write_text('{"time": [0, 1], "indentation": [0]}')
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x80")
    (tmp_path / "good.csv").write_text(HEADER + "1,20,10,1,10\n")
    (tmp_path / "history.csv").write_text("time,indentation\n0,1\n1,2\n")
    (tmp_path / "foreign.onnx").write_text("not a graph")
    whole = ["M1-concat", "--tabor", 1.0, *FLAGS]
    for words, expected in (
        (["M1-concat", "--in", tmp_path / "in.json"], "Expected JSON"),
        (["M1-concat", "--in", tmp_path / "list.json"], "a JSON list of protocols"),
        (["M1-concat", "--in", tmp_path / "uneven.json", "--tabor", 1], "lists of equal length"),
        (["M1-concat", "--in", tmp_path / "binary.csv"], "text in UTF-8"),
        (["M1-concat", "--in", tmp_path / "absent.csv"], "which does not exist"),
        (["M1-concat", "--in", tmp_path / "in.xlsx"], "called .csv or .json"),
        (["M1-concat", "--in", tmp_path / "good.csv", "--tabor", 1], "not both"),
        (["M1-concat", "--in", tmp_path / "history.csv"], "no --tabor"),
        (["M1-concat", "--tabor", 1], "Missing: --peak-indentation, --loading-rate"),
        ([*whole, "--out", tmp_path / "out.txt"], "called .csv or .json"),
        ([*whole, "--out", tmp_path / "none" / "out.csv"], "a directory that exists"),
        ([*whole, "--plot", tmp_path / "p.bmp"], "called .png or"),
        ([*whole, "--backend", "torch"], "backend='torch'"),
        ([tmp_path / "foreign.onnx", *whole[1:]], "foreign.onnx, unreadable"),
    ):
        assert expected in refused(command, ["predict", *words], folder=tmp_path)
    assert "format onnx" in refused(command, ["export", "M1-concat", "--format", "tflite"], folder=tmp_path)


def test_export_writes_beside_the_weights_and_a_copy(command, models, tmp_path):
    before = (models / "M1-concat" / "model.onnx").read_bytes()
    (models / "M1-concat" / "model.onnx").unlink()
    code, out, _ = command("export", "M1-concat", "--out", tmp_path / "copy.onnx")
    assert (code, "model.onnx" in out) == (0, True)
    assert (models / "M1-concat" / "model.onnx").read_bytes() == before == (tmp_path / "copy.onnx").read_bytes()


def test_a_file_is_whole_or_not_there(tmp_path):
    def fail(path):
        with whole_file(path) as part:
            part.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail(tmp_path / "out.csv")
    assert list(tmp_path.iterdir()) == []


def test_trajectories_resemble_the_solver_s(models):
    model = surrogate.load("M1-concat", models)
    protocols = [LoadingProtocol(**PROTOCOL), LoadingProtocol(**PROTOCOL | {"dwell_time": 0.0})]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with_dwell, without = model.trajectories(protocols, tabor=1.0)
    assert with_dwell.extrapolated == ()
    assert without.extrapolated[0].startswith("dwell_time = 0 lies outside [")
    assert (with_dwell.time.size, without.time.size) == (120, 100)
    assert with_dwell.completed
    assert with_dwell.pull_off_force == with_dwell.force[69:].max()
    assert with_dwell.pull_off_time == with_dwell.time[69 + with_dwell.force[69:].argmax()]
    assert with_dwell.max_compression == with_dwell.force.min()
    loop = np.trapezoid(with_dwell.force, with_dwell.indentation)
    assert with_dwell.hysteresis == pytest.approx(abs(loop), rel=0.05)
    middle = with_dwell.at(0.5 * (with_dwell.time[3] + with_dwell.time[4]))
    assert min(with_dwell.force[3:5]) <= middle <= max(with_dwell.force[3:5])
    expected = model.predict(with_dwell.time[None], with_dwell.indentation[None], tabor=1.0)[0]
    np.testing.assert_allclose(with_dwell.force, expected, rtol=1e-6, atol=1e-6)
    moved = model.trajectories(LoadingProtocol(**PROTOCOL, start_indentation=-4.0), tabor=1.0)[0]
    assert "start_indentation = -4" in moved.extrapolated[0]
    with pytest.raises(ValueError, match="Expected LoadingProtocols"):
        model.trajectories([None], tabor=1.0)
    with pytest.raises(ValueError, match="one Tabor parameter per history"):
        model.trajectories(protocols, tabor=[1.0, 2.0, 3.0])
    assert model.trajectories([], tabor=1.0) == []
