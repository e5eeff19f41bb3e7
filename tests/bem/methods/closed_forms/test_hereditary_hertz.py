import numpy as np
import pytest
from scipy.integrate import quad

from bem import HardContact, LoadingProtocol, Scene, StandardLinearSolid
from bem.methods.closed_forms import hereditary_hertz, hertz

PROTOCOL = LoadingProtocol(
    peak_indentation=4.0, loading_rate=8.0, dwell_time=0.3, unloading_rate=8.0, start_indentation=-2.0
)


def test_ramp_is_the_modulus_integral():
    k, tabor = 0.1, 1.3
    history = PROTOCOL.history(tabor)
    time = 0.6

    def rate(s):
        modulus = 1.0 + (1.0 / k - 1.0) * np.exp(-(time - s) / k)
        return modulus * 1.5 * 8.0 * np.sqrt(max(8.0 * s - 2.0, 0.0)) / tabor**1.5

    exact = -4.0 / (3.0 * np.pi) * quad(rate, 0.25, time, epsrel=1e-11)[0]
    force = hereditary_hertz.force(Scene(tabor, StandardLinearSolid(k), HardContact()), history, time)
    assert force == pytest.approx(exact, rel=1e-4)


def test_without_relaxation_it_is_hertz():
    history = PROTOCOL.history(1.0)
    times = np.linspace(0.0, 0.9, 7)
    force = hereditary_hertz.force(Scene(1.0, StandardLinearSolid(1.0)), history, times)
    np.testing.assert_allclose(force, hertz.force_from_indentation(history.indentation_at(times), 1.0), atol=1e-4)
