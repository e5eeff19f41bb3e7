"""Measured histories: the protocol behind one, resampled on measurement steps, predicted, told at their own points."""

import json
from dataclasses import replace

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from surrogate.data.dataset import TrajectoryDataset
from surrogate.data.scaling import PUBLISHED_MATERIALS
from surrogate.prediction.files import PUBLISHED
from surrogate.prediction.measured import NotOneCycleError, fit_protocol, predict_measured
from tests.surrogate.conftest import scaling_of, scenes
from tests.surrogate.prediction.conftest import FAST_WITHDRAWAL, FLAGS, PROTOCOL, SCENE, history, refused

DATASET = PUBLISHED.parent / "dataset.h5"


def write(path, times, indentations):
    lines = [f"{time!r},{depth!r}" for time, depth in zip(times.tolist(), indentations.tolist(), strict=True)]
    path.write_text("\n".join(["time,indentation", *lines]))
    return path


@pytest.mark.slow
def test_a_noisy_history_predicts_about_as_well_as_its_protocol():
    data, model = TrajectoryDataset.load(DATASET), surrogate.load("M1-concat")
    chosen = data.split().test[:40]
    errors = {0.0: [], 1e-3: [], 1e-2: []}
    for index in chosen:
        quantities = {name: float(data.protocols[name][index]) for name in PROTOCOL}
        tabor, protocol = float(data.protocols["tabor"][index]), LoadingProtocol(**quantities)
        clean = model.predict(scenes([tabor])[0], protocol)
        for noise, found in errors.items():
            times, indentations = history(protocol, tabor, noise=noise, seed=int(index))
            predicted = predict_measured(model, times, indentations, scenes([tabor])[0])
            assert predicted.fitted is not None
            truth = np.interp(times, clean.time, data.force[index])
            found.append(np.sqrt(np.mean((predicted.force - truth) ** 2)) / np.ptp(truth))
    clean, little, much = (np.array(found) for found in errors.values())
    assert clean.mean() < 0.01
    assert little.mean() < 1.1 * clean.mean()
    assert much.mean() < 1.2 * clean.mean()
    assert np.quantile(much / clean, 0.9) < 1.5


def test_exact_measurement_steps_are_predicted_as_they_are(published):
    model = surrogate.load("M1-concat", published)
    expected = model.predict(SCENE, LoadingProtocol(**PROTOCOL))
    found = predict_measured(model, expected.time, expected.indentation, SCENE)
    assert found.fitted is None
    np.testing.assert_allclose(found.force, expected.force, rtol=1e-6, atol=1e-6)


@pytest.mark.filterwarnings("ignore:.*outside the training")
@pytest.mark.parametrize("dwell_time", [0.0, 1e-3, 1.0])
def test_any_points_of_a_protocol_predict_its_force_at_themselves(published, dwell_time):
    model = surrogate.load("M1-concat", published)
    protocol = LoadingProtocol(**PROTOCOL | {"dwell_time": dwell_time})
    times, indentations = history(protocol, points=(30, 4, 400))
    found = predict_measured(model, times + 5.0, indentations, SCENE)
    shortest = model.scaling.ranges["dwell_time"][0]
    assert found.fitted.summary()["dwell_time"] == pytest.approx(dwell_time or shortest, rel=1e-6)
    expected = model.predict(SCENE, LoadingProtocol(**PROTOCOL | {"dwell_time": dwell_time or shortest}))
    if dwell_time:
        for name in ("time", "indentation"):
            steps, wanted = (getattr(one, name) for one in (found.trajectory, expected))
            np.testing.assert_allclose(steps - 5.0 * (name == "time"), wanted, rtol=1e-9, atol=1e-9)
    assert found.trajectory.pull_off_force == pytest.approx(expected.pull_off_force, rel=1e-2)
    # So short a model jumps at the ends of a dwell.
    away = np.abs(times - protocol.phase_times(1.0)[1]) > 0.1
    at = np.interp(times, expected.time, expected.force)
    assert np.abs(found.force - at)[away].max() < 0.02 * np.ptp(at)
    assert (found.time[0], len(found.force)) == (5.0, len(times))


def test_a_noisy_history_on_the_command_line(command, tmp_path, published):
    times, indentations = history(LoadingProtocol(**PROTOCOL), noise=5e-3)
    words = ["predict", "M1-concat", "--in", write(tmp_path / "in.csv", times, indentations), "--tabor", 1.0]
    code, out, err = command(*words, "--out", tmp_path / "out.csv")
    assert (code, err) == (0, "")
    assert "  predicted on the protocol fitted to the 401 points: from -2.145 to " in out
    assert "% of its travel" in out
    table = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table[:, 1:3], np.stack([times, indentations], axis=1))
    expected = surrogate.load("M1-concat", published).predict(SCENE, LoadingProtocol(**PROTOCOL))
    at = np.interp(times, expected.time, expected.force)
    assert np.abs(table[:, 3] - at).max() < 0.02 * np.ptp(at)

    code, out, _ = command(*words, "--json", "--check")
    (found,) = json.loads(out)
    assert found["fitted"]["loading_rate"] == pytest.approx(10.0, rel=1e-2)
    assert found["fitted"]["residual"] == pytest.approx(0.1, rel=0.2)
    assert len(found["force"]) == len(found["solver_force"]) == 401
    assert found["time"] == times.tolist()
    assert None not in found["solver_force"]


