"""Kernels: small systems, monotone cubics, and when their compilation is announced."""

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import config
from scipy.interpolate import PchipInterpolator

from bem import LoadingProtocol, Scene, StandardLinearSolid, simulate
from bem._support.interpolation import ForceInterpolant
from bem._support.jit import compilation, kernel
from bem._support.linear_algebra import add_rows, determinant_is_negative, dot, lu_factor, lu_solve


@kernel
def solve_twice(matrix, order, first, second):
    """Factorise once, solve for two right-hand sides; the sign of the determinant."""
    pivots = np.empty(matrix.shape[0], dtype=np.int32)
    lu_factor(matrix, order, pivots)
    lu_solve(matrix, order, pivots, first)
    lu_solve(matrix, order, pivots, second)
    return determinant_is_negative(matrix, order, pivots)


@pytest.mark.parametrize(
    ("size", "order"), [(1, 1), (2, 2), (3, 3), (4, 4), (5, 5), (7, 7), (8, 8), (60, 60), (61, 61), (60, 23), (5, 1)]
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_interpolation_agrees_with_numpy(size, order, sign):
    rng = np.random.default_rng(size + order)
    matrix = rng.standard_normal((size, size))
    matrix[0] *= sign
    matrix[0, 0] *= order == 1  # needs pivoting
    rhs = rng.standard_normal((2, size))
    block = matrix[:order, :order].copy()
    solutions = rhs.copy()
    negative = solve_twice(matrix.T.copy(), order, solutions[0], solutions[1])
    for right, solution in zip(rhs, solutions, strict=True):
        np.testing.assert_allclose(solution[:order], np.linalg.solve(block, right[:order]), rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(solution[order:], right[order:])
    assert negative == (np.linalg.slogdet(block)[0] < 0.0)


@pytest.mark.parametrize("rows", [0, 1, 3, 4, 5, 8, 11])
def test_products_agree_with_numpy(rows):
    rng = np.random.default_rng(rows)
    matrix, factors, out = rng.standard_normal((rows, 13)), rng.standard_normal(rows), rng.standard_normal(13)
    expected = out + factors @ matrix
    add_rows(matrix, factors, out)
    np.testing.assert_allclose(out, expected, rtol=1e-13, atol=1e-13)
    assert dot(factors, 2.0 * factors) == pytest.approx(2.0 * np.sum(factors**2), rel=1e-13)


def test_corner_is_not_rounded():
    times = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    force = np.where(times < 1.0, times**2, 1.0 - 3.0 * (times - 1.0) ** 2 - (times - 1.0))
    queries = np.linspace(0.0, 2.0, 41)
    exact = np.where(queries < 1.0, queries**2, 1.0 - 3.0 * (queries - 1.0) ** 2 - (queries - 1.0))
    kept = np.abs(ForceInterpolant(times, force, [], [1.0]).at(queries) - exact).max()
    rounded = np.abs(ForceInterpolant(times, force, []).at(queries) - exact).max()
    assert kept < 0.4 * rounded


def test_integrals_are_those_between():
    times = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0])
    history = ForceInterpolant(times, np.array([0.0, 1.0, 2.0, 5.0, 5.0, 4.0]), [2.0], [3.0])
    assert history.ranges == [(0, 3), (3, 5), (4, 6)]
    assert ForceInterpolant([0.0, 1.0, 1.0, 2.0], np.ones(4), [1.0], [1.0]).ranges == [(0, 2), (2, 4)]
    np.testing.assert_allclose(history.integrals(), [2.0, 5.0, 4.5], rtol=1e-14)
    np.testing.assert_array_equal(history.at([1.0, 2.0, 3.0, 3.5]), [1.0, 5.0, 5.0, 4.5])


def test_history_bends_with_the_protocol():
    protocol = LoadingProtocol(peak_indentation=3.0, loading_rate=10.0, dwell_time=0.2, unloading_rate=10.0)
    scene = Scene(tabor=1.0, material=StandardLinearSolid(0.1))
    trajectory, exact = simulate(scene, protocol), simulate(scene, protocol, 3e-4)
    corner = protocol.phase_times(1.0)[1]
    times = corner + np.linspace(-0.02, 0.02, 401)
    error = np.abs(trajectory.at(times) - exact.at(times)).max() / np.ptp(exact.force)
    assert error < 0.1 * trajectory.accuracy


