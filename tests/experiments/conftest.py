import pytest

from bem._support.text_files import plain
from bem.dataset.campaign import Campaign
from experiments.measurements import accuracy_cost, tools
from tests.bem.dataset import stand_in
from tests.bem.dataset.helpers import run_here


@pytest.fixture(scope="session")
def dataset(tmp_path_factory):
    """A data set file of a few trajectories that were not simulated."""
    path = tmp_path_factory.mktemp("data") / "dataset.h5"
    run_here(Campaign(count=60, seed=2), path, solver=stand_in.solve)
    return path


@pytest.fixture(scope="session")
def cost(dataset, tmp_path_factory):
    """What the measurement of accuracy and cost is for two protocols, where no model is published."""
    folder = tmp_path_factory.mktemp("cost")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tools, "EXACT_TARGET", 4e-3)
        patch.setattr(tools, "KEPT", folder)
        patch.setattr(accuracy_cost, "TARGETS", (5e-2, 1.7e-2))
        patch.setattr(accuracy_cost, "BASELINE", {20: 0.5, 30: 0.5})
        return plain(accuracy_cost.study(dataset, folder / "no models", count=2, repeats=2, finest=20, jobs=1))
