"""Moduli, spectra, fits and shifts of linear viscoelasticity, against closed forms and each other."""

import numpy as np
import pytest
from scipy.integrate import quad

from bem import Elastic, PronySeries, StandardLinearSolid
from bem.materials_library import (
    complex_modulus,
    fit_prony,
    loss_modulus,
    relaxation_spectrum,
    shifted,
    storage_modulus,
    wlf_shift,
)


def test_sls_moduli_are_the_textbooks():
    solid = StandardLinearSolid(0.1)
    omega = np.geomspace(1e-3, 1e4, 20)
    g, t = 1.0 / 0.1 - 1.0, 0.1  # relaxation strength and time: t = k tau
    phase = omega * t
    np.testing.assert_allclose(storage_modulus(solid, omega), 1.0 + g * phase**2 / (1.0 + phase**2), rtol=1e-12)
    np.testing.assert_allclose(loss_modulus(solid, omega), g * phase / (1.0 + phase**2), rtol=1e-12)
    assert storage_modulus(solid, 0.0, 3e6) == 3e6
    assert storage_modulus(solid, 1e12, 3e6) == pytest.approx(3e7)
    assert storage_modulus(Elastic(), 5.0) == 1.0
    assert loss_modulus(Elastic(), 5.0) == 0.0
    assert np.ravel(relaxation_spectrum(solid)) == pytest.approx([g, t], rel=1e-12)
    assert relaxation_spectrum(Elastic())[0].size == 0


def test_complex_modulus_transforms_creep():
    series = PronySeries([0.3, 0.4], [0.2, 3.0])
    omega = 1.7
    # i omega times the transform of C: C(0) plus that of its rate.
    parts = [
        quad(
            lambda t, f=f: (
                sum(c / tau * np.exp(-t / tau) for c, tau in zip([0.3, 0.4], [0.2, 3.0], strict=True)) * f(omega * t)
            ),
            0,
            100,
        )[0]
        for f in (np.cos, np.sin)
    ]
    compliance = series.modulus_ratio + parts[0] - 1j * parts[1]
    assert complex_modulus(series, omega) == pytest.approx(1.0 / compliance, rel=1e-6)


def test_series_is_recovered_from_moduli():
    true = PronySeries.from_moduli([2.0, 4.0, 1.0], [1e-3, 1e-1, 1e1])
    omega = np.geomspace(1e-3, 1e5, 80)
    fitted = fit_prony(omega, storage_modulus(true, omega, 2e6), loss_modulus(true, omega, 2e6), terms=40)
    assert fitted.relaxed_modulus == pytest.approx(2e6, rel=0.01)
    assert fitted.relative_error < 0.05
    np.testing.assert_allclose(
        storage_modulus(fitted.material, omega, fitted.relaxed_modulus), storage_modulus(true, omega, 2e6), rtol=0.05
    )


def test_williams_landel_ferry_shift():
    universal = {"reference": 0.0, "c1": 17.44, "c2": 51.6}
    assert wlf_shift(0.0, **universal) == 1.0
    assert wlf_shift(50.0, **universal) == pytest.approx(10 ** (-17.44 * 50 / 101.6))
    with pytest.raises(ValueError, match=r"temperature must be a finite number greater than -51.6"):
        wlf_shift(-60.0, **universal)
    cold = shifted(StandardLinearSolid(0.2), 1e3)
    assert cold == PronySeries([0.8], [1e3])
    assert shifted(Elastic(), 5.0) == Elastic()
    np.testing.assert_allclose(complex_modulus(cold, 2.0), complex_modulus(StandardLinearSolid(0.2), 2e3), rtol=1e-12)
