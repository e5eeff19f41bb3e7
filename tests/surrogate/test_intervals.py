"""Models with bands: any standard linear solid, how bands cover, one warning outside, folders that fit together."""

import functools
import random
import shutil
import warnings

import crepes
import numpy as np
import pytest

import surrogate
from bem import HardContact, LoadingProtocol, PronySeries, Scene, StandardLinearSolid, simulate
from bem.dataset.designs import Design
from bem.dataset.measurement_steps import PHYSICAL, measurement_grid
from bem.dataset.physical_steps import physical_grid
from surrogate import ExtrapolationWarning
from surrogate.data.features import channels, edge_from_counts
from surrogate.files import BANDED, PUBLISHED_BANDED
from surrogate.intervals import (
    BANDS,
    CORNERS,
    GROUPS,
    KNOWN,
    LEVELS,
    NEARLY_ELASTIC,
    RESULTS,
    UNSEEN,
    Bands,
    _judged,
    _placed,
    _quantiles,
    result_errors,
    results,
)
from surrogate.loading import load_banded
from surrogate.validity import MARGIN
from tests.data_files import damaged
from tests.surrogate.conftest import PROTOCOL, RANGES, SCENE, scenes

COUNTS = (22, 8, 72)
FILES = ("model.onnx", "scaling.json", "bands.npz", "run.json")
READ = {"pull_off": "pull_off_force"}
LOADING = LoadingProtocol(**PROTOCOL)


def protocol(**changes):
    return LoadingProtocol(**PROTOCOL | changes)


def test_force_is_the_networks_on_its_steps(banded):
    found = banded.predict(SCENE, LOADING)
    assert repr(banded) == "<Surrogate: fast, with bands>"
    times, indentations = physical_grid(tabor=1.0, **PROTOCOL, modulus_ratio=0.1)
    np.testing.assert_array_equal([found.time, found.indentation], [times[0], indentations[0]])
    sequence = channels(times, indentations, edge_from_counts(COUNTS, 1), "F", tabor=np.ones(1), modulus_ratio=0.1)
    told = banded.scaling.scale_tabor(np.ones(1))
    expected = banded.scaling.unscale_force(banded.network.scaled(banded.scaling.scale_channels(sequence), told))
    np.testing.assert_array_equal(found.force, expected[0])
    assert found.pull_off_force >= found.force[29:].max()
    assert found.hysteresis == abs(found.work())
    assert (found.unloading.sum(), found.model, found.modulus_ratio) == (73, "fast", 0.1)
    np.testing.assert_array_equal(banded.predict_history(found.time, found.indentation, SCENE), found.force)


@pytest.mark.parametrize("count", [20, 120])
def test_other_number_of_points_is_refused(banded, count):
    times = np.linspace(0.0, 1.0, count)
    with pytest.raises(ValueError, match=rf"histories must have the 102 steps .* fast knows; received {count} points"):
        banded.predict_history(times, 1.0 - abs(times - 0.5), SCENE)


def test_bands_hold_prediction_and_widen(banded):
    narrow, wide = (banded.predict(SCENE, LOADING, coverage=coverage) for coverage in (0.5, 0.95))
    for found in (narrow, wide):
        for name in RESULTS:
            low, high = getattr(found, f"{name}_interval")
            assert low <= getattr(found, READ.get(name, name)) <= high
            assert low < high or name == "pull_off_time"
        for name in BANDS:
            lower, upper = (getattr(found, f"{name}_{end}") for end in ("lower", "upper"))
            assert np.all((lower < found.force) & (found.force < upper))
        assert np.all(found.curve_upper > found.force_upper)
    assert wide.pull_off_interval[0] < narrow.pull_off_interval[0]
    assert np.all(wide.force_upper >= narrow.force_upper)
    assert narrow.summary()["pull_off_interval"] == list(narrow.pull_off_interval)


def test_a_batch_is_what_its_members_are(banded):
    protocols = [protocol(unloading_rate=float(rate)) for rate in np.geomspace(0.2, 900, 300)]
    solids = scenes(np.linspace(0.3, 3.0, 300), np.geomspace(0.02, 0.9, 300))
    batch = banded.predict(solids, protocols)
    for row in (0, 127, 128, 299):
        alone = banded.predict(solids[row], protocols[row])
        assert batch[row].pull_off_force == pytest.approx(alone.pull_off_force, rel=1e-5)
        assert batch[row].modulus_ratio == solids[row].material.modulus_ratio
        np.testing.assert_array_equal(batch[row].time, alone.time)


