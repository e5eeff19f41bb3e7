"""The JKR branch, approached as the Tabor parameter grows (Johnson, Kendall and Roberts, 1971)."""

import numpy as np

from bem import LoadingProtocol, PiecewiseLinearProtocol, Scene, simulate
from bem.reference_solutions import jkr
from tests.validation.cases import completed

TABORS = (1.0, 2.0, 3.0, 5.0)
RADII = np.array([4.0, 5.0, 6.0])  # deep in the compressive branch


def test_the_error_falls_as_adhesion_becomes_short_ranged_to_two_per_cent_at_five():
    """The error of the force against JKR at the same contact radii by JKR, for each Tabor parameter."""
    errors = []
    for tabor in TABORS:
        depths = jkr.indentation_from_contact_radius(RADII, tabor)
        path = PiecewiseLinearProtocol([0.0, 1.0], [0.0, 1.01 * depths[-1]])
        trajectory = completed(Scene(tabor=tabor), path, "standard")
        assert depths[0] > 0.0
        exact = jkr.force_from_indentation(depths, tabor)
        assert np.all(exact < 0.0)
        errors.append(np.max(np.abs(trajectory.at(depths / path.indentations[-1]) / exact - 1.0)))
    assert np.all(np.diff(errors) < 0.0), errors
    assert errors[-1] < 0.02


def test_the_neck_before_pull_off_is_that_of_jkr():
    worst = []
    for tabor in TABORS[1:]:
        protocol = LoadingProtocol(peak_indentation=5.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
        trajectory = simulate(Scene(tabor=tabor), protocol)
        fold = jkr.fold_indentation(tabor)
        assert 1.0 < trajectory.jumps[-1].indentation / fold < 1.06
        depths = fold * np.array([0.8, 0.6, 0.4, 0.2])
        away = trajectory.unloading
        found = np.interp(depths, trajectory.indentation[away][::-1], trajectory.force[away][::-1])
        worst.append(np.max(np.abs(found / jkr.force_from_indentation(depths, tabor) - 1.0)))
    assert np.all(np.diff(worst) < 0.0), worst
    assert worst[-1] < 0.03
