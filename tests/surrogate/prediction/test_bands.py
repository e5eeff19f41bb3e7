import numpy as np
import pytest

from surrogate.prediction.bands import (
    BANDS,
    CORNERS,
    GROUPS,
    KNOWN,
    NEARLY_ELASTIC,
    RESULTS,
    UNSEEN,
    Bands,
    _placed,
    result_errors,
)

RANGES = dict.fromkeys(KNOWN, (0.1, 1000.0)) | {"modulus_ratio": (9e-5, 0.9)}


def drawn(count, seed, corners=0):
    """Errors that grow with the unloading rate, and in one corner far more than anything smooth says."""
    rng = np.random.default_rng(seed)
    unit = rng.random((count + CORNERS * corners, 7))
    bits = (np.arange(CORNERS * corners)[:, np.newaxis] >> np.arange(6)) & 1
    unit[count:, :6] = 0.2 * unit[count:, :6] + 0.8 * bits
    known = 0.1 * 1e4**unit
    known[:, 5] *= 9e-4
    size = 1e-2 * known[:, 4] * np.where((unit[:, :6] > 0.8).all(axis=1), 10.0, 1.0)
    errors = size * np.abs(rng.normal(size=(3, len(known))))
    return known, errors, size[:, np.newaxis] * np.abs(rng.normal(size=(len(known), 5)))


def calibrated(count=20_000, seed=0, fitted=4000, corners=400):
    return Bands.calibrate(RANGES, *drawn(count, seed, corners), fitted)


def test_intervals_cover_as_asked_in_easy_and_hard_cases_and_in_every_corner():
    bands = calibrated(60_000, fitted=8000)
    known, errors, force = drawn(20_000, 1, 300)
    _, corner = _placed(known, bands.ranges)
    assert np.bincount(corner[20_000:]).tolist() == [300] * CORNERS
    box = np.arange(len(known)) < 20_000
    for coverage in (0.5, 0.77, 0.9, 0.99):
        widths = bands.widths(known, coverage)
        inside = [error <= widths[name] for name, error in zip(RESULTS, errors, strict=True)]
        inside += [force <= widths["force"], (force <= widths["curve"]).all(axis=1)]
        for chosen in (box & (known[:, 4] > 100.0), box & (known[:, 4] < 1.0)):
            assert all(abs(one[chosen].mean() - coverage) < 0.04 for one in inside)
        for one in inside:
            assert all(one[corner == number].mean() > coverage - 0.08 for number in (0, 7, CORNERS - 1))
    assert np.median(widths["pull_off"][known[:, 4] > 100.0]) > 30.0 * np.median(widths["pull_off"][known[:, 4] < 1.0])


def test_intervals_of_nearly_elastic_solids_cover_where_errors_jump():
    def with_elastic(count, seed):
        known, errors, force = drawn(count, seed)
        known[-9000:, 5] = np.random.default_rng(seed).uniform(0.95, 1.0, 9000)
        known[-10:, 5] = 1.0
        return known, np.where(known[:, 5] > 0.95, 10.0, 1.0) * errors, force

    bands = Bands.calibrate(RANGES, *with_elastic(20_000, 0), 4000)
    known, errors, _ = with_elastic(12_000, 1)
    _, own = _placed(known, bands.ranges)
    for number, low in enumerate(NEARLY_ELASTIC):
        high = [*NEARLY_ELASTIC, 2.0][number + 1]
        np.testing.assert_array_equal(own == CORNERS + GROUPS + number, (low <= known[:, 5]) & (known[:, 5] < high))
        widths = bands.widths(known, 0.9)
        for name, error in zip(RESULTS, errors, strict=True):
            assert 0.87 < (error <= widths[name])[own == CORNERS + GROUPS + number].mean() < 0.94


def test_more_coverage_is_a_wider_band_and_the_whole_curve_a_wider_one():
    bands, (known, *_) = calibrated(4000, fitted=1000), drawn(50, 2)
    before = dict.fromkeys((*RESULTS, *BANDS), 0.0)
    for coverage in (0.3, 0.6, 0.82, 0.9, 0.96, 0.99):
        widths = bands.widths(known, coverage)
        assert all(np.all(widths[name] > before[name]) for name in before)
        assert np.all(widths["curve"] > widths["force"])
        before = widths


def test_few_errors_are_no_reason_for_a_narrow_band():
    # With so few errors in a group, no band short of the largest error covers 95 %.
    bands = calibrated(15 * GROUPS + 1000, fitted=1000, corners=0)
    assert np.all(bands.quantiles[:3, CORNERS:, 9] == bands.quantiles[:3, CORNERS:, -1])
    assert np.all(bands.quantiles[:, :CORNERS] == UNSEEN)


def test_what_is_stored_gives_the_same_bands():
    bands, (known, *_) = calibrated(4000, fitted=1000), drawn(50, 2)
    again = Bands(**{name: values.astype(np.float64) for name, values in bands.as_arrays().items()})
    np.testing.assert_allclose(again.widths(known, 0.9)["pull_off"], bands.widths(known, 0.9)["pull_off"], rtol=1e-4)


def test_quantiles_of_other_cells_are_refused():
    bands = calibrated(4000, fitted=1000)
    with pytest.raises(ValueError, match=r"Expected quantiles of shape \(5, 75, 12\)\. Received: shape \(5, 72, 12\)"):
        Bands(**vars(bands) | {"quantiles": bands.quantiles[:, :72]})


def test_errors_are_in_the_units_of_their_intervals():
    # Pull-off, time, sharpness, work and work of loading, of a closed loop and of an open one.
    found = np.array([[2.0, 2.0], [3.0, 3.0], [0.1, 0.1], [-4.0, 0.5], [100.0, 100.0]])
    true = np.array([[2.0, 1.0], [3.0, 5.0], [4.4, 0.3]])
    errors = result_errors(found, true, np.ones(2))
    assert errors == pytest.approx(np.array([[0.0, np.log(2.0)], [0.0, np.log(2.0)], [0.1, 0.2]]))
