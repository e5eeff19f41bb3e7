"""Tables between those of two modulus ratios, for a search that asks for hundreds of ratios."""

import numpy as np
import pytest

from bem import PiecewiseLinearProtocol, Scene, StandardLinearSolid, simulate
from bem.methods.sharp_crack.edge_law import interpolated_tables


@pytest.mark.parametrize("ratio", [0.34, 0.17])
def test_forces_by_interpolated_tables_are_those_of_the_solid(ratio):
    """Midway between two solids, where linear interpolation errs most, loaded, held and pulled off fast."""
    scene = Scene(tabor=900.0, material=StandardLinearSolid(ratio))
    path = PiecewiseLinearProtocol([0.0, 10.0, 15.0, 16.0], [-2000.0, 4000.0, 4000.0, -9000.0])
    exact = simulate(scene, path, "draft")
    with interpolated_tables():
        between = simulate(scene, path, "draft")
    assert exact.stats.method == between.stats.method == "sharp crack"
    assert between.pull_off_force == pytest.approx(exact.pull_off_force, rel=2e-4)
    assert between.hysteresis == pytest.approx(exact.hysteresis, rel=2e-4)
    assert not np.array_equal(between.force, exact.force)
