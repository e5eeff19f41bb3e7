"""`surrogate predict` with the pretrained models: any standard linear solid, bands, and what they refuse."""

import csv
import json

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from surrogate import ExtrapolationWarning
from surrogate.prediction.files import PUBLISHED_BANDED as PUBLISHED
from surrogate.prediction.predicted import INTERVALS
from tests.surrogate.conftest import scenes
from tests.surrogate.prediction.predicting import FLAGS, PROTOCOL

pytestmark = pytest.mark.skipif(not (PUBLISHED / "fast").is_dir(), reason="`make pretrained` writes the models")


@pytest.mark.parametrize(("words", "ratio"), [((), 0.1), (("--modulus-ratio", 0.3), 0.3)])
def test_force_interval_and_band_are_those_of_python(program, words, ratio):
    code, out, err = program("predict", "fast", "--tabor", 1.0, *FLAGS, *words)
    assert (code, err) == (0, "")
    found = surrogate.load("fast").predict(scenes([1.0], ratio)[0], LoadingProtocol(**PROTOCOL))
    low, high = found.pull_off_interval
    assert f"pull-off force {found.pull_off_force:.5g} (90 % interval {low:.5g} to {high:.5g}) at time" in out
    assert f"modulus ratio {ratio}\n" in out
    largest = 0.5 * (found.force_upper - found.force_lower).max()
    assert f"median, {largest:.3g} at most; --out and --json give it" in out


def test_a_file_of_solids_and_the_files_of_its_bands(program, tmp_path):
    rows = [PROTOCOL | {"tabor": 1.0, "modulus_ratio": 0.1}, PROTOCOL | {"tabor": 2.0, "modulus_ratio": 0.7}]
    (tmp_path / "in.json").write_text(json.dumps(rows))
    for kind in ("csv", "json"):
        words = ["--in", tmp_path / "in.json", "--coverage", 0.5, "--out", tmp_path / f"out.{kind}"]
        assert program("predict", "fast", *words, "--steps", "--plot", tmp_path / "p.png")[0] == 0
    expected = surrogate.load("fast").predict(scenes([1.0, 2.0], [0.1, 0.7]), LoadingProtocol(**PROTOCOL), coverage=0.5)
    for one, two in zip(json.loads((tmp_path / "out.json").read_text()), expected, strict=True):
        assert one["pull_off_interval"] == list(two.pull_off_interval)
        assert (one["modulus_ratio"], one["coverage"]) == (two.modulus_ratio, 0.5)
        assert one["force_lower"] == two.force_lower.tolist()
        assert one["force_upper"] == two.force_upper.tolist()
    with (tmp_path / "out.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    for name in ("force", "force_lower", "force_upper"):
        wanted = np.concatenate([getattr(one, name) for one in expected])
        np.testing.assert_array_equal([float(row[name]) for row in table], wanted)


def test_a_file_of_solids_becomes_a_table_with_a_row_of_each(program, tmp_path):
    ratios = [0.005, 0.1, 0.004, 0.7]
    (tmp_path / "in.json").write_text(json.dumps([PROTOCOL | {"tabor": 1.0, "modulus_ratio": one} for one in ratios]))
    words = ["--in", tmp_path / "in.json", "--out", tmp_path / "table.csv"]
    code, out, err = program("predict", "fast", *words, "--check")
    assert (code, out.count("\n"), err.count("\n")) == (0, 1, 1)
    assert "2 of 4 trajectories extrapolate; trajectory 0 extrapolates: modulus_ratio = 0.005" in err
    with (tmp_path / "table.csv").open(newline="") as file:
        table = list(csv.DictReader(file))
    expected = surrogate.load("fast").predict(scenes(1.0, [0.1, 0.7]), LoadingProtocol(**PROTOCOL))
    assert [float(row["modulus_ratio"]) for row in table] == ratios
    assert [bool(row["extrapolated"]) for row in table] == [True, False, True, False]
    for row, one in zip(table[1::2], expected, strict=True):
        assert float(row["pull_off_force"]) == pytest.approx(one.pull_off_force, rel=1e-6)
        for name in INTERVALS:
            ends = [float(row[name.replace("interval", end)]) for end in ("lower", "upper")]
            assert ends == pytest.approx(getattr(one, name), rel=1e-6)
        assert float(row["check_pull_off_percent"]) < 20.0
    assert table[0]["pull_off_lower"] == table[0]["hysteresis_upper"] == ""


def test_outside_the_training_is_one_sentence_and_no_band(program, tmp_path, recwarn):
    out_file = tmp_path / "out.csv"
    code, out, err = program("predict", "accurate", "--tabor", 1.0, *FLAGS, "--modulus-ratio", 0.005, "--out", out_file)
    assert code == 0
    assert err.count("\n") == 1
    assert "trajectory 0 extrapolates: modulus_ratio = 0.005 lies outside [0.01, 1]" in err
    assert "interval" not in out
    assert "no band: outside the ranges that accurate was trained on" in out
    assert not [one for one in recwarn if issubclass(one.category, ExtrapolationWarning)]
    with out_file.open(newline="") as file:
        assert {(row["force_lower"], row["force_upper"]) for row in csv.DictReader(file)} == {("", "")}


def test_the_check_is_of_the_same_solid(program):
    words = ["predict", "fast", "--tabor", 1.0, *FLAGS, "--modulus-ratio", 0.3, "--check", "--json"]
    (found,) = json.loads(program(*words)[1])
    assert found["check"]["modulus_ratio"] == found["check"]["model_modulus_ratio"] == 0.3
    assert found["check"]["pull_off_percent"] < 5.0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["fast", "--modulus-ratio", "2"],
            "modulus_ratio must be a finite number greater than 0 and at most 1; received 2.0",
        ),
        (["fast", "--coverage", "1"], "coverage must be a finite number greater than 0 and at most 0.99"),
        (["fast", "--backend", "keras"], "Expected the backend 'onnx' for fast"),
        (["M1-concat", "--coverage", "0.9"], "Expected --coverage with a model that has bands, accurate or fast"),
    ],
)
def test_a_mistake_is_one_sentence(program, words, sentence):
    code, out, err = program("predict", *words, "--tabor", 1.0, *FLAGS)
    assert (code, out) == (2, "")
    assert err.startswith(f"surrogate: {sentence}")
    assert err.count("\n") == 1


