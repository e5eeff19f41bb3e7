"""A model of any linear solid: its features, a short training, and what it predicts."""

from dataclasses import replace

import numpy as np
import pytest

from bem import LoadingProtocol, PronySeries, Scene, StandardLinearSolid
from bem.dataset.campaign import Campaign
from bem.dataset.designs import Design
from bem.dataset.file import load_dataset
from bem.dataset.lee_radok import relaxation_spectra
from bem.dataset.solids import Solids
from surrogate.data.dense import Stage
from surrogate.data.fronts import front_steps, places
from surrogate.data.polynomial import Polynomial
from surrogate.data.reach import Reach
from surrogate.data.solid_features import FEATURES, forces_without_adhesion, solid_features
from surrogate.intervals import SolidIntervals
from surrogate.solids import (
    SCALARS,
    SolidSurrogate,
    curve_of,
    curve_targets,
    scalar_targets,
    scalars_of,
    write_intervals,
)
from surrogate.validity import ExtrapolationWarning
from tests.bem.dataset.helpers import run_here

PROTOCOL = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0, dwell_time=1.0, unloading_rate=10.0)
SOLID = PronySeries([0.3, 0.4], [0.1, 10.0])


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    path = tmp_path_factory.mktemp("solids") / "solids.h5"
    design = Design("sobol", {}, (0.01, 1.0), Solids())
    run_here(Campaign(design=design, count=64, counts=(22, 8, 72), steps="pull-off", accuracy="draft"), path)
    return path


@pytest.fixture(scope="module")
def folder(data):
    pytest.importorskip("keras")
    from surrogate.training.solids import RECIPE, SolidData, train

    recipe = replace(RECIPE, epochs=3, batch_size=16)
    return train(SolidData.load([data]), data.parent / "runs", data.parent / "model", recipes=(recipe, recipe))


@pytest.fixture(scope="module")
def model(folder):
    return SolidSurrogate.load(folder)


def quantities(protocol=PROTOCOL, tabor=1.0):
    names = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
    return {"tabor": np.array([tabor])} | {name: np.array([getattr(protocol, name)]) for name in names}


def features_of(strengths, times):
    return solid_features(quantities(), np.array([strengths]), np.array([times]))


def test_features_of_a_split_term_are_the_same():
    whole, split = features_of([0.9], [1.0]), features_of([0.4, 0.5, 0.0], [1.0, 1.0 + 1e-7, 1.0])
    np.testing.assert_allclose(split, whole, atol=1e-5)
    assert whole.shape == (1, len(FEATURES))
    assert np.abs(features_of([0.9], [3.0]) - whole).max() > 0.1


def test_features_know_no_unit_of_time():
    slower = {name: values / (7.0 if name.endswith("rate") else 1.0) for name, values in quantities().items()}
    slower["dwell_time"] = 7.0 * slower["dwell_time"]
    features = solid_features(slower, np.array([[0.4, 0.5]]), np.array([[0.7, 70.0]]))
    np.testing.assert_allclose(features, features_of([0.4, 0.5], [0.1, 10.0]), atol=1e-9)


def test_features_of_an_elastic_solid_have_no_memory():
    values = dict(zip(FEATURES, features_of([0.0], [1.0])[0], strict=True))
    for name in ("modulus_ratio", "peak_force", "held_force", "travel_to_crossing", "relaxation_at_crossing"):
        assert values[name] == pytest.approx(0.0, abs=1e-12)
    assert values["recovery_0"] == pytest.approx(np.log(1e-2))


def test_force_of_a_fast_push_is_the_instantaneous_one():
    depths, times = np.linspace(0.0, 4.0, 30)[np.newaxis], np.linspace(0.0, 1e-6, 30)[np.newaxis]
    spectra = relaxation_spectra(np.array([[0.5, 0.3]]), np.array([[0.5, 20.0]]))
    force = forces_without_adhesion(times, depths, np.array([2.0]), *spectra)
    np.testing.assert_allclose(force, -4.0 / (3.0 * np.pi) * 2.0**-1.5 * depths**1.5 / 0.2, rtol=1e-5)


def test_targets_turn_back_into_scalars():
    scalars = dict(zip(SCALARS, np.array([[2.0, 9.0, 30.0, -40.0], [1.5, 8.0, 0.2, 0.01]]).T, strict=True))
    begin, rate = np.array([5.0, 7.0]), np.array([10.0, 0.2])
    again = scalars_of(scalar_targets(scalars, begin, rate), begin, rate)
    for name, values in scalars.items():
        np.testing.assert_allclose(again[name], values, rtol=1e-12)


def test_polynomial_has_what_is_quadratic():
    features = np.random.default_rng(0).normal(3.0, 2.0, (4000, 4))
    targets = np.stack([features[:, 0] * features[:, 2], 1.0 - features[:, 3] ** 2], axis=1)
    polynomial = Polynomial.fit(features, targets)
    np.testing.assert_allclose(polynomial(features), targets, atol=5e-3 * np.std(targets))


