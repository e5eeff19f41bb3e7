"""Intervals and bands of models of any linear solid: what they contain, and when they are wide."""

import random as python_random
import shutil
import warnings

import crepes
import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol, Scene, simulate
from bem.dataset.designs import Design
from surrogate.files import PRETRAINED, PUBLISHED_PRETRAINED
from surrogate.intervals import GROUPS, KINDS, LEVELS, UNSEEN, SolidIntervals, _quantiles, kinds_of
from surrogate.trajectory import INTERVALS
from surrogate.validity import ExtrapolationWarning
from tests.data_files import damaged


@pytest.mark.parametrize(
    ("times", "kind"),
    [
        ([], 3),
        ([1.0], 0),
        ([1.0, 9e3], 0),
        ([1.0, 2e4], 1),
        ([1.0, 2.0, 3.0, 4.0, 5.0], 2),
        ([1.0, 9.0, 1e2, 1e3, 1e9], 1),
    ],
)
def test_kinds_are_few_close_times_far_ones_and_many(times, kind):
    padded = np.array([[*times, *[1.0] * (5 - len(times))]])
    assert kinds_of(np.where(np.arange(5) < len(times), 0.1, 0.0)[np.newaxis], padded) == [kind]


def noisy(random, count):
    """Features whose errors grow with the first of them, more for broad spectra; those of the curve along the steps."""
    features, kinds = random.normal(size=(count, 3)), random.choice([0, 1], count)
    sizes = np.exp(features[:, :1]) * (1.0 + kinds)[:, np.newaxis]
    return (
        features,
        kinds,
        sizes * random.normal(size=(count, 2)),
        sizes * random.normal(size=(count, 6)) * np.arange(6),
    )


def test_intervals_and_bands_cover_every_group_and_kind():
    random = np.random.default_rng(3)
    features, _, *errors = noisy(random, 20_000)
    intervals = SolidIntervals.fit(features, *errors).calibrated(*noisy(random, 20_000))
    features, kinds, errors, curve_errors = noisy(random, 20_000)
    half, shape = intervals.half_widths(features, kinds, 0.9)
    results = np.abs(errors) <= half[:, :2]
    steps, curves = (np.abs(curve_errors) <= shape * half[:, row, np.newaxis] for row in (2, 3))
    _, groups = intervals.sizes_and_groups(features)
    for kind in (kinds == 0, kinds == 1):
        for group in range(5):
            assert 0.87 < results[(groups[:, 0] == group) & kind, 0].mean() < 0.95
            members = (groups[:, 2] == group) & kind
            assert 0.87 < steps[members].mean() < 0.95
            members = (groups[:, 3] == group) & kind
            assert 0.87 < curves[members].all(axis=1).mean() < 0.95
    # Errors grow along the steps, and so do the bands.
    assert np.all(np.diff(shape, axis=1) > 0.0)
    again = SolidIntervals.of_arrays(intervals.as_arrays())
    for values, expected in zip(again.half_widths(features, kinds, 0.9), (half, shape), strict=True):
        np.testing.assert_array_equal(values, expected)


def test_kind_without_calibration_has_wide_intervals():
    random = np.random.default_rng(4)
    features, _, *errors = noisy(random, 2_000)
    intervals = SolidIntervals.fit(features, *errors)
    intervals = intervals.calibrated(features, np.zeros(len(features), int), *errors)
    few, many = (intervals.half_widths(features, np.full(len(features), kind), 0.9)[0] for kind in (0, 2))
    assert np.all(many > 50.0 * few)
    assert len(KINDS) == 4


