import numpy as np
import pytest

from bem.discretisation.hat_influence import hat_influence, kernel_series, second_integral
from bem.discretisation.influence import influence_matrix, unit_influence
from bem.discretisation.ring_moments import ring_moments


def test_the_quadrature_is_the_moments_of_the_kernel():
    x = np.concatenate([np.linspace(0.02, 0.9, 20), np.linspace(1.1, 6.0, 20), [100.0, 3000.0]])
    (uniform, linear), (to_one, linear_to_one) = ring_moments(x), ring_moments(np.ones(1))
    expected = x * (uniform - to_one) - (linear - linear_to_one)
    np.testing.assert_allclose(second_integral(x), expected, rtol=1e-10)


def test_equal_spacing_gives_the_unit_influence():
    np.testing.assert_allclose(hat_influence(np.arange(200), kernel_series()), unit_influence(200), rtol=2e-7)


@pytest.mark.parametrize("places", [[0, 1, 2, 4, 8, 16, 64, 1024, 2048], [0, 3000, 6000, 6001, 6002, 6010, 9000]])
def test_uneven_nodes_give_the_influence_matrix(places):
    found = hat_influence(np.array(places), kernel_series())
    expected = influence_matrix(np.array(places, dtype=float)).T
    np.testing.assert_allclose(found[:-1], expected[:-1], rtol=2e-6)
    assert np.all(found[-1] > expected[-1])  # the last hat is whole
