import numpy as np
import pytest

from surrogate.data.metrics import dtw_rmse, hysteresis, nmae, pull_off, relative_error, summary, trajectory_errors


def brute_force_dtw_rmse(a, b):
    best = (np.inf, 0)

    def walk(i, j, total, points):
        nonlocal best
        total, points = total + (a[i] - b[j]) ** 2, points + 1
        if total >= best[0]:
            return
        if (i, j) == (len(a) - 1, len(b) - 1):
            best = (total, points)
            return
        for di, dj in ((1, 1), (1, 0), (0, 1)):
            if i + di < len(a) and j + dj < len(b):
                walk(i + di, j + dj, total, points)

    walk(0, 0, 0.0, 0)
    return np.sqrt(best[0] / best[1])


def test_dtw_against_every_path():
    rng = np.random.default_rng(0)
    for _ in range(5):
        a, b = rng.normal(size=5), rng.normal(size=6)
        assert dtw_rmse(a[None], b[None])[0] == pytest.approx(brute_force_dtw_rmse(a, b))


def test_dtw_is_at_most_the_rmse():
    x = np.linspace(0, 6, 120)
    a, b = np.sin(x)[None], np.sin(x - 0.2)[None]
    assert dtw_rmse(a, a)[0] == 0.0
    assert dtw_rmse(a, b)[0] < 0.3 * np.sqrt(np.mean((a - b) ** 2))
    pairs = np.random.default_rng(2).normal(size=(2, 50, 30))
    assert np.all(dtw_rmse(*pairs) <= np.sqrt(np.mean((pairs[0] - pairs[1]) ** 2, axis=1)) + 1e-12)


def test_pull_off_and_loop_area():
    times, force = np.arange(6.0)[None], np.array([[9.0, 1.0, 2.0, 5.0, 3.0, 1.0]])
    assert pull_off(times, force, unloading_from=2) == (5.0, 3.0)
    indentations, force = np.array([[0.0, 1.0, 1.0, 0.0]]), np.array([[0.0, -1.0, 2.0, 0.0]])
    assert hysteresis(indentations, force)[0] == hysteresis(indentations, -force)[0] == pytest.approx(1.5)
    assert nmae(np.array([[1.0, 3.0]]), np.array([[-1.0, 3.0]]))[0] == pytest.approx(50.0)
    assert relative_error(np.array([1.1]), np.array([-1.0]))[0] == pytest.approx(210.0)


def test_errors_of_one_prediction_by_hand():
    times, indentations = np.arange(4.0)[None], np.array([[0.0, 2.0, 2.0, 0.0]])
    reference, predicted = np.array([[-1.0, -3.0, 1.0, 4.0]]), np.array([[-1.0, -2.0, 6.0, 5.0]])
    errors = trajectory_errors(
        predicted,
        reference,
        predicted_scaled=np.array([[0.0, 0.0, 0.0, 3.0]]),
        reference_scaled=np.zeros((1, 4)),
        times=times,
        indentations=indentations,
        unloading_from=2,
        native_pull_off_force=np.array([8.0]),
    )
    expected = {
        "mse": 9.0 / 4.0,
        "mae": 3.0 / 4.0,
        # The aligned path stays on the first points and ends on the last.
        "dtw_rmse": 3.0 / np.sqrt(4.0),
        "nmae_percent": 100.0 * 7.0 / 9.0,
        "pull_off_force_percent": 50.0,
        "pull_off_time_percent": 100.0 / 3.0,
        # Loops -4 + 0 - 5 and -3 + 0 - 11.
        "hysteresis_percent": 100.0 * 5.0 / 9.0,
        "native_pull_off_force_percent": 25.0,
        "resolution_floor_percent": 50.0,
    }
    assert {name: float(values[0]) for name, values in errors.items()} == pytest.approx(expected)


def test_a_summary_is_of_all_trajectories():
    values = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 99.0])
    expected = {"mean": 144.0 / 11.0, "median": 5.0, "p90": 9.0, "max": 99.0}
    assert summary({"mse": values})["mse"] == pytest.approx(expected)