def test_half_widths_are_those_of_crepes():
    """Another program's normalised Mondrian intervals, at the rank that two standard deviations more give."""
    random = np.random.default_rng(7)
    features, _, *errors = noisy(random, 10_000)
    intervals = SolidIntervals.fit(features, *errors)
    features, kinds, *errors = noisy(random, 10_000)
    half, _ = intervals.calibrated(features, kinds, *errors).half_widths(features, kinds, 0.9)
    sizes, groups = intervals.sizes_and_groups(features)
    for target in range(2):
        cells = groups[:, target] + GROUPS * kinds
        regressor = crepes.ConformalRegressor().fit(errors[0][:, target], sigmas=sizes[:, target], bins=cells)
        for cell in np.unique(cells):
            chosen = np.flatnonzero(cells == cell)
            rank = np.ceil(0.9 * (chosen.size + 1) + 2.0 * np.sqrt(0.09 * chosen.size))
            ends = regressor.predict_int(
                np.zeros(5), sizes[chosen[:5], target], cells[chosen[:5]], confidence=(rank - 0.5) / (chosen.size + 1)
            )
            np.testing.assert_allclose(ends[:, 1], half[chosen[:5], target], rtol=1e-12)


def test_intervals_widen_with_coverage():
    random = np.random.default_rng(8)
    features, kinds, *errors = noisy(random, 5_000)
    intervals = SolidIntervals.fit(features, *errors).calibrated(features, kinds, *errors)
    before = np.zeros((len(features), 4))
    for coverage in (0.3, 0.6, 0.82, 0.9, 0.96, 0.99):
        half, _ = intervals.half_widths(features, kinds, coverage)
        assert np.all(half > before)
        before = half


def test_few_errors_keep_intervals_wide():
    random = np.random.default_rng(9)
    features, _, *errors = noisy(random, 1_000)
    intervals = SolidIntervals.fit(features, *errors)
    intervals = intervals.calibrated(features[:60], np.zeros(60, int), *(values[:60] for values in errors))
    # With a dozen errors in a group, no interval short of the largest error covers 95 %.
    at = LEVELS.index(0.95)
    np.testing.assert_array_equal(intervals.quantiles[0, :2, :, at], intervals.quantiles[0, :2, :, -1])
    assert np.all(intervals.quantiles[1:] == UNSEEN)


def test_quantile_rank_adds_two_deviations():
    assert _quantiles(np.arange(1.0, 1001.0))[LEVELS.index(0.9)] == np.ceil(0.9 * 1001 + 2.0 * np.sqrt(90.0))


def test_intervals_of_elastic_contacts_hold_the_solver():
    columns = Design("log-uniform").protocols(200, seed=3)
    solids = [Scene(tabor) for tabor in columns.pop("tabor").tolist()]
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    protocols = [LoadingProtocol(**dict(zip(columns, row, strict=True))) for row in rows]
    true = [simulate(*case) for case in zip(solids, protocols, strict=True)]
    for name in PRETRAINED:
        with warnings.catch_warnings(action="ignore", category=ExtrapolationWarning):
            predictions = surrogate.load(name).predict(solids, protocols)
        for interval, result in zip(INTERVALS, ("pull_off_force", "pull_off_time", "hysteresis"), strict=True):
            low, high = np.array([getattr(prediction, interval) for prediction in predictions]).T
            values = np.array([getattr(trajectory, result) for trajectory in true])
            assert np.mean((low <= values) & (values <= high)) > 0.8, (name, result)


@pytest.mark.parametrize("count", [16, pytest.param(1000, marks=pytest.mark.slow)])
def test_flips_and_cuts_are_refused(count, tmp_path):
    shutil.copytree(PUBLISHED_PRETRAINED, tmp_path, dirs_exist_ok=True)
    names = ("run.json", "stages.npz", "intervals.npz")
    files, random = [tmp_path / model / name for model in PRETRAINED for name in names], python_random.Random(count)
    for number in range(count):
        path = files[number % len(files)]
        content = path.read_bytes()
        path.write_bytes(damaged(content, random, kinds=("flip", "cut")))
        with pytest.raises(ValueError, match=rf"{path.name}, which is .*damaged") as caught:
            surrogate.load(path.parent.name, tmp_path)
        assert "git restore" in str(caught.value)
        assert "\n" not in str(caught.value)
        path.write_bytes(content)
