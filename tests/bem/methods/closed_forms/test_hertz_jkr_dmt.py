import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from bem.methods.closed_forms import dmt, hertz, jkr


def test_hertz_in_its_own_units():
    assert hertz.contact_radius_from_indentation(4.0, 1.0) == 2.0
    np.testing.assert_allclose(hertz.force_from_indentation([-1.0, 3.0], 3.0), [0.0, -4.0 / (3.0 * np.pi)])


@pytest.mark.parametrize("tabor", [0.3, 1.0, 5.0])
def test_jkr_pull_off_by_load_and_depth(tabor):
    largest = minimize_scalar(lambda a: -jkr.force_from_contact_radius(a), bounds=(0.1, 5.0), method="bounded")
    assert -largest.fun == pytest.approx(jkr.PULL_OFF_FORCE, rel=1e-9)
    lowest = minimize_scalar(
        lambda a: jkr.indentation_from_contact_radius(a, tabor), bounds=(0.1, 5.0), method="bounded"
    )
    assert lowest.x == pytest.approx(jkr.FOLD_RADIUS, rel=1e-4)
    assert lowest.fun == pytest.approx(jkr.fold_indentation(tabor), rel=1e-9)
    assert jkr.force_from_contact_radius(jkr.FOLD_RADIUS) == pytest.approx(jkr.FOLD_FORCE)


def test_jkr_landmarks_of_the_book():
    assert jkr.force_from_indentation(0.0, 2.0) == pytest.approx(4.0 / 3.0)
    radius_without_load = (4.5 * np.pi) ** (1.0 / 3.0)
    assert jkr.force_from_contact_radius(radius_without_load) == pytest.approx(0.0, abs=1e-12)


@given(st.floats(0.1, 20.0), st.floats(0.51, 200.0))
def test_jkr_branch_inverts_the_radius(tabor, radius):
    a = max(radius, 1.01 * jkr.FOLD_RADIUS)
    indentation = jkr.indentation_from_contact_radius(a, tabor)
    assert jkr.contact_radius_from_indentation(indentation, tabor) == pytest.approx(a, rel=1e-10)


def test_jkr_has_no_contact_beyond_the_fold():
    beyond = 1.001 * jkr.fold_indentation(2.0)
    assert np.isnan(jkr.force_from_indentation(beyond, 2.0))
    assert jkr.force_from_indentation(jkr.fold_indentation(2.0), 2.0) == pytest.approx(jkr.FOLD_FORCE, rel=1e-6)


def test_jkr_nears_hertz_when_deep():
    ratio = jkr.force_from_indentation(1e8, 1.0) / hertz.force_from_indentation(1e8, 1.0)
    assert ratio == pytest.approx(1.0, abs=1e-4)


def test_dmt_and_rigid_limits():
    assert dmt.force_from_indentation(0.0, 0.1) == dmt.PULL_OFF_FORCE
    assert np.isnan(dmt.force_from_indentation(-0.1, 0.1))
    largest = minimize_scalar(lambda x: -dmt.rigid_force_from_indentation(x), bounds=(-1.0, 0.5), method="bounded")
    assert largest.x == pytest.approx(0.0, abs=1e-5)
    assert -largest.fun == pytest.approx(dmt.PULL_OFF_FORCE)
