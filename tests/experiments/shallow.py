"""Hidden protocols that the solver computes quickly."""

import numpy as np

from experiments.measurements.cases import Hidden

DRAW = Hidden.draw


def shallow(count, ratio, *seed):
    """In place of `Hidden.draw`: the shallowest of forty times as many."""
    drawn = DRAW(40 * count, ratio, *seed)
    return drawn.part(np.argsort(drawn.quantities["peak_indentation"])[:count])
