import numpy as np
import pytest

from surrogate.inference.validity import RANGE_TOLERANCE, excesses


@pytest.mark.parametrize(("low", "high"), [(1e-3, 3.0), (2.0, 1e6)])
@pytest.mark.parametrize("share", [0.5, 2.0])
def test_a_bound_is_kept_to_rounding_of_its_own_size(low, high, share):
    step = share * RANGE_TOLERANCE
    values = np.array([low * (1.0 - step), low, high, high * (1.0 + step), np.nan])
    found = excesses({"dwell_time": values}, {"dwell_time": (low, high)})
    outside = np.zeros(5, dtype=bool) if not found else found[0].beyond > 0.0
    assert outside.tolist() == [share > 1.0, False, False, share > 1.0, False]
