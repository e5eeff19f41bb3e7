import csv
import dataclasses
import json
import re
import warnings

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from surrogate import cli
from surrogate.predictor import Surrogate
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
        (HEADER + "1,20,10,1,1_0\n", "finite numbers. Received: '1_0'"),
        (HEADER + "1,20,10,1,\u0661\n", "finite numbers"),
        (HEADER + "1,20,10,1,10\n\n \n1,20,0,1,10\n", r"in row 2 \(line 5\) of .*in.csv: loading_rate must be"),
        (HEADER + "1,20,10,1,10\n0,20,1,1,10\n", r"in row 2 \(line 3\) of .*in.csv: Expected finite Tabor"),
        (HEADER + "1,20,10,1,10\n1,20,1e-12,1e-9,10\n", r"in row 2 \(line 3\).*outlast the rounding"),
        ("1,20,10,1,10\n1,20,10,1,10\n", "a header that names the columns. Received: numbers in the first row"),
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
        ("time,indentation,depth\n0,1,2\n", "the columns"),
        ("time,indentation,edge\n0,1,\n", "finite numbers. Received: '' as edge in row 1"),
    ],
)
def test_malformed_histories(command, tmp_path, text, words):
    (tmp_path / "in.csv").write_text(text)
    words_in = ["predict", "M1-concat", "--in", tmp_path / "in.csv", "--tabor", 1.0, "--out", tmp_path / "out.json"]
    assert re.search(words, refused(command, words_in, folder=tmp_path))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000, "nested too deeply"),
        ('[{"tabor": 1, "tabor": 2}]', "'tabor' twice in one object"),
        (json.dumps([PROTOCOL | {"tabor": 10**400}]), "finite numbers. Received: 1000.*as tabor in row 1"),
        (json.dumps([PROTOCOL | {"tabor": 1.0}, PROTOCOL]), "the same names in every object.*in row 2 of"),
        ('[{"tabor": 1' + 5000 * "0" + "}]", "Expected JSON"),
        (json.dumps([PROTOCOL | {"tabor": [1]}]), "finite numbers"),
        (json.dumps([PROTOCOL | {"tabor": True}]), "finite numbers. Received: True"),
        ("null", "a JSON list of protocols"),
        ("[]", "a JSON list of protocols"),
    ],
)
def test_malformed_json(command, tmp_path, text, words):
    (tmp_path / "in.json").write_text(text)
    assert re.search(words, refused(command, ["predict", "M1-concat", "--in", tmp_path / "in.json"], folder=tmp_path))


@pytest.fixture
def written(command, tmp_path):
    """A CSV file of this command, and the forces in it."""
    words = ["predict", "M1-concat", "--tabor", 1.0, *FLAGS, "--out", tmp_path / "own.csv", "--json"]
    _, out, _ = command(*words)
    return tmp_path / "own.csv", json.loads(out)[0]


def test_the_files_it_writes_are_read_back(command, written, tmp_path):
    path, first = written
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    for column, name in enumerate(("time", "indentation", "force"), start=1):
        assert table[:, column].tolist() == first[name]
    code, out, err = command("predict", "M1-concat", "--in", path, "--tabor", 1.0, "--json")
    assert (code, err) == (0, "")
    np.testing.assert_allclose(json.loads(out)[0]["force"], first["force"], rtol=1e-12)

    # As the demonstrator writes it.
    header = "time,indentation,tabor,edge,phase,force,solver_force"
    rows = [
        f"{time!r},{depth!r},1,{int(number in (49, 69))},loading,{force!r},"
        for number, (time, depth, force) in enumerate(
            zip(first["time"], first["indentation"], first["force"], strict=True)
        )
    ]
    (tmp_path / "demo.csv").write_text("\n".join([header, *rows, ""]))
    code, out, err = command("predict", "M1-concat", "--in", tmp_path / "demo.csv", "--json")
    assert (code, err) == (0, "")
    np.testing.assert_allclose(json.loads(out)[0]["force"], first["force"], rtol=1e-12)
    content = {"time": first["time"], "indentation": first["indentation"], "tabor": 1.0}
    (tmp_path / "history.json").write_text(json.dumps(content))
    code, out, _ = command("predict", "M1-concat", "--in", tmp_path / "history.json", "--json")
    assert json.loads(out)[0]["pull_off_force"] == pytest.approx(first["pull_off_force"], rel=1e-12)


