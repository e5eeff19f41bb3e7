"""Pull-off between the limits, beside Maugis's closed form of the same work of adhesion and largest traction.

Lennard-Jones reaches farther than Dugdale's step, so that it pulls a little harder; in both limits the law's shape does
not matter. Source: Maugis, J. Colloid Interface Sci. 150 (1992) 243; Johnson and Greenwood, ibid. 192 (1997) 326.
"""

import numpy as np

from bem import LoadingProtocol, Scene
from bem.reference_solutions import maugis_dugdale
from tests.validation.cases import completed

TABORS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0)


def test_the_shape_of_the_law_is_worth_six_per_cent_at_most_and_nothing_in_the_limits():
    protocol = LoadingProtocol(peak_indentation=2.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
    found = np.array([completed(Scene(tabor=tabor), protocol).pull_off_force for tabor in TABORS])
    excess = found / [maugis_dugdale.pull_off_force(tabor) for tabor in TABORS] - 1.0
    assert np.all((excess > 0.0) & (excess < 0.06)), excess
    middle = np.argmax(excess)
    assert np.all(np.diff(excess[: middle + 1]) > 0.0)
    assert np.all(np.diff(excess[middle:]) < 0.0)
    assert excess[[0, -1]].max() < 0.02