@pytest.mark.parametrize(
    ("changes", "tabor", "ratio", "name"),
    [
        ({"unloading_rate": 1300.0}, 1.0, 0.1, "unloading_rate"),
        ({"dwell_time": 0.0}, 1.0, 0.1, "dwell_time"),
        ({}, 3.5, 0.1, "tabor"),
        ({}, 1.0, 0.009, "modulus_ratio"),
        ({"start_indentation": -9.0}, 1.0, 0.1, "start_indentation"),
    ],
)
def test_bands_outside_training_are_infinite(banded, changes, tabor, ratio, name):
    both = scenes([1.0, tabor], [0.1, ratio]), [LOADING, protocol(**changes)]
    with pytest.warns(ExtrapolationWarning, match=rf"1 of 2 protocols lie outside .* of fast.*{name}") as told:
        inside, outside = banded.predict(*both)
    assert (len(told), inside.extrapolated) == (1, ())
    assert told[0].filename == __file__
    assert np.isfinite([getattr(inside, f"{name}_interval") for name in RESULTS]).all()
    assert name in outside.extrapolated[0]
    assert {getattr(outside, f"{name}_interval") for name in RESULTS} == {(-np.inf, np.inf)}
    assert np.all(outside.force_upper == np.inf)
    assert np.all(outside.force_lower == -np.inf)
    assert np.isfinite(outside.pull_off_force)
    assert outside.time.size == 102  # without a dwell, with the shortest one
    assert "pull_off_interval" not in outside.summary()


@pytest.mark.parametrize(("name", "low", "high"), [(name, *RANGES[name]) for name in KNOWN])
def test_beyond_the_margin_is_refused(banded, name, low, high):
    def asked(value):
        values = PROTOCOL | {"tabor": 1.0, "modulus_ratio": 0.1, name: value}
        return Scene(values.pop("tabor"), StandardLinearSolid(values.pop("modulus_ratio"))), LoadingProtocol(**values)

    width = np.log(high / low)
    for end, outwards in ((low, -1.0), (high, 1.0)):
        inside, beyond = (float(end * np.exp(outwards * share * width)) for share in (0.999 * MARGIN, 1.001 * MARGIN))
        if end == 1.0:  # no solid is beyond elastic
            continue
        with pytest.warns(ExtrapolationWarning, match=f"{name} = "):
            assert np.isfinite(banded.predict(*asked(inside)).force).all()
        if (name, end) == ("dwell_time", low):  # no dwell is too short
            continue
        with pytest.raises(
            ValueError, match=rf"^{name} must be from .* for fast, .*; received {beyond:.6g}$"
        ) as caught:
            banded.predict(*asked(beyond))
        assert "\n" not in str(caught.value)


def test_distances_outside_ranges_add_up(banded):
    tabor, rate = (
        float(high * (high / low) ** (0.6 * MARGIN)) for low, high in (RANGES["tabor"], RANGES["loading_rate"])
    )
    for asked in ((scenes([tabor])[0], LOADING), (SCENE, protocol(loading_rate=rate))):
        with pytest.warns(ExtrapolationWarning):
            assert banded.predict(*asked).completed
    with pytest.raises(ValueError, match=r"^\w+ must be from .* for fast"):
        banded.predict(scenes([tabor])[0], protocol(loading_rate=rate))


def test_in_a_batch_what_is_refused_is_nan(banded):
    with pytest.warns(ExtrapolationWarning, match="1 of 3 predictions are refused and NaN: tabor must be") as told:
        inside, refused, margin = banded.predict(scenes([1.0, 9.0, 3.4]), LOADING)
    assert len(told) == 1
    assert inside.completed
    assert margin.completed
    assert refused.status.startswith("tabor must be from 0.1516 to 4.222 for fast")
    results = [refused.pull_off_force, refused.pull_off_time, refused.hysteresis, refused.work(), refused.end_force]
    intervals = [getattr(refused, f"{name}_interval") for name in RESULTS]
    bands = [refused.force, refused.force_lower, refused.force_upper, refused.curve_lower, refused.curve_upper]
    assert np.isnan(np.concatenate([results, *intervals, *bands])).all()
    assert not refused.detached
    np.testing.assert_allclose(banded.predict(SCENE, LOADING).force, inside.force, rtol=1e-5)


