import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bem.methods.closed_forms import persson_brener as pb

velocities = st.floats(-6.0, 6.0).map(lambda x: 10.0**x)
ratios = st.floats(-3.0, 0.0).map(lambda x: 10.0**x)


@given(velocities, ratios)
def test_both_forms_agree(velocity, ratio):
    gamma = pb.effective_energy(velocity, ratio)
    assert 1.0 <= gamma <= (1.0 + 1e-15) / ratio
    if 1.0 < gamma < 1.0 / ratio and ratio < 1.0:
        assert pb.effective_energy(pb.crack_velocity(gamma, ratio), ratio) == pytest.approx(gamma, rel=1e-10)


@given(velocities, ratios)
def test_the_papers_equations_hold(velocity, ratio):
    gamma = pb.effective_energy(velocity, ratio)
    x = gamma / (2.0 * np.pi * velocity)
    s = 1.0 / (np.sqrt(1.0 + x**2) + x)
    assert gamma * (1.0 - (1.0 - ratio) * s) == pytest.approx(1.0, rel=1e-9, abs=1e-12 * gamma)
    scaled = np.pi * velocity
    cubic = [1.0 - ratio, scaled * ratio * (2.0 - ratio) - (1.0 - ratio), -2.0 * scaled, scaled]
    terms = cubic * gamma ** np.arange(3, -1, -1)
    assert abs(terms.sum()) <= 1e-10 * np.abs(terms).sum()


def test_limits_and_shapes():
    assert pb.effective_energy(0.0, 0.1) == 1.0
    assert pb.effective_energy(1e12, 0.1) == pytest.approx(10.0, rel=1e-8)
    np.testing.assert_array_equal(pb.effective_energy([1e-3, 1.0, 1e3], 1.0), 1.0)
    assert pb.effective_energy(np.ones((3, 1)), np.full(4, 0.5)).shape == (3, 4)
    assert np.all(np.diff(pb.effective_energy(np.geomspace(1e-6, 1e6, 99), 0.01)) > 0.0)
    assert pb.crack_velocity(1.0, 0.1) == 0.0
    assert pb.crack_velocity(10.0, 0.1) == np.inf


def test_length_scale_is_the_papers():
    assert pb.length_scale(3.24) == pytest.approx(4.252, abs=5e-4)