def test_what_is_no_cycle_is_predicted_at_its_points_with_a_warning(command, tmp_path):
    times = np.linspace(0.0, 8.0, 200)
    cycles = np.interp(times, [0, 2, 4, 6, 8], [-2.1, 20, 5, 20, -2.1])
    words = ["predict", "M1-concat", "--in", write(tmp_path / "in.csv", times, cycles), "--tabor", 1.0]
    code, out, err = command(*words)
    assert code == 0
    assert "fitted" not in out
    first = err.splitlines()[0]
    assert first.startswith(f"warning: {tmp_path / 'in.csv'} is not a history like those M1-concat was trained on. ")
    assert first.endswith("mark both ends of the dwell in a column edge, and compare with the solver (--check)")
    assert "loading_points = " in err
    assert "the model counts points: give it 50 equally spaced ones in loading" in err


def test_an_unresolved_ramp_is_refused_with_advice(command, tmp_path):
    # Points at equal times, two of them in the unloading.
    times = np.linspace(0.0, FAST_WITHDRAWAL.phase_times(1.0)[-1], 25)
    noise = 0.02 * np.random.default_rng(0).normal(size=times.shape)
    path = write(tmp_path / "in.csv", times, FAST_WITHDRAWAL.history(1.0).indentation_at(times) + noise)
    words = ["predict", "M1-concat", "--in", path, "--tabor", 1.0, "--out", tmp_path / "out.csv"]
    err = refused(command, words, folder=tmp_path)
    assert "at least 4 points in loading and in unloading, to determine their rates; record more of them, mark " in err
    assert "both ends of the dwell in a column edge, or give the protocol" in err
    assert ", 2 in unloading" in err


def test_a_published_model_knows_its_material():
    data = TrajectoryDataset.load(DATASET)
    assert {data.sha256: data.modulus_ratio} == PUBLISHED_MATERIALS
    for folder in PUBLISHED.glob("*/model.onnx"):
        assert surrogate.load(folder).modulus_ratio == 0.1


@pytest.mark.parametrize("ratio", [[], ["--modulus-ratio", 0.1], ["--modulus-ratio", 0.5]])
def test_a_check_against_another_material_says_so(ratio, command):
    place = PUBLISHED / "M1-concat"
    code, out, err = command("predict", place, "--tabor", 1.0, *FLAGS, "--check", *ratio)
    assert code == 0
    other = ratio[-1:] == [0.5]
    assert ("against the solver of another material (modulus ratio 0.5): pull-off" in out) == other
    assert err.startswith("warning: M1-concat was trained on the modulus ratio 0.1 only;") == other
    assert err.count("\n") == other
    code, out, err = command("predict", place, "--tabor", 1.0, *FLAGS, *ratio)
    assert code == (2 if other else 0)
    if other:
        assert err.startswith("surrogate: Expected the modulus ratio 0.1 that M1-concat was trained on, or --check")
    else:
        assert err == ""


def test_the_check_of_a_model_without_a_recorded_material_warns(command, monkeypatch):
    monkeypatch.setattr("surrogate.prediction.predictor.Surrogate.modulus_ratio", None)
    words = ["predict", "M1-concat", "--tabor", 1.0, *FLAGS, "--check"]
    _, _, err = command(*words)
    assert err.startswith("warning: M1-concat does not record the modulus ratio it was trained on; the solver uses 0.1")
    assert "does not record" not in command(*words, "--modulus-ratio", 0.3)[2]


def test_a_training_records_its_material(dataset):
    assert scaling_of(replace(dataset, modulus_ratio=None)).modulus_ratio is None
    scaling = scaling_of(replace(dataset, modulus_ratio=0.25))
    assert type(scaling).from_json(scaling.to_json(), "here").modulus_ratio == 0.25
    assert scaling.ranges["modulus_ratio"] == (0.25, 0.25)


WANTED = [getattr(FAST_WITHDRAWAL, name) for name in PROTOCOL]
START = FAST_WITHDRAWAL.start(1.0)


def fitted(*history, **options):
    """The path and the values of its quantities."""
    found = fit_protocol(*history, **options)
    return found, [found.summary()[name] for name in PROTOCOL]


@pytest.mark.parametrize("points", [(1, 1, 1), (50, 20, 50), (3, 200, 1000), (2000, 7, 40)])
@pytest.mark.parametrize("dwell_time", [0.0, 1e-3, 3.0])
def test_a_history_without_noise_gives_its_protocol(points, dwell_time):
    protocol = replace(FAST_WITHDRAWAL, dwell_time=dwell_time)
    times, indentations = history(protocol, points=points)
    found, values = fitted(times + 7.0, indentations)
    assert found.exact
    assert values == pytest.approx([getattr(protocol, name) for name in PROTOCOL], rel=1e-6, abs=1e-9)
    assert found.corners[0] == 7.0
    assert found.levels[[0, 3]] == pytest.approx(START)


@pytest.mark.parametrize("rates", [(14.4, 0.105, 0.463), (1.98, 0.0122, 0.131), (18.1, 0.00286, 2.09)])
def test_a_short_phase_between_unevenly_spread_points_is_found(rates):
    protocol = LoadingProtocol(**dict(zip(PROTOCOL, (60.0, *rates), strict=True)))
    times, _ = history(protocol, points=(50, 20, 50))
    times = np.unique(np.concatenate([times, np.random.default_rng(0).uniform(0.0, times[-1], 200)]))
    found, (_, *values) = fitted(times, protocol.history(1.0).indentation_at(times))
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
