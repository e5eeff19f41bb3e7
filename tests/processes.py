"""Programs that a test runs to their end."""

import subprocess
import sys


def ended(*words, **options):
    """A program that has ended, with whatever status, and what it printed."""
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)


def python(*words, **options):
    return ended(sys.executable, *words, **options)
