"""The runner of the studies."""

import sys

import pytest

from experiments.__main__ import main
from experiments.paper import own_architecture_graphs
from experiments.places import keywords


def run(monkeypatch, capsys, *words):
    monkeypatch.setattr(sys, "argv", ["python", *words])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code, capsys.readouterr()


@pytest.mark.parametrize("name", ["startup", "persson_brener"])
def test_the_help_of_a_study_says_how_it_is_called(name, monkeypatch, capsys):
    code, said = run(monkeypatch, capsys, name, "--help")
    assert code == 0
    assert f"Usage: python -m experiments {name} " in said.out


@pytest.mark.parametrize("name", ["no_study", "cases"])
def test_an_unknown_study_or_what_studies_share_is_one_sentence(name, monkeypatch, capsys):
    code, said = run(monkeypatch, capsys, name)
    assert (code, said.err.count("\n")) == (2, 1)
    assert "persson_brener" in said.err
    assert f"received {name!r}" in said.err


def test_an_option_that_may_be_repeated_is_collected_and_one_that_must_be_given_is_asked_for():
    study = own_architecture_graphs.study
    assert keywords(["--architecture", "one.py"], study) == {"architecture": ("one.py",)}
    assert keywords(["--architecture", "a.py", "--architecture", "b.py"], study) == {"architecture": ("a.py", "b.py")}
    with pytest.raises(ValueError, match="--architecture VALUE must be given"):
        keywords([], study)
    with pytest.raises(ValueError, match="expected no other options; received '--resamples 0'"):
        keywords(["--resamples", "0"], lambda: None)
