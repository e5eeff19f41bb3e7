from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipk

from bem.methods.closed_forms import displacements

RADII = [0.0, 0.3, 0.9, 1.0, 1.2, 4.0, 1e3]


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
def test_closed_forms_are_kernel_integrals(displacement, pressure, r):
    assert displacement(r) == pytest.approx(by_quadrature(pressure, r), rel=1e-8)


def test_the_disc_may_have_any_size():
    both = displacements.uniform_disc(0.6, disc_radius=2.0), 2.0 * displacements.uniform_disc(0.3)
    assert both[0] == pytest.approx(both[1], rel=1e-11)
