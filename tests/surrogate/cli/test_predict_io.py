"""Files of protocols: which are read, and in which one sentence the others are refused."""

import json
import re

import pytest

from tests.surrogate.conftest import FLAGS, PROTOCOL, refused

HEADER = "tabor,peak_indentation,loading_rate,dwell_time,unloading_rate\n"


PROTOCOLS = [
    ("", "which is empty"),
    (HEADER, "at least one row"),
    (HEADER + "1,2,3\n", "5 values in every row. Received: 3 in row 1"),
    (HEADER + "1,20,10,1,ten\n", "finite numbers. Received: 'ten' as unloading_rate in row 1"),
    (HEADER + "1,20,10,1,nan\n", "'nan' as unloading_rate"),
    (HEADER + "-1,20,10,1,10\n", "tabor must be"),
    ("tabor,depth\n1,2\n", "the columns tabor, peak_indentation.*Received: depth, tabor in"),
    ("tabor,tabor\n1,2\n", "every column once"),
    (",".join(f"c{i}" for i in range(10**5)) + "\n", "the columns tabor.*Received: c0, c1, .* in "),
    ("a" * 10**5 + "," + "a" * 10**5 + "\n", "every column once"),
    (HEADER + "1,20,10,1," + 10**5 * "x" + "\n", "finite numbers. Received: 'xxx.*' as unloading_rate in row 1"),
    (HEADER + '"1,20,10,1,10\n', "comma-separated numbers under a header"),
    (HEADER + "1,20,10,1,1_0\n", "finite numbers. Received: '1_0'"),
    (HEADER + "1,20,10,1,\u0661\n", "finite numbers"),
    (
        HEADER + "1,20,10,1,10\n\n \n1,20,0,1,10\n",
        r"loading_rate must be .*; received 0\.0 in row 2 \(line 5\) of \S+in.csv$",
    ),
    (
        HEADER + "1,20,10,1,10\n0,20,1,1,10\n",
        r"tabor must be .*; received 0\.0 in row 2 \(line 3\) of \S+in.csv$",
    ),
    (HEADER + "1,20,10,1,10\n1,20,1e-12,1e-9,10\n", r"outlast the rounding .*; received .* in row 2 \(line 3\)"),
    ("1,20,10,1,10\n1,20,10,1,10\n", "a header that names the columns. Received: numbers in the first row"),
]
OBJECTS = [
    ("[" * 100_000, "nested too deeply"),
    ('[{"tabor": 1, "tabor": 2}]', "'tabor' twice in one object"),
    (json.dumps([PROTOCOL | {"tabor": 10**400}]), "finite numbers. Received: 1000.*as tabor in row 1"),
    (json.dumps([PROTOCOL | {"tabor": 1.0}, PROTOCOL]), "the same names in every object.*in row 2 of"),
    ('[{"tabor": 1' + 5000 * "0" + "}]", "Expected JSON"),
    (json.dumps([PROTOCOL | {"tabor": [1]}]), "finite numbers"),
    (json.dumps([PROTOCOL | {"tabor": True}]), "finite numbers. Received: True"),
    ("null", "a JSON list of protocols"),
    ("[]", "a JSON list of protocols"),
    ("[1, 2", "Expected JSON"),
    ("[1, 2]", "a JSON list of protocols"),
    ('{"tabor": [0, 1]}', "a JSON list of protocols"),
]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        *(("in.csv", text, words) for text, words in PROTOCOLS),
        *(("in.json", text, words) for text, words in OBJECTS),
    ],
)
def test_malformed_files(name, text, words, command, tmp_path):
    (tmp_path / name).write_text(text)
    kept = tmp_path / "out.csv"
    kept.write_text("what was there before")
    given = ["predict", "M1-concat", "--in", tmp_path / name, "--out", kept]
    assert re.search(words, refused(command, given, folder=tmp_path))


def test_other_mistakes(command, program, tmp_path):
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x80")
    (tmp_path / "good.csv").write_text(HEADER + "1,20,10,1,10\n")
    (tmp_path / "solids.json").write_text(json.dumps([PROTOCOL | {"tabor": 1.0, "modulus_ratio": 0.3}]))
    (tmp_path / "foreign.onnx").write_text("not a graph")
    whole = ["M1-concat", "--tabor", 1.0, *FLAGS]
    solids = ["--in", tmp_path / "solids.json"]
    for words, expected in (
        (["M1-concat", "--in", tmp_path / "binary.csv"], "text in UTF-8"),
        (["M1-concat", "--in", tmp_path / "absent.csv"], "which does not exist"),
        (["M1-concat", "--in", tmp_path / "in.xlsx"], "called .csv or .json"),
        (
            ["M1-concat", "--in", tmp_path / "good.csv", "--tabor", 1],
            f"not both. Received: --in {tmp_path}/good.csv, --tabor",
        ),
        (["M1-concat", "--dwell-time", 1], "Received: no --peak-indentation, --loading-rate"),
        ([*whole, "--out", tmp_path / "out.txt"], "called .csv or .json"),
        ([*whole, "--out", tmp_path / "none" / "out.csv"], "a directory that exists"),
        ([*whole, "--plot", tmp_path / "p.bmp"], "called .png or"),
        ([*whole, "--backend", "torch"], "backend='torch'"),
        ([tmp_path / "foreign.onnx", *whole[1:]], "foreign.onnx, which is not one"),
        (["M1-concat", *solids], "Expected protocols without modulus_ratio, since M1-concat knows one material"),
        ([*whole, "--coverage", 0.9], "Expected --coverage with a model that has bands, accurate or fast"),
    ):
        assert expected in refused(command, ["predict", *words], folder=tmp_path)
    assert "format onnx" in refused(command, ["export", "M1-concat", "--format", "tflite"], folder=tmp_path)
    assert "--out FILE.keras" in refused(command, ["export", "M1-concat", "--format", "keras"], folder=tmp_path)
    assert "onnx for fast" in refused(command, ["export", "fast", "--out", tmp_path / "a.keras"], folder=tmp_path)
    for words, expected in (
        (
            ["fast", *whole[1:], "--modulus-ratio", 2],
            "modulus_ratio must be a finite number greater than 0 and at most 1; rec",
        ),
        (["fast", *solids, "--modulus-ratio", 0.2], "modulus ratios from --in FILE or from --modulus-ratio, not"),
    ):
        assert expected in refused(program, ["predict", *words], folder=tmp_path)
