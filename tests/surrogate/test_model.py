"""A predictor without bands: forces along histories, what lies outside the training, trajectories like the solver's."""

import pickle
import shutil
import warnings
from dataclasses import replace

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from bem.dataset.designs import Design
from bem.dataset.file import load_dataset
from bem.dataset.measurement_steps import measurement_grid, proportional_counts
from bem.methods.closed_forms import dmt
from bem.problem.protocol import default_start_indentation
from bem.results.trajectory import far_field
from surrogate import validity
from surrogate.cli.comparison import readable
from surrogate.model import ExtrapolationWarning, Surrogate
from surrogate.networks import KerasNetwork
from surrogate.trajectory import FORCE_DOUBT, predicted_trajectories
from surrogate.validity import RANGE_TOLERANCE, excesses, history_quantities
from tests.processes import ROOT
from tests.surrogate.conftest import PROTOCOL, SCENE, scaling_of, scenes

AGREEMENT = 1e-5
"""Largest difference between ONNX and Keras, as a share of the history's force range."""


@pytest.fixture(scope="module")
def predictor(dataset):
    return Surrogate(KerasNetwork(surrogate.build("M3-concat"), scaling_of(dataset), name="M3-concat"))


@pytest.fixture(scope="module")
def inside(dataset):
    """Histories and scenes of the training part, which no range excludes."""
    indices = dataset.split().train[:5]
    return *dataset.grid(indices), scenes(dataset.protocols["tabor"][indices])


def test_prediction_in_range_is_silent(predictor, inside):
    times, indentations, given = inside
    with warnings.catch_warnings(action="error"):
        force = predictor.predict_history(*inside)
    assert (force.shape, force.dtype, np.isfinite(force).all()) == (times.shape, np.float64, True)
    assert predictor.extrapolated(*inside) == [()] * 5
    single = predictor.predict_history(times[2], indentations[2], given[2])
    np.testing.assert_allclose(single, force[2], rtol=1e-4, atol=1e-5)
    for shift in (-5.0, 1e3):
        found = predictor.predict_history(times + shift, indentations, given)
        np.testing.assert_allclose(found, force, rtol=1e-6, atol=1e-5)


def test_edge_override(predictor, inside):
    marks = np.zeros_like(inside[0])
    marks[:, [49, 69]] = 1.0
    base = predictor.predict_history(*inside)
    np.testing.assert_array_equal(predictor.predict_history(*inside, marks), base)
    assert np.abs(predictor.predict_history(*inside, 0 * marks) - base).max() > 1e-4
    said = predictor.extrapolated(*inside, np.roll(marks, 10, axis=1))
    assert all("loading_points = 60 lies outside" in str(one) for one in said)
    for wrong in (marks[:, 1:], 0.5 * marks, -marks, 2.0 * marks, np.nan * marks):
        words = "edge must be of shape" if wrong.shape != marks.shape else "edge must be zero or one"
        with pytest.raises(ValueError, match=words):
            predictor.predict_history(*inside, wrong)


def test_extrapolation_warns_once_by_name(predictor, inside, dataset):
    times, indentations, given = inside
    protocol = {name: values[dataset.split().train[:1]] for name, values in dataset.protocols.items()}
    one, path, first = times[:1], indentations[:1], given[:1]
    peak, bump, crowded = path.max(), np.zeros_like(path), one.copy()
    bump[0, :50] = 0.05 * peak * np.sin(np.linspace(0.0, np.pi, 50))
    # The same path at instants that crowd at its start.
    crowded[0, :50] = one[0, 49] * np.linspace(0.0, 1.0, 50) ** 2
    roof = np.linspace(0.0, 4.0, 51)[None]
    cases = [
        ((times, indentations, scenes([3.4])[0]), r"tabor = 3\.4 lies outside \[0\.\d+, \d.*\]"),
        ((one, path + 0.5 * (peak - path), first), "start_indentation = .*end_indentation = "),
        ((one, path + bump, first), r"bend = .* lies outside \[0, 0\.005\]"),
        ((crowded, np.interp(crowded, one[0], path[0]), first), "step_ratio = "),
        ((roof, 10.0 - 6.0 * np.abs(roof - 2.0), SCENE), "dwell_time = 0 lies outside.*Advice: .*the model counts po"),
    ]
    for total in (24, 30, 90, 150, 2000):
        counts = proportional_counts(total)
        words = rf"loading_points = {counts[0]} lies outside \[42, 58\]; dwell_points = .*; unloading_po"
        cases.append(((*measurement_grid(**protocol, counts=counts), first), words))
    for arguments, words in cases:
        with pytest.warns(ExtrapolationWarning, match=words) as caught:
            assert np.isfinite(predictor.predict_history(*arguments)).all()
        assert len(caught) == 1
        assert all(words.partition(" = ")[0] in " ".join(one) for one in predictor.extrapolated(*arguments))


