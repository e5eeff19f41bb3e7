from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipk

from bem.reference_solutions import displacements

RADII = [0.0, 0.3, 0.9, 1.0, 1.2, 4.0]


def by_quadrature(pressure, r):
    """int G(r, s) p(s) s ds with the paper's kernel, split at its singularity."""

    def integrand(s):
        return 4.0 / (np.pi * max(r, s)) * ellipk((min(r, s) / max(r, s)) ** 2) * pressure(s) * s

    pieces = sorted({0.0, min(r, 1.0), 1.0})
    return sum(quad(integrand, begin, end, epsabs=1e-12, limit=400)[0] for begin, end in pairwise(pieces))


@pytest.mark.parametrize("r", RADII)
@pytest.mark.parametrize(
    ("displacement", "pressure"),
    [
        (displacements.hertz_pressure, lambda s: np.sqrt(1.0 - s**2)),
        (displacements.uniform_disc, lambda s: np.ones_like(s)),
        (displacements.cone_pressure, lambda s: 1.0 - s),
    ],
)
def test_closed_forms_equal_the_integral_of_the_kernel(displacement, pressure, r):
    assert displacement(r) == pytest.approx(by_quadrature(pressure, r), rel=1e-8)


def test_landmarks():
    np.testing.assert_allclose(displacements.uniform_disc([0.0, 1.0]), [2.0, 4.0 / np.pi], rtol=1e-14)
    np.testing.assert_allclose(displacements.cone_pressure([0.0, 1.0]), [1.0, 0.37180785], rtol=1e-8)
    np.testing.assert_allclose(displacements.hertz_pressure([0.0, 1.0]), [np.pi / 2.0, np.pi / 4.0], rtol=1e-14)


@pytest.mark.parametrize(
    ("displacement", "load"),
    [
        (displacements.hertz_pressure, 2.0 * np.pi / 3.0),
        (displacements.uniform_disc, np.pi),
        (displacements.cone_pressure, np.pi / 3.0),
    ],
)
def test_far_field_is_that_of_a_point_load(displacement, load):
    assert displacement(1e3) == pytest.approx(load / (np.pi * 1e3), rel=1e-6)


def test_the_disc_may_have_any_size():
    both = displacements.uniform_disc(0.6, disc_radius=2.0), 2.0 * displacements.uniform_disc(0.3)
    assert both[0] == pytest.approx(both[1], rel=1e-11)
