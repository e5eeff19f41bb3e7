"""The runner of the studies."""

import json
import sys

import pytest

from experiments.__main__ import main
from experiments.measurements import latencies
from experiments.paper import architecture_graphs
from experiments.places import studies
from paper_figures.__main__ import main as draw
from paper_figures.__main__ import modules


def run(monkeypatch, capsys, *words):
    monkeypatch.setattr(sys, "argv", ["python", *words])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code, capsys.readouterr()


@pytest.mark.parametrize("name", ["soak", "persson_brener"])
def test_the_help_of_a_study_says_how_it_is_called(name, monkeypatch, capsys):
    code, said = run(monkeypatch, capsys, name, "--help")
    assert code == 0
    assert f"Usage: python -m experiments {name} " in said.out


@pytest.mark.parametrize("run_main", [main, draw])
def test_the_help_without_a_name_says_what_each_shows(run_main, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["python", "--help"])
    run_main()
    usage, empty, *lines = capsys.readouterr().out.splitlines()
    known = studies() if run_main is main else modules()
    assert (usage.split()[:3], empty, [line.split()[0] for line in lines]) == (["Usage:", "python", "-m"], "", [*known])
    assert min(len(line.split()) for line in lines) > 5


@pytest.mark.parametrize("name", ["no_study", "cases"])
def test_an_unknown_study_or_what_studies_share_is_one_sentence(name, monkeypatch, capsys):
    code, said = run(monkeypatch, capsys, name)
    assert (code, said.err.count("\n")) == (2, 1)
    assert "persson_brener" in said.err
    assert f"received {name!r}" in said.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["lab_files"], "Missing option '--folder'"),
        (["lab_files", "--folder", "no/such"], "Expected a folder of unpacked distributions"),
        (["dataset_statistics", "--architecture", "a.py"], "No such option: --architecture"),
        (["inconsistencies", "--only", "halving", "--only", "none"], "received 'none'"),
        (["model_comparison", "--dataset", "no/file.h5"], "data set 'no/file.h5' not found"),
        (["amortisation", "--accuracy-cost", "README.md"], "result file 'README.md' must be JSON (Expecting value"),
        (["amortisation", "--accuracy-cost", "no.json"], "'no.json' not found; `make measure-accuracy-cost` makes it"),
    ],
)
def test_options_are_those_of_the_study(words, said, monkeypatch, capsys):
    code, found = run(monkeypatch, capsys, *words)
    assert (code, said in found.err) == (2, True)


@pytest.mark.parametrize(("words", "status"), [((), 1), (("--leave-out",), 0)])
def test_a_study_that_needs_keras_says_so_and_is_left_out_where_that_is_allowed(words, status, monkeypatch, capsys):
    def study():
        raise ModuleNotFoundError("No module named 'keras'", name="keras")

    monkeypatch.setattr(architecture_graphs, "study", study)
    code, said = run(monkeypatch, capsys, "architecture_graphs", *words)
    assert code == status
    assert (
        "architecture_graphs needs keras, which this installation leaves out; run `make setup`" in said.out + said.err
    )


def test_an_option_may_be_repeated(monkeypatch, capsys):
    code, found = run(monkeypatch, capsys, "inconsistencies", "--only", "halving", "--only", "inference-time")
    assert (code, found.out.split("\n")[0], "\ninference-time\n" in found.out) == (0, "halving", True)


def test_a_result_is_written_where_asked_and_states_its_options_in_their_order(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(latencies, "ticks", lambda *_: [2e-4])
    out = tmp_path / "ticks.json"
    code, _ = run(monkeypatch, capsys, "contact_ticks", "--seed", "3", "--count", "2", "--busy", "--out", str(out))
    found = json.loads(out.read_text(encoding="utf-8"))
    assert (code, found["command"]) == (0, "python -m experiments contact_ticks --count 2 --seed 3")
