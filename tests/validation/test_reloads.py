"""Pulled slowly until the contact is lost, then pressed again fast: the stiff glass feels what is left of the dent."""

import numpy as np
import pytest

from bem import ConstantStress, Exponential, PiecewiseLinearProtocol, Scene, StandardLinearSolid
from tests.validation.cases import completed

HISTORIES = [  # found by a sweep, where the dent once faded by the steps' own rule
    (
        Scene(5.153, StandardLinearSolid(0.01352)),
        [0.0, 1.28525, 8212.62844, 8215.71577, 8216.07323494, 8216.07323629],
        [-0.95147, 34.8174, -7.91855, -26.20764, -36.96037, 3.30679],
    ),
    (
        Scene(3.8234, StandardLinearSolid(0.03829)),
        [0.0, 5.0216, 5.03491, 24.77728, 25.1732, 25.17372],
        [-11.47022, 8.07608, 8.07608, -20.47344, -20.48344, 10.57124],
    ),
    (
        Scene(1.25267, StandardLinearSolid(0.019035)),
        [0.0, 0.74094, 0.76516, 2.95548, 2.96643, 2.966477],
        [-3.75802, 9.05065, 9.05065, -8.25179, -8.26179, 0.7463],
    ),
    (
        Scene(1.65477, StandardLinearSolid(0.07699)),
        [0.0, 10.3446, 16.77562, 45.06851, 46.38142, 46.38272],
        [-4.96431, 6.11606, 6.11606, -9.17545, -9.18545, 1.92352],
    ),
    (
        Scene(1.87747, StandardLinearSolid(0.15606), ConstantStress()),
        [0.0, 0.234659, 10.993057, 192.036651, 192.038246],
        [-3.87747, 1.42933, 1.42933, -3.76072, 2.74401],
    ),
    (
        Scene(4.53652, StandardLinearSolid(0.058296), Exponential()),
        [0.0, 11.16198, 133.69161, 133.691644],
        [-6.53652, 14.62238, -13.54045, 0.13741],
    ),
]


@pytest.mark.parametrize(
    ("scene", "times", "depths"), [pytest.param(*HISTORIES[0], marks=pytest.mark.slow), *HISTORIES[1:]]
)
def test_fast_reload_meets_its_target(scene, times, depths):
    standard, fine = (
        completed(scene, PiecewiseLinearProtocol(times, depths), accuracy) for accuracy in ("standard", 4e-4)
    )
    peaks = [np.min(trajectory.force[trajectory.time >= times[-2]]) for trajectory in (standard, fine)]
    assert peaks[0] == pytest.approx(peaks[1], rel=standard.accuracy)
    assert standard.contact_radius[standard.time == times[-2]].max() == 0.0
