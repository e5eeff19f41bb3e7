from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipkm1

from bem.discretisation.ring_moments import ring_moments


def kernel_at_one(t):
    """G(1, t), the complementary parameter formed without cancellation."""
    ratio = min(t, 1.0 / t)
    return 4.0 / (np.pi * max(1.0, t)) * float(ellipkm1((1.0 - ratio) * (1.0 + ratio)))


def moment_by_quadrature(x, power):
    """Integral over (0, x) of G(1, t) t^power dt, with panels graded towards the logarithm at t = 1."""
    graded = 2.0 ** -np.arange(0.0, 44.0)
    points = np.concatenate([[0.0], 1.0 - graded, [1.0], 1.0 + graded[::-1], 2.0 ** np.arange(2.0, 12.0)])
    limits = np.unique(np.append(points[points < x], x))
    return sum(quad(lambda t: kernel_at_one(t) * t**power, a, b, epsrel=1e-13)[0] for a, b in pairwise(limits))


@pytest.mark.parametrize("x", [1e-3, 0.3, 0.6999, 0.7001, 0.99, 1.0, 1.01, 1.0 / 0.7, 1.43, 3.0, 500.0])
def test_ring_moments_agree_with_quadrature(x):
    uniform, linear = ring_moments(np.array([x]))
    assert uniform[0] == pytest.approx(moment_by_quadrature(x, 1), rel=1e-11)
    assert linear[0] == pytest.approx(moment_by_quadrature(x, 2), rel=1e-11)
