"""Programs and commands that a test runs to their end, and the root of the repository, where most of them run."""

import subprocess
import sys
from pathlib import Path

from typer.testing import CliRunner

ROOT = Path(__file__).resolve().parents[1]


def ended(*words, **options):
    """A program that has ended, with whatever status, and what it printed."""
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)


def python(*words, **options):
    return ended(sys.executable, *words, **options)


def succeeded(app, words):
    """A command that ran in this process and ended well."""
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    return result
