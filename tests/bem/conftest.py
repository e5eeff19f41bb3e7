"""Settings of the solver's unit tests, and the campaign of the stand-in solver that many of them compare with."""

from collections import Counter

import pytest

from bem.dataset.campaign import Campaign
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import run_here


@pytest.fixture(scope="session")
def plan():
    return Campaign(count=120, seed=4, native=True)


@pytest.fixture(scope="session")
def undisturbed(plan, tmp_path_factory):
    path = tmp_path_factory.mktemp("undisturbed") / "data.h5"
    summary = run_here(plan, path, solver=stand_in.solve, command="bem campaign --count 120")
    assert (summary.count, summary.computed, summary.failures) == (120, 120, Counter())
    assert sorted(path.parent.iterdir()) == [path]
    return path


@pytest.fixture
def mending(tmp_path, monkeypatch, in_this_process):
    """A file for `stand_in.fails_until_mended`, which runs here to see its environment, and what mends the solver."""
    monkeypatch.setenv("STAND_IN_MARKER", str(tmp_path / "mended"))
    return tmp_path / "data.h5", (tmp_path / "mended").touch


@pytest.fixture
def out(tmp_path):
    """The file that a campaign of this test writes."""
    return tmp_path / "data.h5"