def test_points_off_the_steps_are_refused(banded):
    """As many points, equally spaced: their forces would be wrong without a word."""
    path = PROTOCOL | {"tabor": 1.0}
    times, indentations = measurement_grid(**{name: np.array([value]) for name, value in path.items()}, counts=PHYSICAL)
    with pytest.raises(ValueError, match="of its phase away"):
        banded.predict_history(times[0], indentations[0], SCENE)


def test_history_beyond_margin_is_refused(banded):
    found = banded.predict(SCENE, LOADING)
    history = found.time, found.indentation
    with pytest.raises(ValueError, match=r"^tabor must be from .*; received 9$"):
        banded.predict_history(*history, scenes([9.0])[0])
    with pytest.warns(ExtrapolationWarning, match="1 of 2 predictions are refused and NaN: tabor must be"):
        force = banded.predict_history(*np.stack([history, history], axis=1), scenes([9.0, 1.0]))
    assert np.isnan(force[0]).all()
    np.testing.assert_allclose(force[1], found.force, rtol=1e-5)


def test_elastic_solid_has_ratio_one(banded):
    with warnings.catch_warnings(action="error"):
        assert banded.predict(SCENE, []) == []
        elastic, solid = banded.predict([Scene(1.0), Scene(1.0, StandardLinearSolid(1.0))], LOADING)
    assert elastic.modulus_ratio == 1.0
    np.testing.assert_array_equal(elastic.force, solid.force)


def test_elastic_intervals_hold_the_solver():
    columns = Design("log-uniform").protocols(200, seed=3)
    solids = [Scene(tabor) for tabor in columns.pop("tabor").tolist()]
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    protocols = [LoadingProtocol(**dict(zip(columns, row, strict=True))) for row in rows]
    true = [simulate(*one) for one in zip(solids, protocols, strict=True)]
    for name in BANDED:
        found = surrogate.load(name).predict(solids, protocols)
        for result in RESULTS:
            ends = np.array([getattr(one, f"{result}_interval") for one in found]).T
            values = np.array([getattr(one, READ.get(result, result)) for one in true])
            assert np.mean((ends[0] <= values) & (values <= ends[1])) > 0.8, (name, result)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scene": [SCENE] * 3}, "scene must be one, or one for each of 2 histories; received 3"),
        ({"scene": 1.0}, r"scene must be a bem\.Scene; received 1\.0"),
        ({"scene": [SCENE, None]}, "received None as scene 1"),
        ({"scene": Scene(1.0, SCENE.material, HardContact())}, "a paraboloid and no spring.*HardContact"),
        ({"scene": Scene(1.0, SCENE.material, spring=1.0)}, "the solver knows others .*received a spring"),
        ({"scene": Scene(1.0, PronySeries([0.5], times=[1.0]))}, "material must be a standard linear solid"),
        ({"coverage": 1.0}, "coverage must be"),
        ({"protocol": [3, LOADING]}, "protocol must be a LoadingProtocol .*; received 3"),
        ({"protocol": None}, "protocol must be a LoadingProtocol"),
        ({"protocol": [protocol(peak_indentation=-0.5)]}, "must lie above 0"),
    ],
)
def test_bad_input_gets_one_sentence(banded, changes, message):
    with pytest.raises(ValueError, match=message):
        banded.predict(**{"scene": SCENE, "protocol": [LOADING] * 2} | changes)


def test_model_is_found_by_name_and_folder(untrained):
    assert surrogate.load("fast", untrained.parent).bands is not None
    assert surrogate.load(untrained).name == "fast"
    with pytest.raises(FileNotFoundError, match=r"a trained accurate must be in .*`make pretrained` trains it"):
        surrogate.load("accurate", untrained.parent)
    with pytest.raises(ValueError, match="backend must be 'onnx' for fast"):
        surrogate.load("fast", untrained.parent, backend="keras")


@pytest.mark.parametrize("name", FILES)
def test_an_absent_file_is_named(untrained, name):
    (untrained / name).unlink()
    with pytest.raises(FileNotFoundError, match=name):
        load_banded(untrained)