def test_stage_is_polynomial_and_network():
    pytest.importorskip("keras")
    from surrogate.training.solids import network, stage_of

    random = np.random.default_rng(1)
    features, targets = random.normal(2.0, 3.0, (300, 5)), random.normal(size=(300, 2))
    polynomial, model = Polynomial.fit(features, targets), network(5, 2, (8, 8))
    z = polynomial.standardised(features)
    left = np.asarray(model.predict_on_batch([z[:, np.newaxis, 1:], z[:, :1]]))[:, 0]
    expected = polynomial(features) + left * polynomial.scale + polynomial.offset
    stage = stage_of(polynomial, model)
    np.testing.assert_allclose(stage(features), expected, atol=1e-5)
    again = Stage.of_arrays(stage.as_arrays("own") | stage.as_arrays("another"), "own")
    np.testing.assert_allclose(again(features), expected, atol=1e-4)


def test_fronts_of_a_stage_are_those_of_its_network():
    pytest.importorskip("keras")
    from surrogate.training.solids import network, stage_of

    random = np.random.default_rng(2)
    features, targets = random.normal(2.0, 3.0, (30, 5)), random.normal(size=(30, 9))
    polynomial = Polynomial.fit(features, targets)
    model = network(5, 9, (8, 8), ((1, 4), (7, 9)))
    z, where = polynomial.standardised(features), random.normal(size=(30, 5, 3)).astype(np.float32)
    left = model.predict_on_batch([np.column_stack([z[:, 1:], where.reshape(30, -1)])[:, np.newaxis], z[:, :1]])
    expected = polynomial(features) + np.asarray(left)[:, 0] * polynomial.scale + polynomial.offset
    fronts = [(slice(1, 4), where[:, :3]), (slice(7, 9), where[:, 3:])]
    stage = stage_of(polynomial, model)
    np.testing.assert_allclose(stage(features, fronts), expected, atol=1e-5)
    again = Stage.of_arrays(stage.as_arrays("own"), "own")
    np.testing.assert_allclose(again(features, fronts), expected, atol=1e-4)
    elsewhere = [(steps, place + 1.0) for steps, place in fronts]
    changed = np.abs(again(features, elsewhere) - again(features, fronts)).max(axis=0) > 1e-3
    assert changed.tolist() == [False, True, True, True, False, False, False, True, True]


def test_targets_turn_back_into_forces():
    force, without = np.array([[0.1, -300.0, 1.2, 0.6]]), np.array([[0.0, -290.0, -0.5, 0.0]])
    targets = curve_targets(force, without, np.array([7.0]), (1, 1, 2))
    np.testing.assert_allclose(curve_of(targets, without, np.array([7.0]), (1, 1, 2)), force, rtol=1e-12)
    # Nothing before the unloading knows the pull-off.
    other = curve_targets(force, without, np.array([1.0]), (1, 1, 2))
    np.testing.assert_array_equal(other[:, :2], targets[:, :2])
    assert (other[:, 2:] != targets[:, 2:]).all()


def test_steps_know_where_they_lie():
    loading, last = front_steps((22, 8, 72))
    assert (loading.start, loading.stop, last.stop) == (1, 22, 102)
    times, depths = np.arange(8.0)[np.newaxis], np.array([[-2.0, 0.0, 2.0, 2.0, 1.0, 0.0, -1.0, -2.0]])
    found = places(times, depths, np.array([0.5]), np.array([3.0]), np.array([5.0]), slice(5, 8))
    np.testing.assert_allclose(found[0, :, 0], np.arcsinh([0.0, -1.0, -2.0]), rtol=1e-6)
    np.testing.assert_allclose(found[0, :, 1], [0.0, -2.0 / 3.0, -0.8], rtol=1e-6)
    np.testing.assert_allclose(found[0, :, 2], np.log([0.02, 3.02, 6.02]), rtol=1e-6)


def test_scalars_and_curve_agree(model):
    trajectory = model.predict(Scene(1.0, SOLID), PROTOCOL)
    assert trajectory.completed
    assert trajectory.force[trajectory.unloading].max() == pytest.approx(trajectory.pull_off_force, rel=1e-12)
    highest = trajectory.time[trajectory.unloading][trajectory.force[trajectory.unloading].argmax()]
    assert highest == pytest.approx(trajectory.pull_off_time, rel=1e-9)
    assert trajectory.hysteresis > 0.0
    assert trajectory.max_compression < 0.0


def test_unit_of_time_does_not_matter(model):
    slower = LoadingProtocol(peak_indentation=20.0, loading_rate=10.0 / 7, dwell_time=7.0, unloading_rate=10.0 / 7)
    first = model.predict(Scene(1.0, SOLID), PROTOCOL)
    second = model.predict(Scene(1.0, PronySeries([0.3, 0.4], [0.7, 70.0])), slower)
    assert second.pull_off_force == pytest.approx(first.pull_off_force, rel=1e-9)
    np.testing.assert_allclose(second.time, 7.0 * first.time, rtol=1e-9)
    np.testing.assert_allclose(second.force, first.force, rtol=1e-6, atol=1e-6)


