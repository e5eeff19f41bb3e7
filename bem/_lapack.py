"""LU factorisation inside compiled kernels, by the LAPACK that SciPy ships.

Numba knows `np.linalg.solve` but not a factorisation that is kept and used again. SciPy's LAPACK routines are
registered here as linker symbols, so that kernels calling them can still be cached on disk. Matrices are row-major,
which LAPACK sees transposed; `lu_solve` therefore asks for the transposed solve.
"""

import llvmlite.binding as llvm
import numpy as np
from numba import types
from numba.extending import get_cython_function_address

from bem._jit import kernel

for _routine in ("dgetrf", "dgetrs"):
    llvm.add_symbol(f"bem_{_routine}", get_cython_function_address("scipy.linalg.cython_lapack", _routine))

_doubles, _ints, _chars = types.CPointer(types.float64), types.CPointer(types.int32), types.CPointer(types.uint8)
_getrf = types.ExternalFunction("bem_dgetrf", types.void(_ints, _ints, _doubles, _ints, _ints, _ints))
_getrs = types.ExternalFunction(
    "bem_dgetrs", types.void(_chars, _ints, _ints, _doubles, _ints, _ints, _doubles, _ints, _ints)
)
_TRANSPOSED = ord("T")


@kernel
def lu_factor(matrix: np.ndarray, order: int, pivots: np.ndarray) -> None:
    """Factorise the leading `order` x `order` block of `matrix` in place.

    Args:
        matrix: contiguous float64 (n, n).
        order: at most n.
        pivots: int32 (n,), overwritten.
    """
    size = np.array([order, matrix.shape[1], 0], dtype=np.int32)
    _getrf(size.ctypes, size.ctypes, matrix.ctypes, size[1:].ctypes, pivots.ctypes, size[2:].ctypes)


@kernel
def lu_solve(matrix: np.ndarray, order: int, pivots: np.ndarray, rhs: np.ndarray) -> None:
    """Overwrite the first `order` entries of `rhs` by the solution of the factorised system."""
    size = np.array([order, matrix.shape[1], 1, 0], dtype=np.int32)
    how = np.array([_TRANSPOSED], dtype=np.uint8)
    _getrs(
        how.ctypes,
        size.ctypes,
        size[2:].ctypes,
        matrix.ctypes,
        size[1:].ctypes,
        pivots.ctypes,
        rhs.ctypes,
        size[1:].ctypes,
        size[3:].ctypes,
    )


@kernel
def determinant_is_negative(matrix: np.ndarray, order: int, pivots: np.ndarray) -> bool:
    """Sign of the determinant of a factorised matrix: negative when an odd number of its eigenvalues is."""
    negative = False
    for i in range(order):
        if (matrix[i, i] < 0.0) != (pivots[i] != i + 1):
            negative = not negative
    return negative