def test_bad_input(predictor, inside):
    times, indentations, given = inside
    hole, backwards = indentations.copy(), times.copy()
    hole[1, 7], backwards[2, 5] = np.nan, times[2, 4]
    for arguments, words in (
        ((times, hole, given), "indentations must be finite.*history 1"),
        ((backwards, indentations, given), "increase strictly.*history 2"),
        ((times, indentations[:, 1:], given), "must have the same shape"),
        ((times[0], indentations, given), "must have the same shape"),
        ((times, indentations, scenes(np.ones(5), 0.3)), r"modulus_ratio must be 0\.1, the only one.*received 0\.3"),
        ((times + 0j, indentations, given), "times must be real numbers"),
        ((times, (indentations + 1j).tolist(), given), "indentations must be real numbers"),
        ((times, [[1.0], [2.0, 3.0]], given), "indentations must be real numbers"),
        ((None, indentations, given), "must have the same shape"),
        ((times * 1e-320, indentations, given), "time steps must be from|increase strictly"),
        ((times * 1e-16, indentations, given), "rates must be from -1e"),
        ((times * 1e30, indentations, given), "times after the first must be from 0 to"),
        ((times, 1e9 * indentations, given), "indentations must be from -1e"),
        (((times - 1e18)[:, :3], indentations[:, :3], given), "increase strictly"),
    ):
        with pytest.raises(ValueError, match=words):
            predictor.predict_history(*arguments)


def test_model_is_pickled_with_its_file(folder, inside):
    loaded = {"onnx": surrogate.load(folder, threads=2), "keras": surrogate.load(folder, backend="keras")}
    forces = {backend: model.predict_history(*inside) for backend, model in loaded.items()}
    content = pickle.dumps(loaded)
    shutil.rmtree(folder)
    for backend, model in pickle.loads(content).items():
        np.testing.assert_array_equal(model.predict_history(*inside), forces[backend])
        assert (model.name, model.scaling) == ("M1-concat", loaded[backend].scaling)
    assert pickle.loads(content)["onnx"].network.threads == 2


@pytest.mark.parametrize(("low", "high"), [(1e-3, 3.0), (2.0, 1e6)])
@pytest.mark.parametrize("share", [0.5, 2.0])
def test_bounds_hold_to_rounding(low, high, share):
    step = share * RANGE_TOLERANCE
    values = np.array([low * (1.0 - step), low, high, high * (1.0 + step), np.nan])
    found = excesses({"dwell_time": values}, {"dwell_time": (low, high)})
    outside = np.zeros(5, dtype=bool) if not found else found[0].beyond > 0.0
    assert outside.tolist() == [share > 1.0, False, False, share > 1.0, False]


def cycle(loading=50, dwell=20, unloading=50):
    """A history from -2 to 8 in 2, 1 at rest, and back to -3 in 4."""
    ramp, rest, back = (np.arange(1, points + 1) / points for points in (loading - 1, dwell, unloading))
    times = np.concatenate([[0.0], 2.0 * ramp, 2.0 + rest, 3.0 + 4.0 * back])
    return times[None], np.interp(times, [0.0, 2.0, 3.0, 7.0], [-2.0, 8.0, 8.0, -3.0])[None]


def test_quantities_of_a_history_by_hand():
    times, indentations = cycle()
    expected = {
        "peak_indentation": 8.0,
        "start_indentation": -2.0,
        "end_indentation": -3.0,
        "loading_rate": 5.0,
        "dwell_time": 1.0,
        "unloading_rate": 2.75,
        "loading_points": 50.0,
        "dwell_points": 20.0,
        "unloading_points": 50.0,
        "bend": 0.0,
        "step_ratio": 1.0,
    }
    found = {name: float(value) for name, (value,) in history_quantities(times, indentations).items()}
    assert found == pytest.approx(expected, abs=1e-9)
    bent = indentations + np.where(np.arange(120) == 30, 0.11, 0.0)
    assert history_quantities(times, bent)["bend"][0] == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("points", "late", "as_learned"),
    [
        *(((50, 20, 50), 0.0, True), ((42, 16, 42), 0.0, True), ((58, 24, 58), 0.0, True)),
        *(((41, 20, 50), 0.0, False), ((50, 25, 50), 0.0, False)),
        *(((50, 20, 50), 0.15, True), ((50, 20, 50), 0.25, False)),
    ],
)
def test_points_have_learned_proportions(points, late, as_learned):
    times, indentations = cycle(*points)
    moved = times + late * 0.08 * (np.arange(times.size) == 100)
    moved = moved, np.interp(moved, times[0], indentations[0])
    assert as_learned == (not excesses(history_quantities(*moved), {}))


def test_ends_lie_near_those_of_the_training():
    tabor = np.array([1.0])
    usual = default_start_indentation(tabor)
    for name in ("start_indentation", "end_indentation"):
        for share, outside in ((1.02, False), (0.98, False), (1.04, True), (0.96, True)):
            assert bool(excesses({"tabor": tabor, name: share * usual}, {})) == outside


