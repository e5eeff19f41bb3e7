"""The protocol behind a noisy history, its corners and its rates."""

import numpy as np
import pytest

from bem import LoadingProtocol
from surrogate.prediction.measured import NotOneCycleError, fit_protocol
from tests.surrogate.prediction.predicting import FAST_WITHDRAWAL, history, unresolved

QUANTITIES = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
WANTED = [getattr(FAST_WITHDRAWAL, name) for name in QUANTITIES]
START = FAST_WITHDRAWAL.start(1.0)


def fitted(*history, names=QUANTITIES, **options):
    """The path and the values of its quantities."""
    found = fit_protocol(*history, **options)
    return found, [found.summary()[name] for name in names]


@pytest.mark.parametrize("points", [(1, 1, 1), (50, 20, 50), (3, 200, 1000), (2000, 7, 40)])
@pytest.mark.parametrize("dwell_time", [0.0, 1e-3, 3.0])
def test_a_history_without_noise_gives_its_protocol(points, dwell_time):
    quantities = dict(zip(QUANTITIES, WANTED, strict=True)) | {"dwell_time": dwell_time}
    times, indentations = history(LoadingProtocol(**quantities), points=points)
    found, values = fitted(times + 7.0, indentations)
    assert found.exact
    assert values == pytest.approx(list(quantities.values()), rel=1e-6, abs=1e-9)
    assert found.corners[0] == 7.0
    assert found.levels[[0, 3]] == pytest.approx(START)


@pytest.mark.parametrize("rates", [(14.4, 0.105, 0.463), (1.98, 0.0122, 0.131), (18.1, 0.00286, 2.09)])
def test_a_short_phase_between_unevenly_spread_points_is_found(rates):
    protocol = LoadingProtocol(**dict(zip(QUANTITIES, (60.0, *rates), strict=True)))
    times, _ = history(protocol, points=(50, 20, 50))
    times = np.unique(np.concatenate([times, np.random.default_rng(0).uniform(0.0, times[-1], 200)]))
    found, values = fitted(times, protocol.history(1.0).indentation_at(times), names=QUANTITIES[1:])
    assert found.exact
    assert values == pytest.approx(rates, rel=1e-4)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("noise", [1e-3, 1e-2])
def test_noise_averages_out(noise, seed):
    found, values = fitted(*history(noise=noise, seed=seed), ends=START)
    assert not found.exact
    assert values == pytest.approx(WANTED, rel=2.0 * noise)
    assert found.levels[[0, 3]].tolist() == [START, START]
    assert found.residual == pytest.approx(noise * 20.0, rel=0.15)
    assert f"{100.0 * found.residual / (found.levels[1] - START):.2g} % of its travel" in found.words()


def test_evenly_sampled_in_time_with_corners_between_points():
    times = np.linspace(0.0, FAST_WITHDRAWAL.phase_times(1.0)[-1], 401)[:-1]
    _, (_, *found) = fitted(times, FAST_WITHDRAWAL.history(1.0).indentation_at(times))
    assert found == [pytest.approx(10.0, rel=1e-3), pytest.approx(1.0, rel=1e-3), pytest.approx(100.0, rel=1e-2)]


def test_expected_ends_are_used_only_if_the_points_agree():
    assert fit_protocol(*history(noise=1e-3), ends=-4.0).levels[0] == pytest.approx(START, abs=0.02)


def test_marks_of_the_dwell_are_its_ends():
    times, indentations = history(points=(2, 3, 2), noise=1e-3)
    edge = np.isin(np.arange(len(times)), (2, 5)).astype(float)
    found = fit_protocol(times, indentations, edge=edge)
    np.testing.assert_array_equal(found.corners, times[[0, 2, 5, 7]])
    with pytest.raises(NotOneCycleError, match=r"marks at \[0, 5\]"):
        fit_protocol(times, indentations, edge=np.isin(np.arange(len(times)), (0, 5)).astype(float))


def test_too_few_points_of_a_ramp_are_refused_with_advice():
    with pytest.raises(ValueError, match=r"4 points in loading and in unloading.*column edge, or.*, 2 in unloading"):
        fit_protocol(*unresolved())


def test_corners_are_where_the_sampling_changes_unless_the_points_contradict():
    # The unloading is so slow that noise hides when it begins.
    slow = LoadingProtocol(peak_indentation=50.0, loading_rate=100.0, dwell_time=0.1, unloading_rate=0.1)
    times, indentations = history(slow, noise=1e-3)
    assert fitted(times, indentations)[1][2] == pytest.approx(0.1, rel=1e-9)
    # Here it changes before the peak is reached.
    uneven = np.concatenate([times[:100], np.linspace(times[100], times[240], 40, endpoint=False), times[240:]])
    noisy = slow.history(1.0).indentation_at(uneven) + 0.05 * np.random.default_rng(0).normal(size=uneven.shape)
    assert fitted(uneven, noisy)[1][1] == pytest.approx(100.0, rel=0.01)


TIMES = np.linspace(0.0, 4.0, 400)


@pytest.mark.parametrize(
    "indentations",
    [
        np.abs(np.sin(np.pi * TIMES / 2.0)) * 20.0 - 2.0,
        20.0 * np.sin(np.pi * TIMES / 4.0),
        -20.0 * np.sin(np.pi * TIMES / 4.0),
        np.full(400, 3.0),
        np.minimum(TIMES, 1.0),
        np.interp(TIMES, [0, 1, 1.5, 2.5, 3, 4], [-2, 10, 10, 20, 20, -2]),
        np.interp(TIMES, [0, 1, 2, 4], [-2, 20, 20, -2]) + 3.0 * np.random.default_rng(0).normal(size=400),
    ],
    ids=["two cycles", "a sine", "upside down", "constant", "never back", "two steps", "all noise"],
)
def test_histories_that_are_not_one_cycle(indentations):
    with pytest.raises(NotOneCycleError, match="Expected one cycle of"):
        fit_protocol(TIMES, indentations)
    with pytest.raises(NotOneCycleError, match="three points"):
        fit_protocol(TIMES[:2], indentations[:2])


def test_a_long_history_is_fitted():
    _, found = fitted(*history(points=(30_000, 500, 15_000), noise=1e-2), ends=START)
    assert found == pytest.approx(WANTED, rel=1e-3)


def test_a_longer_dwell_grows_around_its_middle():
    found, (_, _, dwell_time, _) = fitted(*history(points=(50, 20, 50)))
    begin, first, second, end = found.corners
    np.testing.assert_allclose(found.with_dwell(dwell_time + 0.02).corners, [begin, first - 0.01, second + 0.01, end])
    # At most a tenth of each ramp is given up.
    expected = [begin, first - 0.1 * (first - begin), second + 0.1 * (end - second), end]
    np.testing.assert_allclose(found.with_dwell(1e6).corners, expected)


@pytest.mark.parametrize(("bulge", "noise", "refused"), [(0.01, 0, 0), (0.1, 0, 1), (0, 0.03, 0), (0, 0.08, 1)])
def test_a_bent_ramp_is_another_path_and_noise_may_not_hide_the_path(bulge, noise, refused):
    times, indentations = history(noise=noise)
    loading = times < times[160]
    indentations[loading] += bulge * np.ptp(indentations) * np.sin(np.pi * times[loading] / times[160])
    if refused:
        with pytest.raises(NotOneCycleError, match=r"Expected one cycle of.*from the nearest such path"):
            fit_protocol(times, indentations)
    else:
        assert fitted(times, indentations)[1][0] == pytest.approx(20.0, rel=0.02)
