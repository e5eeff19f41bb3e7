"""Files of protocols: which are read, and in which one sentence the others are refused."""

import json
import re

import pytest

from tests.surrogate.conftest import FLAGS, PROTOCOL, refused

HEADER = "tabor,peak_indentation,loading_rate,dwell_time,unloading_rate\n"


PROTOCOLS = [
    ("", "no row of numbers"),
    (HEADER, "no row of numbers"),
    (HEADER + "1,2,3\n", "3 values in line 2, 5 in the header"),
    (HEADER + "1,20,10,1,ten\n", "unloading_rate must be a finite number; received 'ten' in row 1"),
    (HEADER + "1,20,10,1,nan\n", "received 'nan' in row 1"),
    (HEADER + "-1,20,10,1,10\n", "tabor must be"),
    ("tabor,depth\n1,2\n", "columns must be tabor, peak_indentation.*received tabor, depth in"),
    (
        HEADER.replace("loading_rate,d", "tabor,d") + "1,20,1,1,10\n",
        "columns must be .*, each once; received tabor, .*",
    ),
    (",".join(f"c{i}" for i in range(10**5)) + "\n" + "1," * (10**5 - 1) + "1\n", "columns must be tabor.* c0, c1, "),
    (HEADER + "1,20,10,1," + 10**5 * "x" + "\n", "a finite number; received 'xxx.*' in row 1"),
    (HEADER + '"1,20,10,1,10\n', "comma-separated numbers under a header"),
    (HEADER + "1,20,10,1,1_0\n", "a finite number; received '1_0'"),
    (
        HEADER + "1,20,10,1,10\n\n \n1,20,0,1,10\n",
        r"loading_rate must be .*; received 0\.0 in row 2 \(line 5\) of \S+in.csv$",
    ),
    (HEADER + "1,20,10,1,10\n1,20,1e-12,1e-9,10\n", r"outlast the rounding .*; received .* in row 2 \(line 3\)"),
    ("1,20,10,1,10\n1,20,10,1,10\n", "columns must be"),
]
OBJECTS = [
    ("[" * 100_000, "nested too deeply"),
    (json.dumps([PROTOCOL | {"tabor": 10**400}]), "tabor must be a finite number; received 1000.* in row 1"),
    (json.dumps([PROTOCOL | {"tabor": 1.0}, PROTOCOL]), "other names in object 2"),
    (json.dumps([PROTOCOL | {"tabor": [1]}]), "a finite number"),
    (json.dumps([PROTOCOL | {"tabor": True}]), "a finite number; received True"),
    ("null", "a JSON list of protocols"),
    ("[]", "a JSON list of protocols"),
    ("[1, 2", "a JSON list of protocols"),
    ("[1, 2]", "a JSON list of protocols"),
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
        (["M1-concat", "--in", tmp_path / "binary.csv"], "not UTF-8 text"),
        (["M1-concat", "--in", tmp_path / "absent.csv"], "which does not exist"),
        (["M1-concat", "--in", tmp_path / "in.xlsx"], "called .csv or .json"),
        (
            ["M1-concat", "--in", tmp_path / "good.csv", "--tabor", 1],
            f"not both; received --in {tmp_path}/good.csv, --tabor",
        ),
        (["M1-concat", "--dwell-time", 1], "received no --peak-indentation, --loading-rate"),
        ([*whole, "--out", tmp_path / "out.txt"], "called .csv or .json"),
        ([*whole, "--out", tmp_path / "none" / "out.csv"], "a directory that exists"),
        ([*whole, "--plot", tmp_path / "p.bmp"], "called .png or"),
        ([*whole, "--backend", "torch"], "--backend must be one of 'onnx', 'keras'; received 'torch'"),
        ([tmp_path / "foreign.onnx", *whole[1:]], "foreign.onnx, which is not one"),
        (["M1-concat", *solids], "protocols must have no modulus_ratio for M1-concat, which knows one material"),
        ([*whole, "--coverage", 0.9], "--coverage must go with fast or accurate, which know it"),
    ):
        assert expected in refused(command, ["predict", *words], folder=tmp_path)
    assert "--format must be onnx or keras" in refused(
        command, ["export", "M1-concat", "--format", "tflite"], folder=tmp_path
    )
    assert "--out must name the file" in refused(command, ["export", "M1-concat", "--format", "keras"], folder=tmp_path)
    assert "it has no ONNX file" in refused(command, ["export", "fast", "--out", tmp_path / "a.keras"], folder=tmp_path)
    for words, expected in (
        (
            ["fast", *whole[1:], "--modulus-ratio", 2],
            "--modulus-ratio must be a finite number greater than 0 and at most 1; rec",
        ),
        (
            ["fast", *solids, "--modulus-ratio", 0.2],
            "modulus ratios must come from --in FILE or from --modulus-ratio, not",
        ),
    ):
        assert expected in refused(program, ["predict", *words], folder=tmp_path)