def test_trajectories_resemble_the_solver_s(published):
    model = surrogate.load("M1-concat", published)
    protocols = [LoadingProtocol(**PROTOCOL), LoadingProtocol(**PROTOCOL | {"dwell_time": 0.0})]
    with warnings.catch_warnings(action="error"):
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
    history = np.array([[[0.0, 1.0, 2.0]], [[depth, 2.0, depth]], [[0.0, -3.0, force]]])
    return predicted_trajectories(*history, unloading_from=1, seconds=0.0, model="M1-concat")[0]


def test_one_infinite_prediction_says_so():
    history = np.tile([[0.0, 1.0, 2.0], [-4.0, 2.0, -4.0], [0.0, -3.0, 1.0]], (2, 1, 1)).swapaxes(0, 1)
    history[2, 0, 1] = -np.inf
    broken, sound = predicted_trajectories(*history, unloading_from=1, seconds=0.0)
    assert (broken.status, sound.status) == ("the prediction is not finite", "completed")
    broken.unloading[:], broken.contact_radius[:], broken.stats.steps_by_phase["loading"] = True, 0.0, 1
    assert sound.unloading.tolist() == [False, True, True]
    assert np.isnan(sound.contact_radius).all()
    assert sound.stats.steps_by_phase == {}


def test_dwell_or_none_keeps_the_order(published):
    model = surrogate.load("M1-concat", published)
    protocols = [LoadingProtocol(**PROTOCOL | {"dwell_time": dwell}) for dwell in (1.0, 0.0, 0.5, 0.0)]
    protocols[3] = replace(protocols[3], unloading_rate=20.0)
    with warnings.catch_warnings(action="ignore", category=ExtrapolationWarning):
        for one, together in zip(protocols, model.predict(SCENE, protocols), strict=True):
            np.testing.assert_allclose(model.predict(SCENE, one).force, together.force, rtol=1e-4, atol=1e-5)


def test_detachment_follows_from_the_force():
    limit = 4.0 * dmt.rigid_force_from_indentation(-4.0) + FORCE_DOUBT
    assert [ending(force).detached for force in (0.99 * limit, 1.01 * limit, np.nan)] == [True, False, False]
    assert ending(-0.1).summary()["detached"] is True


def test_signed_work_and_attachment_are_told():
    backwards = ending(-9.0)
    assert backwards.work() == backwards.summary()["work"] == -27.0
    assert backwards.hysteresis == 27.0
    attached, line = (readable(0, one, None) for one in (ending(9.0), backwards))
    assert "still attached at the end: the pull-off force is the largest so far" in attached
    assert "work" not in attached
    assert "attached" not in line
    assert "\nwork -27: the contact gave energy back; not dissipation" in line


def test_detachment_limit_of_published_model():
    """Whatever the models' errors, all but a few ends of the test set are judged as the solver's are."""
    dataset = load_dataset("published/dataset.h5")
    rows = np.random.default_rng(0).permutation(dataset.completed)[:400]
    times, indentations = (values[rows] for values in dataset.grid())
    tabor = dataset.protocols["tabor"][rows]
    ends = surrogate.load("M1-concat").predict_history(times, indentations, scenes(tabor))[:, -1]
    found = far_field(ends, indentations[:, -1], doubt=FORCE_DOUBT)
    truth = far_field(dataset.scalars["end_force"][rows], default_start_indentation(tabor))
    assert np.mean(found != truth) < 0.03
    assert 0.1 < np.mean(~truth) < 0.3


@pytest.mark.filterwarnings("ignore:.*extrapolates")  # the design's extremes may lie beyond the training by rounding
def test_onnx_and_keras_give_the_same_forces():
    columns = Design("log-uniform").protocols(300, seed=5)
    histories, solids = measurement_grid(**columns), scenes(columns["tabor"])
    models = (surrogate.load("M1-concat", backend=backend) for backend in ("onnx", "keras"))
    onnx, keras = (model.predict_history(*histories, solids) for model in models)
    difference = (np.abs(onnx - keras).max(axis=1) / np.ptp(keras, axis=1)).max()
    assert 0.0 < difference < AGREEMENT


def test_the_documents_state_the_bounds():
    text = (ROOT / "docs" / "control.md").read_text(encoding="utf-8")
    agreement = f"{AGREEMENT:.0e}".replace("e-0", "e-")
    assert f"within {agreement} of" in text
    points = ", ".join(f"{low:g} to {high:g}" for low, high in validity.POINTS.values())
    for words in (
        rf"within {100 * validity.START_TOLERANCE:g} % of $-\pi^{{2/3}}\mu$",
        f"{points}: the paper's N = 100 to 140",
        f"within {100 * validity.BEND_TOLERANCE:g} % of the travel",
        f"a factor of {validity.LARGEST_STEP_RATIO:g}",
    ):
        assert words in text
