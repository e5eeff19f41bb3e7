"""Three protocols of the paper's timing table; two independent solvers agree on these numbers to the digits shown."""

import pytest

from bem import Scene, StandardLinearSolid
from tests.validation.cases import completed, ramps

PROTOCOLS = {
    1: (0.2, 5.0, 10.0, 1.0, 200.0),
    4: (3.2, 5.0, 10.0, 1.0, 1000.0),
    12: (3.2, 15.0, 1000.0, 8e-3, 1000.0),
}
PULL_OFF_AND_HYSTERESIS = {1: (6.779, 417.26), 4: (7.438, 17.128), 12: (2.2498, 61.96)}


@pytest.mark.parametrize("number", PROTOCOLS)
def test_pull_off_force_and_hysteresis(number):
    tabor, peak, loading, dwell, unloading = PROTOCOLS[number]
    scene = Scene(tabor=tabor, material=StandardLinearSolid(modulus_ratio=0.1))
    protocol = ramps(peak, loading, dwell, unloading)
    trajectory = completed(scene, protocol, "standard")
    pull_off, hysteresis = PULL_OFF_AND_HYSTERESIS[number]
    assert trajectory.pull_off_force == pytest.approx(pull_off, rel=5e-3)
    assert trajectory.hysteresis == pytest.approx(hysteresis, rel=5e-3)
