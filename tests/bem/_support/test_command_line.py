"""A module run as a command ends in a sentence and a status, not in a traceback."""

import sys
import tomllib
from io import BytesIO

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import bem.cli.app
import surrogate.cli.app
from bem._support import command_line
from bem._support.command_line import run_main, sentence
from tests.processes import ROOT, python


def ended(main, arguments, monkeypatch):
    """Exit status of a module's function run with these arguments."""
    monkeypatch.setattr(sys, "argv", ["study", *arguments])
    with pytest.raises(SystemExit) as stop:
        run_main(main)
    return stop.value.code


def study(count: int, stop: bool = False) -> None:
    """Do something."""
    if count < 1:
        raise ValueError(f"count must be at least 1;\nreceived {count}")
    if stop:
        raise typer.Exit(75)


def failed() -> None:
    raise RuntimeError("a training failed;\nits log is in 'runs'")


@pytest.mark.parametrize(
    ("main", "arguments", "status", "message"),
    [
        (study, ["2"], 0, ""),
        (study, ["2", "--stop"], 75, ""),
        (study, ["0"], 2, ": count must be at least 1; received 0\n"),
        (study, ["x"], 2, ": count must be an integer; received 'x'\n"),
        (failed, [], 1, ": a training failed; its log is in 'runs'\n"),
    ],
)
def test_module_ends_with_its_status(main, arguments, status, message, monkeypatch, capsys):
    assert ended(main, arguments, monkeypatch) == status
    printed = capsys.readouterr().err
    assert message in printed
    assert printed.count("\n") == bool(message)


def test_program_mistake_keeps_its_traceback(monkeypatch):
    def unwritten():
        raise NotImplementedError("later")

    monkeypatch.setattr(sys, "argv", ["study"])
    with pytest.raises(NotImplementedError):
        run_main(unwritten)


def test_only_control_c_is_an_interruption(monkeypatch):
    def cut() -> None:
        np.load(BytesIO())

    monkeypatch.setattr(sys, "argv", ["study"])
    monkeypatch.setattr("bem._support.command_line.end", sys.exit)
    with pytest.raises(EOFError, match="No data left"):
        run_main(cut)


CYCLE = "--peak-indentation 2 --loading-rate 10 --unloading-rate 10"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ("bem --sideways", "bem: options must be those that --help lists; received --sideways"),
        ("surrogate --sideways", "surrogate: options must be those that --help lists; received --sideways"),
        ("bem nonsense", "bem: the command must be one of simulate, simulate-si, fit,"),
        ("bem simulate extra", "bem: options must have names, as --help lists them; received extra"),
        ("bem simulate --tabor", "bem: --tabor must have a value; received none"),
        ("bem simulate --tabor soft", "bem: --tabor must be a number; received 'soft'"),
        ("bem simulate --adhesion glue", "bem: --adhesion must be one of 'lennard-jones', 'constant-stress',"),
        ("bem fit no.csv", "bem: --radius must be given; received none"),
        ("bem fit no.csv --radius 5um", "bem: the file must be accessible; received no.csv"),
        ("surrogate predict", "surrogate: name must be given; received none"),
        ("surrogate predict fast --tabor -1", "surrogate: --tabor must be a finite number at least 1e-06"),
        (f"bem simulate --tabor -1 {CYCLE}", "bem: --tabor must be a finite number at least 1e-06"),
        ("bem simulate --loading-rate 1", "bem: --peak-indentation, --unloading-rate must be given"),
        (
            "paper_figures table-quartiles no.json --out a.md",
            "python -m paper_figures: result file 'no.json' not found",
        ),
    ],
)
def test_mistake_exits_with_2_and_a_sentence(arguments, sentence):
    ended = python("-m", *arguments.split())
    assert (ended.returncode, ended.stdout, ended.stderr.count("\n")) == (2, "", 1)
    assert ended.stderr.startswith(sentence)


@pytest.mark.parametrize("module", ["bem", "surrogate"])
def test_a_command_alone_tells_its_usage(module):
    process = python("-m", module)
    assert "Usage" in process.stdout + process.stderr


def test_sentence_is_one_bounded_line():
    for error in (ValueError("a\n" + "x" * 10**6), OSError(36, "File name too long", "y" * 10**6)):
        assert "\n" not in sentence(error)
        assert len(sentence(error)) < 2100
    assert sentence(ValueError("short  one\nhere")) == "short one here"
    refused = sentence(PermissionError(13, "Permission denied", "a.csv"))
    assert refused == "the file must be accessible; received a.csv (Permission denied)"


@pytest.mark.parametrize(("name", "app"), [("bem", bem.cli.app.app), ("surrogate", surrogate.cli.app.app)])
def test_both_programs_tell_their_version(name, app):
    project = tomllib.loads(ROOT.joinpath("pyproject.toml").read_text(encoding="utf-8"))["project"]
    result = CliRunner().invoke(app, ["--version"])
    assert (result.exit_code, result.output) == (0, f"{name} {project['version']}\n")
    assert "COMMAND" in CliRunner().invoke(app, ["--help"]).output


def test_options_are_named_as_typed(monkeypatch):
    names = {"times": "--times", "peak_indentation": "--peak-indentation", "number": "--number"}
    monkeypatch.setattr(command_line, "_option_of", names)
    for text, typed in {
        "times and peak_indentation must be given": "--times and --peak-indentation must be given",
        "the number of a curve must be given": "the number of a curve must be given",
        "tabor must be above 0, times too": "tabor must be above 0, times too",
    }.items():
        assert sentence(ValueError(text)) == typed
