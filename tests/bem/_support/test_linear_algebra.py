import numpy as np
import pytest

from bem._support.jit import kernel
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
def test_agrees_with_numpy_from_inside_a_kernel(size, order):
    rng = np.random.default_rng(size + order)
    matrix = rng.standard_normal((size, size))
    rhs = rng.standard_normal((2, size))
    block = matrix[:order, :order].copy()
    solutions = rhs.copy()
    negative = solve_twice(matrix.T.copy(), order, solutions[0], solutions[1])
    for given, found in zip(rhs, solutions, strict=True):
        np.testing.assert_allclose(found[:order], np.linalg.solve(block, given[:order]), rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(found[order:], given[order:])
    assert negative == (np.linalg.slogdet(block)[0] < 0.0)


@pytest.mark.parametrize("negatives", [0, 1, 2, 3])
def test_the_sign_counts_negative_eigenvalues(negatives):
    rng = np.random.default_rng(negatives)
    vectors = rng.standard_normal((9, 9))
    values = np.where(np.arange(9) < negatives, -1.0, 1.0) * rng.uniform(0.5, 2.0, 9)
    matrix = vectors @ np.diag(values) @ np.linalg.inv(vectors)
    assert solve_twice(matrix.T.copy(), 9, np.ones(9), np.ones(9)) == bool(negatives % 2)


@pytest.mark.parametrize("rows", [0, 1, 3, 4, 5, 8, 11])
def test_products_agree_with_numpy(rows):
    rng = np.random.default_rng(rows)
    matrix, factors, out = rng.standard_normal((rows, 13)), rng.standard_normal(rows), rng.standard_normal(13)
    expected = out + factors @ matrix
    add_rows(matrix, factors, out)
    np.testing.assert_allclose(out, expected, rtol=1e-13, atol=1e-13)
    assert dot(factors, 2.0 * factors) == pytest.approx(2.0 * np.sum(factors**2), rel=1e-13)


def test_a_matrix_that_needs_pivoting_is_solved():
    matrix = np.array([[0.0, 2.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 3.0]])
    solution, other = np.array([1.0, 2.0, 3.0]), np.ones(3)
    negative = solve_twice(matrix.T.copy(), 3, solution, other)
    np.testing.assert_allclose(matrix @ solution, [1.0, 2.0, 3.0])
    assert negative == (np.linalg.det(matrix) < 0.0)