@pytest.mark.parametrize("count", [16, pytest.param(1000, marks=pytest.mark.slow)])
def test_flips_and_cuts_are_refused(count, tmp_path):
    shutil.copytree(PUBLISHED_BANDED, tmp_path, dirs_exist_ok=True)
    files, rng = [tmp_path / model / name for model in BANDED for name in FILES], random.Random(count)
    for number in range(count):
        path = files[number % len(files)]
        content = path.read_bytes()
        path.write_bytes(damaged(content, rng, kinds=("flip", "cut")))
        with pytest.raises(ValueError, match=rf"{path.name}, which is .*damaged") as caught:
            surrogate.load(path.parent.name, tmp_path)
        assert "git restore" in str(caught.value)
        assert "\n" not in str(caught.value)
        path.write_bytes(content)


@pytest.mark.parametrize(
    ("changes", "ratio"),
    [
        ({"unloading_rate": 1.0}, 0.1),
        ({"peak_indentation": 69.0, "loading_rate": 1.2, "dwell_time": 0.003, "unloading_rate": 900.0}, 0.04),
        ({"peak_indentation": 3.0, "loading_rate": 300.0, "dwell_time": 0.1, "unloading_rate": 20.0}, 0.5),
    ],
)
def test_readings_of_solver_forces_are_its(changes, ratio):
    true = simulate(Scene(1.0, StandardLinearSolid(ratio)), protocol(**changes))
    times, indentations = physical_grid(tabor=1.0, **PROTOCOL | changes, modulus_ratio=ratio)
    force = true.at(np.minimum(times[0], true.time[-1]))[np.newaxis]
    found = results(times, indentations, force, np.array(COUNTS))
    (pull_off,), (instant,), (work,), (sharpness,), (unit,) = found
    assert pull_off == pytest.approx(true.pull_off_force, rel=0.02)
    assert pull_off >= force.max()
    assert instant == pytest.approx(true.pull_off_time, rel=0.01)
    assert work == pytest.approx(true.hysteresis, rel=0.05)
    assert 0.0 <= sharpness < 0.5
    assert unit == pytest.approx(work)


def test_small_loop_unit_is_loading_work():
    times, indentations = physical_grid(tabor=1.0, **PROTOCOL, modulus_ratio=0.1)
    # Proportional to the indentation on both ways: no loop.
    found = results(times, indentations, -2.0 * indentations, np.array(COUNTS))
    assert found[2, 0] == pytest.approx(0.0, abs=1e-9)
    assert found[4, 0] == pytest.approx(0.01 * (20.0**2 - indentations[0, 0] ** 2))


BOX = dict.fromkeys(KNOWN, (0.1, 1000.0)) | {"modulus_ratio": (9e-5, 0.9)}


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


def widths_of(bands, known, coverage):
    """Half-widths by name, those of bands at every step."""
    half, rows = bands.half_widths(known, coverage)
    found = dict(zip((*RESULTS, *BANDS), half, strict=True))
    return found | {name: found[name][:, np.newaxis] * bands.shape[rows] for name in BANDS}


@functools.cache
def calibrated(count=20_000, seed=0, fitted=4000, corners=400):
    return Bands.calibrate(BOX, *drawn(count, seed, corners), fitted)


def test_intervals_cover_in_every_corner():
    bands = calibrated(60_000, fitted=8000)
    known, errors, force = drawn(20_000, 1, 300)
    _, corner = _placed(known, bands.ranges)
    assert np.bincount(corner[20_000:]).tolist() == [300] * CORNERS
    box = np.arange(len(known)) < 20_000
    for coverage in (0.5, 0.77, 0.9, 0.99):
        widths = widths_of(bands, known, coverage)
        inside = [error <= widths[name] for name, error in zip(RESULTS, errors, strict=True)]
        inside += [force <= widths["force"], (force <= widths["curve"]).all(axis=1)]
        for chosen in (box & (known[:, 4] > 100.0), box & (known[:, 4] < 1.0)):
            assert all(abs(one[chosen].mean() - coverage) < 0.04 for one in inside)
        for one in inside:
            assert all(one[corner == number].mean() > coverage - 0.08 for number in (0, 7, CORNERS - 1))
    assert np.median(widths["pull_off"][known[:, 4] > 100.0]) > 30.0 * np.median(widths["pull_off"][known[:, 4] < 1.0])


