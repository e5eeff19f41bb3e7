"""Where an edge is sought first, and next."""

import numpy as np
import pytest

from bem.methods.sharp_crack.edge import between, first_travel


def test_first_travel_is_short_of_the_usual_and_never_far():
    """A longer one could step over the first place at which the edge is held."""
    assert 0.0 < first_travel(0.0) < 1e-6
    assert 0.0 < first_travel(0.01) < 0.01
    assert first_travel(np.inf) <= 1e-3


@pytest.mark.parametrize("trial", range(4))
def test_next_place_lies_between_two_of_opposite_sign(trial):
    place = between(1.0, -1.0, 2.0, 3.0, trial)
    assert place == pytest.approx(1.5 if trial == 3 else 1.25)
    assert between(1.0, 0.0, 2.0, 0.0, trial) == 1.5
