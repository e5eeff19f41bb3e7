"""How a training is asked to stop, and what is published under an architecture's own name."""

import signal

import pytest
from typer.testing import CliRunner

from surrogate.cli import app as cli
from surrogate.training.queue import StopRequest


@pytest.fixture
def handler():
    """The handler of SIGTERM, which a test may replace."""
    before = signal.getsignal(signal.SIGTERM)
    yield
    signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("how", ["SIGTERM", "STOP"])
@pytest.mark.usefixtures("handler")
def test_a_signal_or_a_file_asks_to_stop_and_a_second_signal_ends_the_process(how, tmp_path):
    asked = StopRequest(tmp_path)
    assert not asked()
    if how == "STOP":
        (tmp_path / "STOP").touch()
    else:
        signal.raise_signal(signal.SIGTERM)
    assert asked()
    assert (signal.getsignal(signal.SIGTERM) is signal.SIG_DFL) == (how == "SIGTERM")


@pytest.mark.parametrize(
    "options", [["--features", "A"], ["--fraction", "0.5"], ["--split-seed", "1"], ["--extra", "x"]]
)
def test_a_training_with_other_options_needs_a_label(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(cli.app, ["train", "M1-concat", *options])
    assert isinstance(result.exception, ValueError)
    assert str(result.exception).startswith(f"Expected --label with {options[0]}, because published/models/M1-concat ")
    for allowed in (["--label", "mine"], ["--models", "elsewhere"]):
        result = CliRunner().invoke(cli.app, ["train", "M1-concat", *options, *allowed])
        # There is no data set here.
        assert isinstance(result.exception, FileNotFoundError)
