import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid, recursion_step, relaxation_spectrum


def relaxation_transform(s, moduli, times):
    """Carson transform s E(s) / E0 of the relaxation modulus."""
    return 1.0 + np.sum(moduli * s * times / (1.0 + s * times))


def creep_transform(s, material):
    """Carson transform s E0 C(s) of the creep compliance."""
    return 1.0 - np.sum(material.strengths * s * material.times / (1.0 + s * material.times))


@st.composite
def spectra(draw):
    count = draw(st.integers(1, 8))
    logs = sorted(draw(st.lists(st.floats(-6, 6), min_size=count, max_size=count, unique_by=lambda x: round(x, 2))))
    moduli = draw(st.lists(st.floats(1e-6, 1e4), min_size=count, max_size=count))
    return np.array(moduli), 10.0 ** np.array(logs)


@given(spectra(), st.floats(-8, 8))
def test_interconversion_laplace_identity(spectrum, log_s):
    moduli, times = spectrum
    material = PronySeries.from_moduli(moduli, times)
    s = 10.0**log_s
    assert relaxation_transform(s, moduli, times) * creep_transform(s, material) == pytest.approx(1.0, rel=1e-8)
    assert np.all(material.strengths > 0.0)
    assert np.all(material.times > np.sort(times) * (1.0 - 1e-12))
    assert material.modulus_ratio * (1.0 + moduli.sum()) == pytest.approx(1.0, rel=1e-8)


@pytest.mark.parametrize("count", [1, 2, 5, 25])
def test_spectra_of_twelve_decades(count):
    generator = np.random.default_rng(count)
    moduli, times = 10.0 ** generator.uniform(-1.0, 1.0, count), np.logspace(-6.0, 6.0, count)
    weights, roots = relaxation_spectrum(PronySeries.from_moduli(moduli, times))
    np.testing.assert_allclose(weights, moduli, rtol=1e-9)
    np.testing.assert_allclose(roots, times, rtol=1e-11)


@pytest.mark.parametrize(("modulus", "time", "strength"), [(9.0, 0.1, 0.9), (1e-20, 1.0, 1e-20)])
def test_weak_single_term_is_the_sls(modulus, time, strength):
    material = PronySeries.from_moduli([modulus], [time])
    assert material.strengths == pytest.approx([strength])
    assert material.times == pytest.approx([1.0])


def test_elastic_scenes_have_no_memory():
    for material in (Elastic(), StandardLinearSolid(modulus_ratio=1.0), PronySeries([0.0], [1.0])):
        assert material.strengths.shape == material.times.shape == (0,)
        assert material.strengths.dtype == np.float64
        assert material.modulus_ratio == 1.0
        np.testing.assert_array_equal(material.creep_compliance([0.0, 1.0]), [1.0, 1.0])


@pytest.mark.parametrize(
    ("solid", "terms"),
    [(StandardLinearSolid(0.1), [(0.9, 1.0)]), (PronySeries([0.5, 0.2], [0.1, 10.0]), [(0.5, 0.1), (0.2, 10.0)])],
)
def test_creep_compliance_sums_the_terms(solid, terms):
    time = np.linspace(0.0, 5.0, 11)
    expected = 1.0 - sum(strength * np.exp(-time / tau) for strength, tau in terms)
    np.testing.assert_allclose(solid.creep_compliance(time), expected, rtol=1e-14)
    assert solid.creep_compliance(0.0) == pytest.approx(solid.modulus_ratio)


def test_prony_series_are_sorted_values():
    material = PronySeries([0.2, 0.0, 0.3], [5.0, 2.0, 1.0])
    assert material == PronySeries([0.3, 0.2], [1.0, 5.0])
    assert hash(material) == hash(PronySeries([0.3, 0.2], [1.0, 5.0]))
    assert material != Elastic()
    assert repr(material) == "PronySeries(compliances=[0.3, 0.2], times=[1.0, 5.0])"
    assert material.modulus_ratio == pytest.approx(0.5)
    with pytest.raises(ValueError, match="read-only"):
        material.times[0] = 2.0


@given(st.floats(-300, 300), st.floats(-6, 6))
def test_recursion_is_accurate_for_any_step(log_dt, log_time):
    dt, time = 10.0**log_dt, 10.0**log_time
    decay, gain = recursion_step(dt, time)
    ratio = dt / time
    assert decay == pytest.approx(np.exp(-ratio), rel=1e-15)
    expected = 1.0 - ratio / 2.0 + ratio**2 / 6.0 if ratio < 1e-5 else -np.expm1(-ratio) / ratio
    assert gain == pytest.approx(expected, rel=1e-14)


def test_no_step_changes_nothing():
    assert recursion_step(0.0, 2.0) == (1.0, 1.0)
    assert recursion_step(np.inf, 2.0) == (0.0, 0.0)
