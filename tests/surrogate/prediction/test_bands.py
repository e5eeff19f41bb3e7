import numpy as np

from surrogate.prediction.bands import GROUPS, Bands


def drawn(count, seed):
    """Errors that grow with the unloading rate, as where steps are too long for the peak."""
    rng = np.random.default_rng(seed)
    quantities = np.exp(rng.uniform(np.log(0.1), np.log(1000.0), (count, 7)))
    size = 1e-2 * quantities[:, 4]
    return quantities, size * np.abs(rng.normal(size=count)), size[:, np.newaxis] * np.abs(rng.normal(size=(count, 5)))


def test_bands_cover_as_asked_in_easy_and_hard_cases():
    bands = Bands.calibrate(*drawn(20_000, 0), fitted=4000)
    quantities, pull_off, force = drawn(20_000, 1)
    for coverage in (0.5, 0.77, 0.9, 0.99):
        width, widths = bands.widths(quantities, coverage)
        for chosen in (quantities[:, 4] > 100.0, quantities[:, 4] < 1.0):
            assert abs(np.mean(pull_off[chosen] <= width[chosen]) - coverage) < 0.04
            assert abs(np.mean(force[chosen] <= widths[chosen]) - coverage) < 0.04
        assert np.median(width[quantities[:, 4] > 100.0]) > 30.0 * np.median(width[quantities[:, 4] < 1.0])


def test_more_coverage_is_a_wider_band():
    bands = Bands.calibrate(*drawn(2000, 0), fitted=500)
    quantities, *_ = drawn(50, 2)
    before = np.zeros(50)
    for coverage in (0.3, 0.6, 0.82, 0.9, 0.96, 0.99):
        width, _ = bands.widths(quantities, coverage)
        assert np.all(width > before)
        before = width


def test_few_errors_are_no_reason_for_a_narrow_band():
    # With nineteen errors in a group, no band short of the largest error covers 95 %.
    quantities, pull_off, force = drawn(19 * GROUPS + 100, 3)
    bands = Bands.calibrate(quantities, pull_off, force, fitted=100)
    assert np.all(bands.pull_off[:, 9] == bands.pull_off[:, -1])


def test_what_is_stored_gives_the_same_bands():
    bands = Bands.calibrate(*drawn(2000, 0), fitted=500)
    quantities, *_ = drawn(50, 2)
    again = Bands(**{name: values.astype(np.float64) for name, values in bands.as_arrays().items()})
    np.testing.assert_allclose(again.widths(quantities, 0.9)[0], bands.widths(quantities, 0.9)[0], rtol=1e-5)
