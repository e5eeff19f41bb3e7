"""Complete elliptic integrals of the first and second kind.

Written here because importing SciPy's special functions takes longer than a simulation; they agree to rounding.
"""

import numpy as np


def elliptic_integrals(complement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Complete elliptic integrals K and E by the arithmetic-geometric mean.

    Args:
        complement: 1 - k^2 with k the modulus, of any shape, from 0 (where K is taken at 1e-300) to 1.

    Returns:
        K and E, same shape. Source: Abramowitz and Stegun, section 17.6.
    """
    mean = np.ones_like(complement)
    root = np.sqrt(np.maximum(complement, 1e-300))
    share, power = 0.5 * (1.0 - np.asarray(complement)), 0.5
    while np.any(mean - root > 1e-9 * mean):
        half_difference = 0.5 * (mean - root)
        mean, root = 0.5 * (mean + root), np.sqrt(mean * root)
        power *= 2.0
        share = share + power * half_difference**2
    first = np.pi / (mean + root)  # the two differ by rounding now, and their next mean by its square
    return first, first * (1.0 - share)
