"""A contact dissipates energy: no protocol that returns to its start gets more out of it than it put in."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bem import Elastic, HardContact, LennardJones, PiecewiseLinearProtocol, Scene, simulate
from bem.problem.materials import PronySeries, StandardLinearSolid
from tests.validation.cases import completed, exchanged_energy, ramps

CREATED = 5e-3  # of the energy exchanged, what discretisation may seem to create at draft accuracy

logs = st.floats(-2.0, 3.0).map(lambda exponent: 10.0**exponent)
materials = st.one_of(
    st.just(Elastic()),
    st.floats(-3.0, 0.0).map(lambda exponent: StandardLinearSolid(10.0**exponent)),
    st.lists(st.floats(0.05, 0.3), min_size=2, max_size=3).map(
        lambda strengths: PronySeries(strengths, 10.0 ** np.arange(-1.0, len(strengths) - 1.0))
    ),
)


@settings(max_examples=50)
@given(
    tabor=st.floats(0.02, 3.0),
    material=materials,
    adhesion=st.sampled_from([LennardJones(), HardContact()]),
    peak=st.floats(-1.0, 30.0),
    loading=logs,
    dwell=st.sampled_from([0.0, 0.01, 10.0]),
    unloading=logs,
)
def test_every_loop_dissipates(tabor, material, adhesion, peak, loading, dwell, unloading):
    protocol = ramps(peak, loading, dwell, unloading)
    assume(protocol.start(tabor) < peak)
    trajectory = completed(Scene(tabor=tabor, material=material, adhesion=adhesion), protocol, "draft")
    assert trajectory.work() >= -CREATED * exchanged_energy(trajectory)
    assert all(np.all(np.isfinite(column.values)) for column in trajectory.columns().values())
    assert np.all(np.diff(trajectory.time) >= 0.0)
    history = protocol.history(tabor)
    # an instant is rounded with the whole duration, and the indentation moves on meanwhile
    moved = 4.0 * np.finfo(float).eps * history.times[-1] * max(loading, unloading)
    at = history.indentation_at(trajectory.time)
    np.testing.assert_allclose(trajectory.indentation, at, atol=1e-9 * np.ptp(history.indentations) + moved)
    assert trajectory.max_compression <= trajectory.end_force <= trajectory.pull_off_force
    assert trajectory.pull_off_force < 2.2 / material.modulus_ratio
    assert len(trajectory.time) - len(np.unique(trajectory.time)) == len(trajectory.jumps)


@settings(max_examples=15)
@given(
    depths=st.lists(st.floats(-3.0, 6.0), min_size=2, max_size=4),
    durations=st.lists(st.floats(-2.0, 2.0), min_size=5, max_size=5),
    ratio=st.floats(0.01, 1.0),
)
def test_so_does_any_closed_history(depths, durations, ratio):
    start = -(np.pi ** (2.0 / 3.0))
    path = [start, *depths, start]
    times = np.append(0.0, np.cumsum(10.0 ** np.array(durations)))[: len(path)]
    scene = Scene(tabor=1.0, material=StandardLinearSolid(ratio))
    trajectory = completed(scene, PiecewiseLinearProtocol(times, path), "draft")
    assert trajectory.work() >= -CREATED * exchanged_energy(trajectory)


def test_dissipation_peaks_between_limits():
    """Neither very slow nor very fast loops dissipate much; in between the lag does."""
    rates = 10.0 ** np.arange(-4.0, 5.0, 2.0)
    scene = Scene(tabor=0.2, material=StandardLinearSolid(0.1))
    work = []
    for rate in rates:
        protocol = ramps(5.0, rate, 0.0, rate)
        work.append(simulate(scene, protocol, "standard").work())
    assert np.argmax(work) in (2, 3)
    assert max(work[0], work[-1]) < 0.03 * max(work)
