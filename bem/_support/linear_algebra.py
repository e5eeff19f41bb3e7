"""Small dense systems inside compiled kernels: products, LU factorisation, and the sign of a determinant.

Every matrix is passed as its transpose, whose rows are the columns of the matrix. Each inner loop then adds
multiples of contiguous rows: the compiler vectorises it without changing the order of any sum, so results do not
depend on the width of a processor's vector registers.

Why this is written here: the systems of a contact have 20 to 100 unknowns. LAPACK takes up to three times as long for
one of them, and its results differ between processors. Source: G. H. Golub and C. F. Van Loan, Matrix Computations,
4th ed., 2013, sections 3.2 and 3.4.
"""

import numpy as np

from bem._support.jit import kernel

_PANEL = 4  # rows eliminated together, so that the rest of the matrix is read a quarter as often


@kernel
def copy_into(target: np.ndarray, source: np.ndarray) -> None:
    """Copy a vector; Numba's own assignment of slices takes seconds to compile, for the formatting of its errors."""
    for i in range(target.size):
        target[i] = source[i]


@kernel
def dot(left: np.ndarray, right: np.ndarray) -> float:
    """Scalar product of two vectors (n,)."""
    total = 0.0
    for i in range(left.size):
        total += left[i] * right[i]
    return total


@kernel
def add_rows(rows: np.ndarray, factors: np.ndarray, out: np.ndarray) -> None:
    """Add the sum of factors[i] * rows[i] to `out` (m,); `rows` (n, m) are the columns of a matrix, `factors` (n,)."""
    count = rows.shape[0]
    i = 0
    while i + 4 <= count:
        f0, f1, f2, f3 = factors[i], factors[i + 1], factors[i + 2], factors[i + 3]
        r0, r1, r2, r3 = rows[i], rows[i + 1], rows[i + 2], rows[i + 3]
        for j in range(out.size):
            out[j] = out[j] + f0 * r0[j] + f1 * r1[j] + f2 * r2[j] + f3 * r3[j]
        i += 4
    while i < count:
        f0, r0 = factors[i], rows[i]
        for j in range(out.size):
            out[j] += f0 * r0[j]
        i += 1


@kernel
def lu_factor(columns: np.ndarray, order: int, pivots: np.ndarray) -> None:
    """Factorise the leading `order` x `order` block in place, with pivoting.

    Args:
        columns: float64 (n, n), row j is column j of the matrix.
        order: at most n.
        pivots: int32 (n,), overwritten.
    """
    start = 0
    while start < order:
        stop = min(start + _PANEL, order)
        for q in range(start, stop):
            best, largest = q, abs(columns[q, q])
            for i in range(q + 1, order):
                if abs(columns[i, q]) > largest:
                    best, largest = i, abs(columns[i, q])
            pivots[q] = best
            if best != q:
                for j in range(order):
                    columns[q, j], columns[best, j] = columns[best, j], columns[q, j]
            inverse = 1.0 / columns[q, q]
            for i in range(q + 1, order):
                columns[i, q] *= inverse
                for j in range(q + 1, stop):
                    columns[i, j] -= columns[i, q] * columns[q, j]
        for q in range(start, stop):
            for i in range(q + 1, stop):
                factor = columns[i, q]
                for j in range(stop, order):
                    columns[i, j] -= factor * columns[q, j]
        if stop < order:  # what the panel contributes to all rows below it
            r0, r1 = columns[start, stop:order], columns[start + 1, stop:order]
            r2, r3 = columns[start + 2, stop:order], columns[start + 3, stop:order]
            for i in range(stop, order):
                f0, f1, f2, f3 = columns[i, start], columns[i, start + 1], columns[i, start + 2], columns[i, start + 3]
                row = columns[i, stop:order]
                for j in range(order - stop):
                    row[j] = row[j] - f0 * r0[j] - f1 * r1[j] - f2 * r2[j] - f3 * r3[j]
        start = stop


@kernel
def lu_solve(columns: np.ndarray, order: int, pivots: np.ndarray, rhs: np.ndarray) -> None:
    """Overwrite the first `order` entries of `rhs` by the solution of the factorised system."""
    k = 0
    while k + 4 <= order:
        for q in range(k, k + 4):
            rhs[q] /= columns[q, q]
            for j in range(q + 1, k + 4):
                rhs[j] -= rhs[q] * columns[q, j]
        y0, y1, y2, y3 = rhs[k], rhs[k + 1], rhs[k + 2], rhs[k + 3]
        r0, r1, r2, r3 = columns[k], columns[k + 1], columns[k + 2], columns[k + 3]
        for j in range(k + 4, order):
            rhs[j] = rhs[j] - y0 * r0[j] - y1 * r1[j] - y2 * r2[j] - y3 * r3[j]
        k += 4
    while k < order:
        rhs[k] /= columns[k, k]
        for j in range(k + 1, order):
            rhs[j] -= rhs[k] * columns[k, j]
        k += 1
    while k >= 4:
        for q in range(k - 1, k - 5, -1):
            for j in range(k - 4, q):
                rhs[j] -= rhs[q] * columns[q, j]
        x0, x1, x2, x3 = rhs[k - 4], rhs[k - 3], rhs[k - 2], rhs[k - 1]
        r0, r1, r2, r3 = columns[k - 4], columns[k - 3], columns[k - 2], columns[k - 1]
        for j in range(k - 4):
            rhs[j] = rhs[j] - x0 * r0[j] - x1 * r1[j] - x2 * r2[j] - x3 * r3[j]
        k -= 4
    while k > 0:
        for j in range(k - 1):
            rhs[j] -= rhs[k - 1] * columns[k - 1, j]
        k -= 1
    for q in range(order - 1, -1, -1):
        if pivots[q] != q:
            rhs[q], rhs[pivots[q]] = rhs[pivots[q]], rhs[q]


@kernel
def determinant_is_negative(columns: np.ndarray, order: int, pivots: np.ndarray) -> bool:
    """Sign of the determinant of a factorised matrix: negative when an odd number of its eigenvalues is."""
    negative = False
    for i in range(order):
        if (columns[i, i] < 0.0) != (pivots[i] != i):
            negative = not negative
    return negative