def test_a_list_is_predicted_as_its_parts(model):
    scenes = [Scene(1.0, SOLID), Scene(0.5, StandardLinearSolid(0.3)), Scene(2.0, SOLID)]
    for scene, trajectory in zip(scenes, model.predict(scenes, [PROTOCOL] * 3), strict=True):
        assert trajectory.pull_off_force == pytest.approx(model.predict(scene, PROTOCOL).pull_off_force, rel=1e-6)


def test_far_outside_the_training_is_refused(model):
    shallow = replace(PROTOCOL, peak_indentation=0.05)
    with pytest.raises(ValueError, match=r"like those of the training of model, .* received peak_indent"):
        model.predict(Scene(1.0, SOLID), shallow)
    with pytest.warns(
        ExtrapolationWarning, match="model extrapolates beyond its training: peak_indentation .*1 of 2 do"
    ):
        near, far = model.predict([Scene(1.0, SOLID)] * 2, [PROTOCOL, shallow])
    assert near.completed
    assert np.isnan(far.pull_off_force)


def test_combination_that_no_training_had_is_outside():
    random = np.random.default_rng(6)
    features = np.repeat(random.normal(size=(5000, 1)), len(FEATURES), axis=1)
    features += 0.02 * random.normal(size=features.shape)
    reach = Reach.of(features)
    assert np.mean([bool(texts) for texts, _ in reach.outside(features)]) < 2e-3
    strange = np.where(np.arange(len(FEATURES)) % 2, 1.0, -1.0)[np.newaxis]
    assert np.all((strange > reach.low) & (strange < reach.high))
    (texts, far), *_ = reach.outside(strange)
    assert "as far from the mean as those of the training" in texts[0]
    assert far


@pytest.mark.parametrize(
    ("scene", "protocol", "message"),
    [
        (Scene(1.0, SOLID, spring=1.0), PROTOCOL, "no spring"),
        (Scene(1.0, SOLID), replace(PROTOCOL, dwell_time=0.0), "with a dwell"),
        (Scene(1.0, SOLID), replace(PROTOCOL, start_indentation=-1.0), "begin where it does by default"),
    ],
)
def test_other_contacts_are_refused(model, scene, protocol, message):
    with pytest.raises(ValueError, match=message):
        model.predict(scene, protocol)


def test_damaged_file_is_refused(folder, tmp_path):
    for name in ("run.json", "stages.npz"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / "stages.npz").write_bytes((folder / "stages.npz").read_bytes()[:-1] + b"x")
    with pytest.raises(ValueError, match="which is damaged or another file"):
        SolidSurrogate.load(tmp_path)


def test_ends_are_the_outermost_fifths(data, monkeypatch):
    from surrogate.training.solid_judgement import ends

    dataset = load_dataset(data)
    rows = dataset.completed[5:]
    assert ends(dataset, rows) == {}
    monkeypatch.setitem(dataset.attributes["campaign"], "design", "edges")
    found = ends(dataset, rows)
    assert len(found) == 12
    tabor, ratio = dataset.protocols["tabor"][rows], dataset.modulus_ratios[rows]
    np.testing.assert_array_equal(found["low tabor"], tabor <= 0.2 * 16.0**0.2)
    np.testing.assert_array_equal(found["high modulus_ratio"], ratio >= 0.01 * 100.0**0.8)
    assert 0 < found["low tabor"].sum() < len(rows)
    monkeypatch.setitem(dataset.attributes["campaign"], "design", "corners")
    corners = ends(dataset, rows)
    assert len(corners) == 64
    lowest = ", ".join(end for end in found if end.startswith("low"))
    np.testing.assert_array_equal(corners[lowest], np.all([found[end] for end in lowest.split(", ")], axis=0))


def test_intervals_are_those_of_the_folder(folder, tmp_path):
    for name in ("run.json", "stages.npz"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    random = np.random.default_rng(5)
    features = SolidSurrogate.load(folder).reach.mean + random.normal(size=(3000, len(FEATURES)))
    errors = 0.01 * random.normal(size=(3000, 4)), 0.02 * random.normal(size=(3000, 102))
    fitted = SolidIntervals.fit(features, *errors).calibrated(features, np.zeros(3000, int), *errors)
    write_intervals(tmp_path, fitted)
    trajectory = SolidSurrogate.load(tmp_path).predict(Scene(1.0, SOLID), PROTOCOL)
    low, high = trajectory.pull_off_interval
    assert low < trajectory.pull_off_force < high
    assert high - low < trajectory.pull_off_force
    assert np.all(trajectory.force_lower < trajectory.force)
    # The band of whole curves is the wider one, absolute before the unloading, where forces are those of adhesion.
    assert np.all(trajectory.curve_upper > trajectory.force_upper)
    ends = np.arcsinh([trajectory.force_lower, trajectory.force_upper])
    np.testing.assert_allclose(ends.mean(axis=0)[:30], np.arcsinh(trajectory.force)[:30], rtol=1e-9)
