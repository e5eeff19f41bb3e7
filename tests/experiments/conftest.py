import pytest

from bem.dataset.campaign import Campaign
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import run_here


@pytest.fixture(scope="session")
def dataset(tmp_path_factory):
    """A data set file of a few trajectories that were not simulated."""
    path = tmp_path_factory.mktemp("data") / "dataset.h5"
    run_here(Campaign(count=60, seed=2), path, solver=stand_in.solve)
    return path
