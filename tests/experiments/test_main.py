"""The runner of the studies."""

import json
import sys

import pytest

from experiments.__main__ import main, studies
from experiments.measurements import effects
from experiments.paper import architecture_graphs


def run(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["python", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code, capsys.readouterr()


@pytest.mark.parametrize("name", ["soak", "persson_brener"])
def test_help_of_a_study_shows_its_usage(name, monkeypatch, capsys):
    code, output = run(monkeypatch, capsys, name, "--help")
    assert code == 0
    assert f"Usage: python -m experiments {name} " in output.out


def test_help_without_name_lists_studies(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["python", "--help"])
    main()
    assert capsys.readouterr().out.splitlines()[-1] == f"Studies: {', '.join(studies())}"


@pytest.mark.parametrize("name", ["no_study", "cases"])
def test_an_unknown_study_is_one_sentence(name, monkeypatch, capsys):
    code, output = run(monkeypatch, capsys, name)
    assert (code, output.err.count("\n")) == (2, 1)
    assert "persson_brener" in output.err
    assert f"received {name!r}" in output.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["persson_brener"], "CONFIG.toml must be given"),
        (["dataset_statistics", "--architecture", "a.py"], "that --help lists; received --architecture"),
        (["inconsistencies", "--only", "halving", "--only", "none"], "received 'none'"),
        (["model_comparison", "models", "no/file.h5"], "data set 'no/file.h5' not found"),
        (["amortisation", "README.md", "a.h5", "models"], "result file 'README.md' must be JSON; Expecting value"),
        (["amortisation", "a/measurements/b_c.json", "d", "e"], "'a/measurements/b_c.json' not found; `make measure-b"),
        (["amortisation", "a/studies/b.json", "d", "e"], "'a/studies/b.json' not found; `make studies` makes it"),
    ],
)
def test_inputs_and_options_of_a_study(arguments, message, monkeypatch, capsys):
    code, output = run(monkeypatch, capsys, *arguments)
    assert (code, message in output.err) == (2, True)


@pytest.mark.parametrize(("arguments", "status"), [((), 1), (("--leave-out",), 0)])
def test_a_study_that_needs_keras_says_so(arguments, status, monkeypatch, capsys):
    def study():
        raise ModuleNotFoundError("No module named 'keras'", name="keras")

    monkeypatch.setattr(architecture_graphs, "study", study)
    code, shown = run(monkeypatch, capsys, "architecture_graphs", *arguments)
    assert code == status
    assert (
        "architecture_graphs needs keras, which this installation leaves out; run `make setup`" in shown.out + shown.err
    )


def test_an_option_may_be_repeated(monkeypatch, capsys):
    code, output = run(monkeypatch, capsys, "inconsistencies", "--only", "halving", "--only", "inference-time")
    assert (code, output.out.split("\n")[0], "\ninference-time\n" in output.out) == (0, "halving", True)


def test_a_result_states_its_command(monkeypatch, capsys, tmp_path):
    def study(*, count: int = 1):
        return {"count": count}

    monkeypatch.setattr(effects, "study", study)
    out = tmp_path / "effects.json"
    code, _ = run(monkeypatch, capsys, "effects", "--count", "3", "--busy", "--out", str(out))
    result = json.loads(out.read_text(encoding="utf-8"))
    assert (code, result["count"], result["command"]) == (0, 3, "python -m experiments effects --count 3")
