import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from bem import tractions
from bem.tractions import GAP_AT_PEAK, PEAK_TRACTION, potential, slope, tail_energy, tail_force, traction


def test_equilibrium_and_peak():
    assert traction(1.0) == 0.0
    assert slope(GAP_AT_PEAK) == pytest.approx(0.0, abs=1e-14)
    assert traction(GAP_AT_PEAK) == pytest.approx(PEAK_TRACTION, rel=1e-14)
    assert pytest.approx(1.0264, abs=1e-4) == PEAK_TRACTION


def test_work_of_adhesion_is_one():
    assert quad(traction, 1.0, np.inf)[0] == pytest.approx(1.0, rel=1e-10)


@given(st.floats(0.05, 50.0))
def test_values_match_the_formula_and_slope_its_derivative(gap):
    assert traction(gap) == pytest.approx(8.0 / 3.0 * (gap**-3 - gap**-9), rel=1e-12, abs=1e-13 * gap**-9)
    step = 1e-6 * gap
    numerical = (traction(gap + step) - traction(gap - step)) / (2.0 * step)
    assert slope(gap) == pytest.approx(numerical, rel=1e-6, abs=1e-8 * gap**-10)


@given(st.floats(0.8, 100.0))
def test_tail_force_is_the_integral_of_the_traction(gap):
    integral = quad(traction, gap, np.inf, epsabs=0.0, epsrel=1e-11)[0]
    assert tail_force(gap) == pytest.approx(2.0 * integral, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("gap", [0.8, 1.0, 1.5, 10.0])
def test_energies_are_integrals_of_the_traction_and_of_the_potential(gap):
    attraction = quad(traction, gap, np.inf, epsabs=0.0, epsrel=1e-11)[0]
    assert potential(gap) == pytest.approx(-attraction, rel=1e-8)
    beyond = quad(potential, gap, np.inf, epsabs=0.0, epsrel=1e-11)[0]
    assert tail_energy(gap) == pytest.approx(2.0 * beyond, rel=1e-8)


def test_kernels_are_compiled_and_the_laws_are_values():
    assert all(hasattr(getattr(tractions, name), "py_func") for name in ("traction", "slope", "tail_force"))
    assert tractions.LennardJones() == tractions.LennardJones()
    assert tractions.LennardJones() != tractions.HardContact()
