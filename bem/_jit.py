"""The one decorator of every compiled kernel, so that caching and error handling are decided in a single place.

`error_model="numpy"` lets a division by zero give an infinity instead of raising inside a kernel; `fastmath` stays off
because a NaN must remain visible.
"""

from numba import njit

kernel = njit(cache=True, error_model="numpy", nogil=True)
