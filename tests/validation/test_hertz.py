"""Contact without adhesion against Hertz (Johnson, Contact Mechanics, 1985, section 4.2)."""

import numpy as np
import pytest

from bem import Elastic, HardContact, LoadingProtocol, PiecewiseLinearProtocol, Scene, StandardLinearSolid
from bem.reference_solutions import hertz
from tests.validation.cases import completed

PEAK = 20.0


def run(tabor, material, protocol, accuracy="standard", **options):
    return completed(Scene(tabor=tabor, material=material, adhesion=HardContact()), protocol, accuracy, **options)


@pytest.mark.parametrize("tabor", [0.2, 1.0, 5.0])
def test_the_elastic_force_is_hertz_on_the_way_in_and_out(tabor):
    protocol = LoadingProtocol(peak_indentation=PEAK, loading_rate=1.0, dwell_time=0.0, unloading_rate=3.0)
    trajectory = run(tabor, Elastic(), protocol, 1e-3)
    exact = hertz.force_from_indentation(trajectory.indentation, tabor)
    deep = trajectory.indentation >= 0.05 * PEAK
    assert np.count_nonzero(deep) > 50
    np.testing.assert_allclose(trajectory.force[deep], exact[deep], rtol=1e-3)
    assert np.max(np.abs(trajectory.force - exact)) < 1e-3 * np.max(np.abs(exact))
    assert np.all(trajectory.force[trajectory.indentation < 0.0] == 0.0)
    assert trajectory.hysteresis < 1e-3 * PEAK * abs(trajectory.max_compression)


def test_the_contact_radius_is_hertz():
    protocol = PiecewiseLinearProtocol([0.0, 1.0], [-1.0, PEAK])
    trajectory = run(1.0, Elastic(), protocol, 1e-3)
    deep = trajectory.indentation > 0.2 * PEAK
    exact = hertz.contact_radius_from_indentation(trajectory.indentation, 1.0)
    np.testing.assert_allclose(trajectory.contact_radius[deep], exact[deep], rtol=0.01)


@pytest.mark.parametrize("ratio", [0.1, 0.01])
@pytest.mark.parametrize("fast", [True, False])
def test_fast_loading_is_hertz_with_the_glassy_modulus_and_slow_loading_with_the_rubbery(ratio, fast):
    path = PiecewiseLinearProtocol([0.0, 1e-7 * ratio if fast else 1e5], [0.0, PEAK])
    trajectory = run(1.0, StandardLinearSolid(ratio), path)
    deep = trajectory.indentation >= 0.2 * PEAK
    exact = hertz.force_from_indentation(trajectory.indentation, 1.0) / (ratio if fast else 1.0)
    np.testing.assert_allclose(trajectory.force[deep], exact[deep], rtol=2e-3)


def test_a_step_relaxes_from_glassy_to_rubbery_with_the_short_time():
    ratio = 0.1
    path = PiecewiseLinearProtocol([0.0, 1e-6, 1.0], [0.0, PEAK, PEAK])
    trajectory = run(1.0, StandardLinearSolid(ratio), path, 1e-3)
    # a held indentation keeps the contact area, and the relaxation modulus 1 + (1/k - 1) exp(-t/k) its form
    times = np.linspace(0.001, 1.0, 30)
    exact = float(hertz.force_from_indentation(PEAK, 1.0)) * (1.0 + (1.0 / ratio - 1.0) * np.exp(-times / ratio))
    np.testing.assert_allclose(trajectory.at(times), exact, rtol=2e-3)
