"""Campaigns whose numbers are computed where the test runs."""

import pytest

from tests.bem.dataset.campaign.helpers import Here


@pytest.fixture
def in_this_process(monkeypatch):
    """No workers, whose start takes seconds, where a test asks what is kept and not who computes it."""
    monkeypatch.setattr("bem.dataset.campaign.run.LocalExecutor", Here)
