"""Traction laws other than Lennard-Jones: Maugis's closed form, the limits of JKR and DMT, and energy.

Maugis's law has two jumps; the solver's rises within 0.02 and falls within `width`. The deviations below are those of
this smoothing and of the standard accuracy together. Source: Maugis, J. Colloid Interface Sci. 150 (1992) 243.
"""

import numpy as np
import pytest

from bem import ConstantStress, Elastic, Exponential, LennardJones, Scene, StandardLinearSolid
from bem.methods.closed_forms import maugis_dugdale
from bem.simulation import count_unstable
from tests.validation.cases import completed, ramps

CYCLE = ramps(2.0, 1.0, 0.0, 1.0)


def run(tabor, law, material=None, accuracy="standard", protocol=CYCLE):
    return completed(Scene(tabor, material or Elastic(), law), protocol, accuracy)


@pytest.mark.parametrize("tabor", [0.2, 0.5, 1.0, 2.0, 3.0])
def test_pull_off_is_maugis_to_0_5_percent(tabor):
    expected = maugis_dugdale.pull_off_force(tabor)
    assert run(tabor, ConstantStress()).pull_off_force == pytest.approx(expected, rel=5e-3)
    assert run(tabor, Exponential()).pull_off_force > 1.005 * expected  # so that the comparison can fail


def test_steeper_fall_is_nearer_to_maugis():
    expected = maugis_dugdale.pull_off_force(0.5)
    wide, narrow = (run(0.5, ConstantStress(width), accuracy=1e-3).pull_off_force for width in (1.0, 0.15))
    assert abs(narrow / expected - 1.0) < 3e-3  # what remains is the rise, and the repulsion that yields
    assert abs(wide / expected - 1.0) > 2.0 * abs(narrow / expected - 1.0)


@pytest.mark.parametrize(("accuracy", "error"), [("draft", 1.7e-2), ("standard", 4e-3), (1e-3, 1e-3)])
@pytest.mark.parametrize("width", [0.4, 1.0])
def test_small_tabor_tends_to_bradley(width, accuracy, error):
    for tabor in (1e-5, 1e-3):
        trajectory = run(tabor, ConstantStress(width), accuracy=accuracy, protocol=ramps(1.0, 1.0, 0.0, 1.0, -5.0))
        assert trajectory.force.max() == pytest.approx(2.0, rel=error), tabor


def deviation(tabor, law):
    """Largest deviations from Maugis while the contact opens: of the force, in units of the larger of the force and the
    pull-off force, and of the contact radius."""
    trajectory = run(tabor, law)
    radius, depth, force = maugis_dugdale.solution_at_angle(np.geomspace(1e-3, 1.57, 4000)[::-1], tabor)
    stable = slice(int(np.argmin(depth)), None)  # from the fold to the deepest contact
    contact = trajectory.unloading & (trajectory.contact_radius > 0.2)
    contact &= (trajectory.indentation > depth[stable][0] + 0.02) & (trajectory.indentation < 1.9)
    assert np.sum(contact) > 10
    depths, forces = trajectory.indentation[contact], trajectory.force[contact]
    off = forces - np.interp(depths, depth[stable], force[stable])
    miss = trajectory.contact_radius[contact] - np.interp(depths, depth[stable], radius[stable])
    scale = np.maximum(np.abs(forces), maugis_dugdale.pull_off_force(tabor))
    return np.max(np.abs(off) / scale), np.max(np.abs(miss))


@pytest.mark.parametrize(
    ("tabor", "of_force", "of_radius"), [(0.2, 0.05, 0.25), (1.0, 0.012, 0.06), (3.0, 0.012, 0.02)]
)
def test_opening_contact_follows_maugis(tabor, of_force, of_radius):
    """At long range, where the contact is small, the rise of the traction and the repulsion that yields count most."""
    force, radius = deviation(tabor, ConstantStress())
    assert force < of_force
    assert radius < of_radius
    force, radius = deviation(tabor, LennardJones())
    assert force > 4.0 * of_force
    assert radius > 2.0 * of_radius


def test_exponential_tends_to_dmt_and_jkr():
    tabors = (0.02, 0.2, 1.0, 5.0)
    forces = np.array([run(tabor, Exponential()).pull_off_force for tabor in tabors])
    assert np.all(np.diff(forces) < 0.0)
    assert forces[0] == pytest.approx(2.0, rel=5e-3)
    assert forces[-1] == pytest.approx(1.5, rel=1e-2)


@pytest.mark.parametrize("law", [ConstantStress(), Exponential()])
@pytest.mark.parametrize("rate", [0.3, 10.0])
def test_viscoelastic_loop_dissipates(law, rate):
    protocol = ramps(3.0, rate, 0.5, rate)
    scene = Scene(1.0, StandardLinearSolid(0.1), law)
    trajectory = run(scene.tabor, law, scene.material, protocol=protocol)
    assert trajectory.work() > 0.0
    assert trajectory.pull_off_force > 1.2 * run(scene.tabor, law).pull_off_force
    assert count_unstable(scene, protocol) <= sum(jump.eigenvalue_before <= 0.0 for jump in trajectory.jumps)
