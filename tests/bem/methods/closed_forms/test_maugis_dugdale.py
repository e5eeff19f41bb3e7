import numpy as np
import pytest

from bem.methods.closed_forms import dmt, jkr
from bem.methods.closed_forms import maugis_dugdale as maugis


def test_johnson_greenwood_conversion():
    assert maugis.maugis_parameter(1.0) == pytest.approx(1.157, abs=1e-3)


def test_pull_off_runs_from_dmt_to_jkr():
    tabors = [1e-3, 0.1, 0.3, 1.0, 3.0, 30.0]
    forces = [maugis.pull_off_force(tabor) for tabor in tabors]
    assert np.all(np.diff(forces) < 0.0)
    assert forces[0] == pytest.approx(dmt.PULL_OFF_FORCE, rel=2e-3)
    assert forces[-1] == pytest.approx(jkr.PULL_OFF_FORCE, rel=1e-3)


def test_large_tabor_is_jkr():
    depths = np.array([-10.0, 0.0, 50.0, 400.0])
    force = maugis.force_from_indentation(depths, 30.0)
    np.testing.assert_allclose(force, jkr.force_from_indentation(depths, 30.0), rtol=2e-3)


def test_small_tabor_is_dmt():
    force = maugis.force_from_indentation([0.05, 0.5], 1e-3)
    np.testing.assert_allclose(force, dmt.force_from_indentation([0.05, 0.5], 1e-3), rtol=5e-3)


def test_series_meets_the_closed_expression():
    below, above = (maugis.solution_at_angle(0.02 + side, 1.0) for side in (-1e-9, 1e-9))
    np.testing.assert_allclose(below, above, rtol=6e-7)


def test_the_crack_closes_the_energy_balance():
    """The first equation of the theory, evaluated from what the module returns."""
    theta, tabor = 0.7, 0.8
    radius, _, _ = maugis.solution_at_angle(theta, tabor)
    a, lam, m = radius * maugis.RADIUS_UNIT, maugis.maugis_parameter(tabor), 1.0 / np.cos(theta)
    root = np.sqrt(m**2 - 1.0)
    balance = 0.5 * lam * a**2 * (root + (m**2 - 2.0) * theta) + 4.0 / 3.0 * lam**2 * a * (root * theta - m + 1.0)
    assert balance == pytest.approx(1.0, rel=1e-12)


def test_no_contact_is_nan():
    assert np.isnan(maugis.force_from_indentation(-1e3, 1.0))
    with pytest.raises(ValueError, match="tabor must be a finite number greater than 0"):
        maugis.force_from_indentation(0.0, -1.0)
