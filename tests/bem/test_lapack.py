import numpy as np
import pytest

from bem._jit import kernel
from bem._lapack import determinant_is_negative, lu_factor, lu_solve


@kernel
def solve_twice(matrix, order, first, second):
    """Factorise once, solve for two right-hand sides; the sign of the determinant."""
    pivots = np.empty(matrix.shape[0], dtype=np.int32)
    lu_factor(matrix, order, pivots)
    lu_solve(matrix, order, pivots, first)
    lu_solve(matrix, order, pivots, second)
    return determinant_is_negative(matrix, order, pivots)


@pytest.mark.parametrize(("size", "order"), [(1, 1), (2, 2), (7, 7), (60, 60), (60, 23), (5, 1)])
def test_agrees_with_numpy_from_inside_a_kernel(size, order):
    rng = np.random.default_rng(size + order)
    matrix = rng.standard_normal((size, size))
    rhs = rng.standard_normal((2, size))
    block = matrix[:order, :order].copy()
    solutions = rhs.copy()
    negative = solve_twice(matrix, order, solutions[0], solutions[1])
    for given, found in zip(rhs, solutions, strict=True):
        np.testing.assert_allclose(found[:order], np.linalg.solve(block, given[:order]), rtol=1e-9, atol=1e-12)
        np.testing.assert_array_equal(found[order:], given[order:])
    assert negative == (np.linalg.slogdet(block)[0] < 0.0)


@pytest.mark.parametrize("negatives", [0, 1, 2, 3])
def test_the_sign_counts_negative_eigenvalues(negatives):
    rng = np.random.default_rng(negatives)
    vectors = rng.standard_normal((9, 9))
    values = np.where(np.arange(9) < negatives, -1.0, 1.0) * rng.uniform(0.5, 2.0, 9)
    matrix = np.ascontiguousarray(vectors @ np.diag(values) @ np.linalg.inv(vectors))
    assert solve_twice(matrix, 9, np.ones(9), np.ones(9)) == bool(negatives % 2)
