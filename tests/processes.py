"""Programs and commands that a test runs to their end, and the root of the repository, where most of them run."""

import subprocess
import sys
from pathlib import Path

from typer.testing import CliRunner

ROOT = Path(__file__).resolve().parents[1]


def ended(*arguments, **options):
    """A program that has ended, with whatever status, and what it printed."""
    return subprocess.run([str(word) for word in arguments], capture_output=True, text=True, **options)


def python(*arguments, **options):
    return ended(sys.executable, *arguments, **options)


def succeeded(app, arguments):
    """A command that ran in this process and ended well."""
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    return result
