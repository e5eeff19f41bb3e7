"""The measurement of start-up: a baseline that git does not know is one sentence."""

import pytest

from experiments.cost import startup


def test_an_unknown_baseline_is_refused(tmp_path):
    for revision in ("no-such-revision", "--output=x"):
        with pytest.raises(ValueError, match="baseline must be a git revision; received"):
            startup.checked_out(revision, tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_package_of_a_revision_is_checked_out(tmp_path):
    source = startup.checked_out("HEAD", tmp_path)
    assert (source / "bem" / "cli.py").is_file()
