"""What `surrogate predict --check` says of a prediction beside the solver."""

import numpy as np

from bem import PiecewiseLinearProtocol, Scene, StandardLinearSolid, simulate
from surrogate.cli.comparison import solver_errors
from surrogate.inference.predicted import predicted_trajectory


def test_of_several_cycles_the_last_unloading_is_compared():
    # The first is pulled off faster, and so holds on more strongly; the second goes deeper.
    instants, depths = np.array([0.0, 1.0, 1.1, 2.1, 12.1]), np.array([-3.0, 5.0, -3.0, 6.0, -3.0])
    simulated = simulate(
        Scene(1.0, StandardLinearSolid(modulus_ratio=0.1)), PiecewiseLinearProtocol(instants, depths), "draft"
    )
    times = np.unique(np.concatenate([instants, np.linspace(0.0, 12.1, 2000)]))
    predicted = predicted_trajectory(
        times,
        np.interp(times, instants, depths),
        simulated.at(times),
        unloading_from=int(np.searchsorted(times, 2.1)),
        extrapolated=(),
        model="the solver itself",
        seconds=0.0,
    )
    assert simulated.pull_off_force > 1.5 * predicted.pull_off_force
    assert solver_errors(predicted, simulated)["pull_off_percent"] < 1.0