def test_histories_that_contradict_themselves(command, tmp_path):
    for text, options, words in (
        ("trajectory,time,indentation,force\n0,0,1,2\n1,1,2,2\n", ["--tabor", 1], "one trajectory"),
        ("time,indentation,tabor\n0,1,1\n1,2,2\n", [], r"the same Tabor parameter.*2.0 in row 2 \(line 3\)"),
        ("time,indentation,tabor\n0,1,1\n1,2,1\n", ["--tabor", 3], "Received: --tabor 3.0"),
        ("time,indentation,edge\n0,1,0\n1,2,0.5\n", ["--tabor", 1], r"zero or one. Received: 0.5 in row 2 \(line 3\)"),
    ):
        (tmp_path / "in.csv").write_text(text)
        assert re.search(
            words, refused(command, ["predict", "M1-concat", "--in", tmp_path / "in.csv", *options], folder=tmp_path)
        )


def test_a_history_that_extrapolates_says_so_and_other_warnings_pass(command, tmp_path, monkeypatch):
    (tmp_path / "in.csv").write_text("time,indentation\n0,-2\n1,5\n2,5\n3,-2\n")
    # A stray warning of a library is not about the range.
    predict = Surrogate.predict

    def warn(*arguments, **options):
        warnings.warn("of a library", UserWarning, stacklevel=2)
        return predict(*arguments, **options)

    monkeypatch.setattr(Surrogate, "predict", warn)
    with pytest.warns(UserWarning, match="of a library"):
        code, out, _ = command("predict", "M1-concat", "--in", tmp_path / "in.csv", "--tabor", 1.0, "--json")
    assert code == 0
    (found,) = json.loads(out)
    assert any(words.startswith("loading_points = 2 lies outside [42, 58]") for words in found["extrapolated"])
    assert not any("library" in words for words in found["extrapolated"])


def test_an_unfinished_check_is_said(command, tmp_path, monkeypatch):
    import surrogate.comparison

    def stopped(protocols, tabor, modulus_ratio):
        from bem import Scene, StandardLinearSolid, simulate

        whole = simulate(Scene(1.0, StandardLinearSolid(modulus_ratio=0.1)), protocols[0], "draft")
        names = ("time", "indentation", "force", "contact_radius", "unloading")
        first = {name: getattr(whole, name)[: whole.time.size // 2] for name in names}
        return [dataclasses.replace(whole, status="it stopped half-way", jumps=(), **first)]

    monkeypatch.setattr(surrogate.comparison, "simulate_same", stopped)
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


def test_an_option_that_is_no_number_is_one_sentence(command):
    code, out, err = command("predict", "M1-concat", "--tabor", "abc", *FLAGS)
    assert (code, out) == (2, "")
    assert err.startswith("surrogate: Invalid value for '--tabor': ")
    assert err.count("\n") == 1


def test_places_that_cannot_be_written(command, tmp_path):
    whole = ["predict", "M1-concat", "--tabor", 1.0, *FLAGS]
    long = tmp_path / f"{'n' * 300}.csv"
    for place, words in ((long, "File name too long"), ("/proc/self/out.csv", "/proc/self/out.csv")):
        err = refused(command, [*whole, "--plot", tmp_path / "p.png", "--out", place], folder=tmp_path)
        assert "can be written" in err
        assert words in err


def test_a_full_disk_leaves_neither_of_two_files(command, tmp_path, monkeypatch):
    import errno

    import surrogate.comparison

    def fail(path, *_):
        path.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(surrogate.comparison, "plot_predictions", fail)
    (tmp_path / "out.json").write_text("before")
    words = [
        "predict",
        "M1-concat",
        "--tabor",
        1.0,
        *FLAGS,
        "--out",
        tmp_path / "out.json",
        "--plot",
        tmp_path / "p.png",
    ]
    assert f"{tmp_path / 'p.png'} (No space left on device)" in refused(command, words, folder=tmp_path)


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


def test_export_writes_beside_the_weights_or_where_told(command, models, tmp_path, monkeypatch):
    own = models / "M1-concat" / "model.onnx"
    before = own.read_bytes()
    # An up-to-date file is copied, which takes no Keras.
    with monkeypatch.context() as patch:
        patch.setattr("surrogate.export.keras_model", None)
        code, out, _ = command("export", "M1-concat", "--out", tmp_path / "copy.onnx")
    assert (code, "copy.onnx" in out) == (0, True)
    assert (tmp_path / "copy.onnx").read_bytes() == before
    own.unlink()
    try:
        assert command("export", "M1-concat", "--out", tmp_path / "fresh.onnx")[0] == 0
        assert not own.exists()
        assert (tmp_path / "fresh.onnx").read_bytes() == before
        code, out, _ = command("export", "M1-concat")
        assert (code, "model.onnx" in out) == (0, True)
        assert own.read_bytes() == before
    finally:
        own.write_bytes(before)


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
    assert with_dwell.hysteresis == pytest.approx(abs(loop), rel=1e-12)
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
