"""Predicted trajectories answer as the solver's do."""

import warnings

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from bem.protocol import default_start_indentation
from bem.reference_solutions import dmt
from surrogate import ExtrapolationWarning
from surrogate.cli.comparison import readable
from surrogate.prediction.predicted import FORCE_DOUBT, predicted_trajectory
from tests.surrogate.conftest import scenes
from tests.surrogate.prediction.predicting import PROTOCOL, SCENE


def test_trajectories_resemble_the_solver_s(published):
    model = surrogate.load("M1-concat", published)
    protocols = [LoadingProtocol(**PROTOCOL), LoadingProtocol(**PROTOCOL | {"dwell_time": 0.0})]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with_dwell = model.predict(SCENE, protocols[0])
    with pytest.warns(ExtrapolationWarning, match="1 of 2 protocols lie outside the training of M1-concat: dwell_time"):
        _, without = model.predict(SCENE, protocols)
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
    expected = model.predict_history(with_dwell.time, with_dwell.indentation, SCENE)
    np.testing.assert_allclose(with_dwell.force, expected, rtol=1e-6, atol=1e-6)
    with pytest.warns(ExtrapolationWarning, match="start_indentation"):
        moved = model.predict(SCENE, LoadingProtocol(**PROTOCOL, start_indentation=-4.0))
    assert "start_indentation = -4" in moved.extrapolated[0]


def ending(force, *, depth=-4.0):
    return predicted_trajectory(
        np.arange(3.0),
        np.array([depth, 2.0, depth]),
        np.array([0.0, -3.0, force]),
        unloading_from=1,
        extrapolated=(),
        model="M1-concat",
        seconds=0.0,
    )


def test_detachment_of_a_prediction_follows_from_the_force_alone():
    limit = 4.0 * dmt.rigid_force_from_indentation(-4.0) + FORCE_DOUBT
    assert ending(0.99 * limit).detached
    assert not ending(1.01 * limit).detached
    assert not ending(np.nan).detached
    assert ending(-0.1).summary()["detached"] is True


def test_the_limit_is_right_for_the_published_model():
    """Whatever the models' errors, all but a few ends of the test set are judged as the solver's are."""
    from bem.dataset.file import load_dataset
    from bem.trajectory import far_field

    dataset = load_dataset("published/dataset.h5")
    model = surrogate.load("M1-concat")
    rows = np.random.default_rng(0).permutation(dataset.completed)[:400]
    times, indentations = (values[rows] for values in dataset.grid())
    tabor = dataset.protocols["tabor"][rows]
    ends = model.predict_history(times, indentations, scenes(tabor))[:, -1]
    found = far_field(ends, indentations[:, -1], doubt=FORCE_DOUBT)
    truth = far_field(dataset.scalars["end_force"][rows], default_start_indentation(tabor))
    assert np.mean(found != truth) < 0.03
    assert 0.1 < np.mean(~truth) < 0.3


def test_signed_work_and_attached_contacts_are_told():
    backwards = ending(-9.0)
    assert backwards.work() == backwards.summary()["work"] == -27.0
    assert backwards.hysteresis == 27.0
    attached, line = (readable(0, one, None) for one in (ending(9.0), backwards))
    assert "still attached at the end: the pull-off force is the largest so far" in attached
    assert "work" not in attached
    assert "attached" not in line
    assert ", work -27: the contact gave energy back; not dissipation" in line
