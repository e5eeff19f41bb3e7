"""The displacement by a ring of traction, its integrals, and the matrix made of them."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipe, ellipkm1

from bem.methods.boundary_elements.influence.on_any_nodes import (
    elliptic_integrals,
    hat_influence,
    kernel_series,
    ring_moments,
    second_integral,
)
from bem.methods.boundary_elements.influence.triangles import force_weights, influence_matrix, unit_influence
from bem.methods.closed_forms import displacements


def test_elliptic_integrals_agree_with_scipy():
    complement = np.concatenate([[1e-300, 1e-30], np.geomspace(1e-16, 1.0, 200)])
    first, second = elliptic_integrals(complement)
    np.testing.assert_allclose(first, ellipkm1(complement), rtol=2e-15)
    np.testing.assert_allclose(second, ellipe(1.0 - complement), rtol=1e-14)


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


@pytest.mark.parametrize("radii", [np.linspace(0.0, 1.0, 50), np.concatenate([[0.0], np.geomspace(1e-3, 1.0, 60)])])
def test_disc_and_cone_are_exact(radii):
    matrix = influence_matrix(radii)
    uniform = matrix @ np.ones(radii.size)
    cone = matrix @ (1.0 - radii)
    np.testing.assert_allclose(uniform, displacements.uniform_disc(radii), rtol=1e-12)
    np.testing.assert_allclose(cone, displacements.cone_pressure(radii), rtol=1e-10)
    assert uniform[[0, -1]] == pytest.approx([2.0, 4.0 / np.pi], rel=1e-13)
    assert cone[[0, -1]] == pytest.approx([1.0, 0.37180785], abs=1e-8)


def test_the_kernel_is_homogeneous():
    radii = np.append(0.0, np.geomspace(0.01, 4.0, 30))
    np.testing.assert_allclose(influence_matrix(37.0 * radii), 37.0 * influence_matrix(radii), rtol=1e-12)


@pytest.mark.parametrize("radii", [np.linspace(0.0, 2.0, 80), np.append(0.0, np.geomspace(0.05, 2.0, 40))])
def test_every_traction_stores_energy(radii):
    energy = force_weights(radii)[:, None] * influence_matrix(radii)
    assert np.min(np.linalg.eigvals(influence_matrix(radii)).real) > 0.0
    assert np.min(np.linalg.eigvalsh(energy + energy.T)) > 0.0


def test_a_far_observer_sees_a_point_force():
    radii = np.array([0.0, 0.5, 1.0, 500.0, 1000.0])
    traction = np.array([1.0, 0.5, 0.0, 0.0, 0.0])
    displacement = influence_matrix(radii)[3] @ traction
    # G(r, s) -> 2 / r far away, and P = 2 int sigma r dr
    assert displacement == pytest.approx(force_weights(radii) @ traction / 500.0, rel=1e-5)


def test_force_weights_are_exact():
    radii = np.array([0.0, 0.3, 0.35, 1.0, 2.5])
    weights = force_weights(radii)
    assert weights @ np.ones(5) == pytest.approx(2.5**2)
    assert weights @ radii == pytest.approx(2.0 / 3.0 * 2.5**3)


def test_unit_spacing_gives_radii_influence():
    size = 150
    direct = influence_matrix(np.arange(size + 1.0)).T[:size, :size]
    np.testing.assert_allclose(unit_influence(size), direct, rtol=3e-10)


@pytest.mark.parametrize(("hat", "observer"), [(600, 3), (40, 599), (300, 285), (14, 0), (13, 2)])
def test_hats_agree_with_quadrature(hat, observer):
    def integrand(s):
        return (1.0 - abs(s - hat)) * (2.0 if observer == 0 else kernel_at_one(s / observer) / observer * s)

    expected = sum(quad(integrand, hat + a, hat + a + 1.0, epsabs=0.0, epsrel=1e-13)[0] for a in (-1.0, 0.0))
    assert unit_influence(601)[hat, observer] == pytest.approx(expected, rel=3e-11)


def test_quadrature_has_kernel_moments():
    x = np.concatenate([np.linspace(0.02, 0.9, 20), np.linspace(1.1, 6.0, 20), [100.0, 3000.0]])
    (uniform, linear), (to_one, linear_to_one) = ring_moments(x), ring_moments(np.ones(1))
    expected = x * (uniform - to_one) - (linear - linear_to_one)
    np.testing.assert_allclose(second_integral(x), expected, rtol=1e-10)


def test_equal_spacing_is_unit_influence():
    np.testing.assert_allclose(hat_influence(np.arange(200), kernel_series()), unit_influence(200), rtol=1e-8)


@pytest.mark.parametrize("places", [[0, 1, 2, 4, 8, 16, 64, 1024, 2048], [0, 3000, 6000, 6001, 6002, 6010, 9000]])
def test_uneven_nodes_give_the_matrix(places):
    influence = hat_influence(np.array(places), kernel_series())
    expected = influence_matrix(np.array(places, dtype=float)).T
    np.testing.assert_allclose(influence[:-1], expected[:-1], rtol=2e-6)
    assert np.all(influence[-1] > expected[-1])  # the last hat is whole
