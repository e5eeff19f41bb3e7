import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "bem"))

import campaign_stand_in as stand_in

from bem.campaign import run_campaign
from bem.campaign_plan import Campaign


@pytest.fixture(scope="session")
def dataset(tmp_path_factory):
    """A data set file of a few trajectories that were not simulated."""
    path = tmp_path_factory.mktemp("data") / "dataset.h5"
    run_campaign(Campaign(count=60, seed=2), path, solver=stand_in.solve)
    return path
