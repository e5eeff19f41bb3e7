"""Measured histories: resampled on measurement steps, predicted, and told at their own points."""

import json
from dataclasses import replace

import numpy as np
import pytest

import surrogate
from bem import LoadingProtocol
from surrogate.data.dataset import TrajectoryDataset
from surrogate.data.scaling import PUBLISHED_MATERIALS
from surrogate.prediction.files import PUBLISHED
from surrogate.prediction.measured import predict_measured
from tests.surrogate.conftest import scaling_of, scenes
from tests.surrogate.prediction.predicting import FLAGS, PROTOCOL, SCENE, history, refused, unresolved

DATASET = PUBLISHED.parent / "dataset.h5"
PROTOCOLS = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
published_only = pytest.mark.skipif(
    not (DATASET.is_file() and (PUBLISHED / "M1-concat" / "model.onnx").is_file()), reason="nothing is published here"
)


def write(path, times, indentations):
    lines = [f"{time!r},{depth!r}" for time, depth in zip(times.tolist(), indentations.tolist(), strict=True)]
    path.write_text("\n".join(["time,indentation", *lines]))
    return path


@published_only
def test_a_noisy_history_predicts_about_as_well_as_its_protocol():
    data, model = TrajectoryDataset.load(DATASET), surrogate.load("M1-concat")
    chosen = data.split().test[:40]
    errors = {0.0: [], 1e-3: [], 1e-2: []}
    for index in chosen:
        quantities = {name: float(data.protocols[name][index]) for name in PROTOCOLS}
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
    times, indentations = unresolved()
    words = ["predict", "M1-concat", "--in", write(tmp_path / "in.csv", times, indentations), "--tabor", 1.0]
    err = refused(command, [*words, "--out", tmp_path / "out.csv"], folder=tmp_path)
    assert "; record more of them, mark both ends of the dwell in a column edge, or give the protocol" in err


@published_only
def test_a_published_model_knows_its_material():
    data = TrajectoryDataset.load(DATASET)
    assert {data.sha256: data.modulus_ratio} == PUBLISHED_MATERIALS
    for folder in PUBLISHED.glob("*/model.onnx"):
        assert surrogate.load(folder).modulus_ratio == 0.1


@published_only
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
