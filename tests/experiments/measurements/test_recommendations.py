"""How often a recommendation keeps its promise, on one case of every sample."""

import numpy as np
import pytest

from bem import LoadingProtocol
from experiments.measurements import recommendations


@pytest.mark.parametrize("name", recommendations.SAMPLES)
def test_recommendations_are_checked(name):
    (case,) = recommendations.sample(name, 1)
    row = recommendations.checked(*case, 0.1, "force")
    assert row["kept"] is (True if row["simplified"] else None)
    found = recommendations.summary([row])
    assert (found["cases"], found["simplified"], found["kept"]) == (1, row["simplified"], row["simplified"])


def test_what_is_kept_is_counted_and_two_loads_are_at_the_rates_of_the_protocol():
    full = {"simplified": False, "kept": None, "error": None, "ratio": None}
    simple = {"simplified": True, "kept": True, "error": 0.01, "ratio": 0.5, "full_seconds": 1.0}
    common = {"found_by": "estimate", "seconds": 0.1}
    found = recommendations.summary([full | common, simple | common, simple | common | {"kept": False, "ratio": 2.0}])
    assert (found["simplified"], found["kept"], found["slower"], found["worst_error"]) == (2, 1, 1, 0.01)
    assert recommendations.summary([full | common])["worst_error"] is None
    ramps = {"peak_indentation": 5.0, "loading_rate": 2.0, "dwell_time": 1.0, "unloading_rate": 4.0}
    found = recommendations.two_loads(LoadingProtocol(**ramps), 1.0, 0.5)
    assert np.diff(found.indentations) / np.diff(found.times) == pytest.approx([2.0, -4.0, 2.0, -4.0])
