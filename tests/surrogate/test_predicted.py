"""Predicted trajectories answer as the solver's do."""

import warnings

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from tests.surrogate.predicting import PROTOCOL


def test_trajectories_resemble_the_solver_s(published):
    model = surrogate.load("M1-concat", published)
    protocols = [LoadingProtocol(**PROTOCOL), LoadingProtocol(**PROTOCOL | {"dwell_time": 0.0})]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with_dwell, without = model.trajectories(protocols, tabor=1.0)
    assert with_dwell.extrapolated == ()
    assert without.extrapolated[0].startswith("dwell_time = 0 lies outside [")
    assert (with_dwell.time.size, without.time.size) == (120, 100)
    assert with_dwell.completed
    assert with_dwell.pull_off_force == with_dwell.force[69:].max()
    assert with_dwell.pull_off_time == with_dwell.time[69 + with_dwell.force[69:].argmax()]
    assert with_dwell.max_compression == with_dwell.force.min()
    loop = np.trapezoid(with_dwell.force, with_dwell.indentation)
    assert with_dwell.hysteresis == pytest.approx(abs(loop), rel=1e-12)
    middle = with_dwell.at(0.5 * (with_dwell.time[3] + with_dwell.time[4]))
    assert min(with_dwell.force[3:5]) <= middle <= max(with_dwell.force[3:5])
    assert with_dwell.at(np.nextafter(with_dwell.time[-1], np.inf)) == with_dwell.end_force
    expected = model.predict(with_dwell.time[None], with_dwell.indentation[None], tabor=1.0)[0]
    np.testing.assert_allclose(with_dwell.force, expected, rtol=1e-6, atol=1e-6)
    moved = model.trajectories(LoadingProtocol(**PROTOCOL, start_indentation=-4.0), tabor=1.0)[0]
    assert "start_indentation = -4" in moved.extrapolated[0]
    with pytest.raises(ValueError, match="Expected LoadingProtocols"):
        model.trajectories([None], tabor=1.0)
    with pytest.raises(ValueError, match="one Tabor parameter per history"):
        model.trajectories(protocols, tabor=[1.0, 2.0, 3.0])
    assert model.trajectories([], tabor=1.0) == []
