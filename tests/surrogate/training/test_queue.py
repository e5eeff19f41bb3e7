"""What is published under an architecture's own name."""

import pytest
from typer.testing import CliRunner

from surrogate.cli import app as cli


@pytest.mark.parametrize(
    "options", [["--features", "A"], ["--fraction", "0.5"], ["--split-seed", "1"], ["--extra", "x"]]
)
def test_what_is_trained_otherwise_needs_a_label(options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(cli.app, ["train", "M1-concat", *options])
    assert isinstance(result.exception, ValueError)
    assert str(result.exception).startswith(f"Expected --label beside {options[0]}, since published/models/M1-concat ")
    for allowed in (["--label", "mine"], ["--models", "elsewhere"]):
        result = CliRunner().invoke(cli.app, ["train", "M1-concat", *options, *allowed])
        # There is no data set here.
        assert isinstance(result.exception, FileNotFoundError)