def test_files_that_do_not_fit_the_model(program, tmp_path):
    (tmp_path / "history.csv").write_text("time,indentation\n0,-2\n1,5\n2,5\n3,-2\n")
    code, _, err = program("predict", "fast", "--in", tmp_path / "history.csv", "--tabor", 1.0)
    assert code == 2
    assert err.startswith(
        "surrogate: Expected a model of uniform measurement steps for a measured history, such as M1-concat"
    )
    (tmp_path / "solids.json").write_text(json.dumps([PROTOCOL | {"tabor": 1.0, "modulus_ratio": 0.3}]))
    code, _, err = program("predict", "M1-concat", "--in", tmp_path / "solids.json")
    assert code == 2
    assert err.startswith("surrogate: Expected protocols without modulus_ratio, since M1-concat knows one material")
    code, _, err = program("predict", "fast", "--in", tmp_path / "solids.json", "--modulus-ratio", 0.2)
    assert code == 2
    assert err.startswith("surrogate: Expected modulus ratios from --in FILE or from --modulus-ratio, not both")


def test_export_writes_one_file_and_never_over_the_network(program, tmp_path):
    network = (PUBLISHED / "fast" / "model.onnx").read_bytes()
    code, out, err = program("export", "fast")
    assert (code, out) == (2, "")
    assert err.startswith("surrogate: Expected --out FILE, since ")
    assert (PUBLISHED / "fast" / "model.onnx").read_bytes() == network
    assert program("export", "fast", "--out", tmp_path / "fast.onnx")[0] == 0
    assert len((tmp_path / "fast.onnx").read_bytes()) > len(network)