@given(
    st.lists(st.tuples(st.floats(1e-3, 1e3), st.floats(-1e3, 1e3, allow_subnormal=False)), min_size=2, max_size=12),
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=6),
)
def test_the_cubics_are_those_of_scipy(points, places):
    times = np.cumsum([step for step, _ in points])
    force = np.array([value for _, value in points])
    queries = times[0] + np.array(places) * (times[-1] - times[0])
    queries = np.clip(queries, times[0], times[-1])
    ours, theirs = ForceInterpolant(times, force, []), PchipInterpolator(times, force)
    scale = np.abs(force).max()
    np.testing.assert_allclose(ours.at(queries), theirs(queries), rtol=0, atol=1e-9 * scale)
    area = theirs.integrate(times[0], times[-1])
    np.testing.assert_allclose(ours.integrals()[0], area, rtol=0, atol=1e-12 * scale * (times[-1] - times[0]))


@pytest.mark.parametrize(
    ("times", "force", "jumps", "corners", "queries", "values"),
    [
        ([0, 1, 1, 2], [0, 1, -1, -2], [1], [], [0.5, 1.0 - 1e-9, 1.0, 1.5], [0.5, 1.0, -1.0, -1.5]),
        ([0, 1, 1, 2], [0, 1, 3, 3], [1], [1], [1.0], [3.0]),  # a jump at a corner is a jump
        ([0, 0, 1], [5, 1, 1], [0], [], [0.0], [1.0]),  # at the ends, and twice in one place
        ([0, 1, 1], [5, 5, 2], [1], [], [1.0], [2.0]),
        ([0, 1, 1, 1, 2], [5, 5, 2, 0, 0], [1, 1], [], [1.0], [0.0]),
    ],
)
def test_jump_is_sharp_and_belongs_to_after(times, force, jumps, corners, queries, values):
    history = ForceInterpolant(times, force, jumps, corners)
    np.testing.assert_allclose(history.at(queries), values, atol=1e-8)


@pytest.mark.parametrize(
    ("times", "jumps", "corners", "queries", "message"),
    [
        ([0.0, 2.0, 1.0], [], [], [0.5], "non-decreasing"),
        ([0.0, 1.0, 2.0], [], [], [2.5], r"times must lie between 0\.0 and 2\.0; received 2\.5"),
        ([0.0, 1.0, 2.0], [], [], [np.nan], "times must lie between"),
        ([0.0, 1.0, 2.0], [1.0], [], [0.5], "jump_times must each be listed before and after"),
        ([0.0, 1.0, 2.0], [], [1.5], [0.5], "corner_times must be instants"),
        *(
            ([0.0, 1.0, 2.0], [], [], queries, "times must be real numbers; received")
            for queries in (1j, [0.5, "a"], [[0.1], [0.2, 0.3]], {})
        ),
    ],
)
def test_bad_resampling(times, jumps, corners, queries, message):
    with pytest.raises(ValueError, match=message):
        ForceInterpolant(times, [0.0, 1.0, 2.0], jumps, corners).at(queries)


@pytest.mark.parametrize("start", [0.0, -1e6])
def test_time_a_rounding_outside_is_the_end(start):
    history = ForceInterpolant([start, start + 1.0, 12.3], [1.0, 2.0, 3.0], [])
    outside = [np.nextafter(start, -np.inf), np.nextafter(12.3, np.inf)]
    np.testing.assert_array_equal(history.at(outside), [1.0, 3.0])
    with pytest.raises(ValueError, match="times must lie between"):
        history.at(12.3 + 1e-6 * (1.0 - start))


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(config, "DISABLE_JIT", False)
    return tmp_path


def test_a_compilation_is_announced_once(cache, capsys):
    for expected in ("bem: compiling the solver for this processor, once: b (2 of 2), about 3 s\n", ""):
        with compilation(["a", "b"], 1, 3.0):
            pass
        assert capsys.readouterr().err == expected


def test_cut_compilation_is_announced_again(cache, capsys):
    with pytest.raises(KeyboardInterrupt), compilation(["a"], 0, 3.0):
        raise KeyboardInterrupt
    capsys.readouterr()
    with compilation(["a"], 0, 3.0):
        assert "compiling the solver" in capsys.readouterr().err


def test_a_terminal_counts_the_seconds(cache, capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with compilation(["a"], 0, 3.0):
        time.sleep(1.5)
    assert " s, about " in capsys.readouterr().err


def test_unwritable_cache_stops_nothing(cache, monkeypatch, capsys):
    monkeypatch.setattr(config, "CACHE_DIR", str(cache / "none"))
    for _ in range(2):
        with compilation(["a"], 0, 3.0):
            assert "compiling the solver" in capsys.readouterr().err