def test_nearly_elastic_intervals_cover():
    def with_elastic(count, seed):
        known, errors, force = drawn(count, seed)
        known[-20_000:, 5] = np.random.default_rng(seed).uniform(0.95, 1.0, 20_000)
        known[-10:, 5] = 1.0
        return known, np.where(known[:, 5] > 0.95, 10.0, 1.0) * errors, force

    bands = Bands.calibrate(BOX, *with_elastic(31_000, 0), 4000)
    known, errors, _ = with_elastic(23_000, 1)
    _, own = _placed(known, bands.ranges)
    for number, low in enumerate(NEARLY_ELASTIC):
        high = [*NEARLY_ELASTIC, 2.0][number + 1]
        np.testing.assert_array_equal(own == CORNERS + GROUPS + number, (low <= known[:, 5]) & (known[:, 5] < high))
        widths = widths_of(bands, known, 0.9)
        for name, error in zip(RESULTS, errors, strict=True):
            assert 0.87 < (error <= widths[name])[own == CORNERS + GROUPS + number].mean() < 0.94


def test_bands_widen_with_coverage():
    bands, (known, *_) = calibrated(), drawn(50, 2)
    before = dict.fromkeys((*RESULTS, *BANDS), 0.0)
    for coverage in (0.3, 0.6, 0.82, 0.9, 0.96, 0.99):
        widths = widths_of(bands, known, coverage)
        assert all(np.all(widths[name] > before[name]) for name in before)
        assert np.all(widths["curve"] > widths["force"])
        before = widths


def test_half_widths_are_those_of_crepes():
    """Another program's normalised Mondrian intervals, at the rank that two standard deviations more give."""
    bands, (known, errors, _) = calibrated(), drawn(20_000, 0, 400)
    known, errors = known[4000:], errors[:, 4000:]
    sizes, _, cells = _judged(known, bands.ranges, bands.coefficients, bands.edges)
    half, _ = bands.half_widths(known, 0.9)
    for row, error in enumerate(errors):
        regressor = crepes.ConformalRegressor().fit(error, sigmas=sizes[row], bins=cells[row])
        for cell in np.unique(cells[row]):
            chosen = np.flatnonzero(cells[row] == cell)
            rank = np.ceil(0.9 * (chosen.size + 1) + 2.0 * np.sqrt(0.09 * chosen.size))
            ends = regressor.predict_int(
                np.zeros(5), sizes[row, chosen[:5]], cells[row, chosen[:5]], confidence=(rank - 0.5) / (chosen.size + 1)
            )
            np.testing.assert_allclose(ends[:, 1], half[row, chosen[:5]], rtol=1e-12)


def test_few_errors_keep_the_band_wide():
    # With so few errors in a group, no band short of the largest error covers 95 %.
    bands = calibrated(15 * GROUPS + 1000, fitted=1000, corners=0)
    assert np.all(bands.quantiles[:3, CORNERS:, 9] == bands.quantiles[:3, CORNERS:, -1])
    assert np.all(bands.quantiles[:, :CORNERS] == UNSEEN)


def test_what_is_stored_gives_the_same_bands():
    bands, (known, *_) = calibrated(4000, fitted=1000), drawn(50, 2)
    again = Bands(**{name: values.astype(np.float64) for name, values in bands.as_arrays().items()})
    np.testing.assert_allclose(
        widths_of(again, known, 0.9)["pull_off"], widths_of(bands, known, 0.9)["pull_off"], rtol=1e-4
    )


def test_quantile_rank_adds_two_deviations():
    assert _quantiles(np.arange(1.0, 1001.0))[LEVELS.index(0.9)] == np.ceil(0.9 * 1001 + 2.0 * np.sqrt(90.0))


def test_errors_have_the_units_of_intervals():
    # Pull-off, time, work, sharpness and unit, of a closed loop and of an open one.
    found = np.array([[2.0, 2.0], [3.0, 3.0], [-4.0, 0.5], [0.1, 0.1], [4.0, 1.0]])
    true = np.array([[2.0, 1.0], [3.0, 5.0], [4.4, 0.3]])
    errors = result_errors(found, true, np.ones(2))
    assert errors == pytest.approx(np.array([[0.0, np.log(2.0)], [0.0, np.log(2.0)], [0.1, 0.2]]))
