import subprocess

import pytest

import surrogate
from bem._support.text_files import read_json
from experiments.measurements.cases import Hidden
from experiments.surrogates import exported_files
from surrogate.prediction.files import PUBLISHED

HIDDEN = Hidden.draw(2, 0.1)


@pytest.mark.parametrize("name", ["fast", "accurate", "M1-concat", "M3-concat", "M4-concat"])
def test_multiplications_are_those_of_the_layers(name):
    # By hand from the widths of the layers (`surrogate.architectures`, the networks of `fast` and `accurate`).
    steps = 102 if name in ("fast", "accurate") else 120
    dense = 104 * 256 + 2 * 256 * 256 + 256 * 102
    causal = 4 * 128 * (13 + 128) + 4 * 64 * (128 + 64) + 64 * 64 + 64
    paper = 4 * 256 * (5 + 256) + 4 * 128 * (256 + 128) + 128 * 64 + 64
    by_hand = {"fast": dense, "accurate": 4 * dense + 2 * steps * causal, "M1-concat": 120 * paper}
    content = exported_files.whole_file(surrogate.load(name))
    found = exported_files.multiplications(content, steps)
    if name in by_hand:
        assert found == by_hand[name]
    else:  # convolutions multiply by each weight at each step; only biases and normalisation add without it
        weights = read_json(PUBLISHED / name / "metrics.json")["parameters"]
        assert 0.97 * weights < found / steps < weights


def test_facts_of_a_file_whose_forces_are_those_of_python():
    model = surrogate.load("fast")
    content, given = exported_files.whole_file(model), exported_files.inputs_of(model, HIDDEN)
    forces = model.predict_history(given["times"], given["indentations"], exported_files.scenes(given["tabor"], 0.1))
    said = {"milliseconds": [3.0, 1.0, 2.0], "forces": forces}
    found = exported_files.facts(model, content, given, said)
    assert (found["milliseconds"], found["difference"], found["file_bytes"]) == (2.0, 0.0, len(content))
    assert 0.99 * len(content) > 4 * found["weights"] > 0.9 * len(content)
    forces[1] *= 1.01
    with pytest.raises(RuntimeError, match=r"forces of fast in the browser differ by \d.\de-0[23]"):
        exported_files.facts(model, content, given, said)


def test_a_browser_that_fails_is_named_with_its_own_words(monkeypatch):
    def fails(command, **_):
        return subprocess.CompletedProcess(command, 1, "", "a line\nthe last line\n")

    monkeypatch.setattr(exported_files.subprocess, "run", fails)
    model = surrogate.load("fast")
    given = {"fast": exported_files.inputs_of(model, HIDDEN)}
    with pytest.raises(RuntimeError, match="Chromium did not run the files: the last line"):
        exported_files.in_browser({"fast": b""}, given, "chromium")


def test_without_a_browser_the_study_says_what_installs_one(monkeypatch):
    monkeypatch.setattr(exported_files.shutil, "which", lambda _: None)
    monkeypatch.delenv("CHROMIUM", raising=False)
    with pytest.raises(RuntimeError, match="needs Chromium, Node and their packages; `make test-demo` installs them"):
        exported_files.study(count=2)
