"""The sphere against Hertz and JKR, and indenters of other shapes against Galin, Sneddon and JKR of power-law profiles.

Sources: see `bem.methods.closed_forms.hertz` and `bem.methods.closed_forms.jkr`.
"""

import numpy as np
import pytest

from bem import HardContact, PowerLaw, Scene, simulate
from bem.methods.boundary_elements.meshes.mesh import uniform_mesh
from bem.methods.closed_forms import hereditary_hertz, hertz, jkr
from bem.problem.indenter import tension_without_deformation
from bem.problem.materials import Elastic, StandardLinearSolid
from bem.problem.protocol import ForceProtocol, PiecewiseLinearProtocol
from tests.validation.cases import completed, ramps

EXPONENTS = (1.0, 1.5, 3.0, 8.0)
SOFT = StandardLinearSolid(0.1)
PRESS = PiecewiseLinearProtocol([0.0, 1.0, 2.0], [-1.0, 6.0, -1.0])


def shaped(exponent, tabor=1.0, material=None, **more):
    return Scene(tabor, material or Elastic(), indenter=PowerLaw(exponent), **more)


def hard(exponent, tabor=1.0, material=None, **more):
    return shaped(exponent, tabor, material, adhesion=HardContact(), **more)


@pytest.mark.parametrize("exponent", [*EXPONENTS, 2.0])
@pytest.mark.parametrize("tabor", [0.3, 3.0])
def test_elastic_is_galin_and_sneddon(exponent, tabor):
    trajectory = completed(hard(exponent, tabor), PRESS)
    exact = hertz.force_from_indentation(trajectory.indentation, tabor, exponent)
    np.testing.assert_allclose(trajectory.force, exact, atol=1e-12 * np.abs(exact).max())
    radius = hertz.contact_radius_from_indentation(trajectory.indentation, tabor, exponent)
    np.testing.assert_allclose(trajectory.contact_radius, radius, rtol=1e-5)
    assert trajectory.hysteresis == 0.0
    behind = completed(hard(exponent, tabor, spring=2.0), PRESS)
    np.testing.assert_allclose(
        behind.force, hertz.force_from_indentation(behind.indentation, tabor, exponent), atol=1e-9
    )
    np.testing.assert_allclose(behind.stage, PRESS.indentation_at(behind.time), atol=1e-9)
    loaded = completed(hard(exponent, tabor), ForceProtocol([0.0, 1.0], [-1.0, -7.0]))
    depths = [hertz.indentation_from_force(-force, tabor, exponent) for force in loaded.force]
    np.testing.assert_allclose(loaded.indentation, depths, rtol=1e-9)
    assert {trajectory.stats.method, behind.stats.method, loaded.stats.method} == {"Hertz"}


@pytest.mark.parametrize("exponent", [*EXPONENTS, 2.0])
def test_a_mesh_finds_galin_and_sneddon_too(exponent):
    reach = 1.1 * float(hertz.contact_radius_from_indentation(6.0, 1.0, exponent))
    meshed = completed(hard(exponent), PRESS, mesh=uniform_mesh(reach, 200))
    assert meshed.stats.method == "boundary elements"
    exact = hertz.force_from_indentation(meshed.indentation, 1.0, exponent)
    np.testing.assert_allclose(meshed.force, exact, atol=6e-3 * np.abs(exact).max())


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("control", [{}, {"spring": 5.0}])
def test_viscoelastic_growth_is_lee_radok(exponent, control):
    path = PiecewiseLinearProtocol([0.0, 0.3, 1.0], [0.0, 3.0, 6.0])
    trajectory = completed(hard(exponent, material=SOFT, **control), path, 1e-3)
    assert trajectory.stats.method == "elements"
    followed = PiecewiseLinearProtocol(*unique(trajectory.time, trajectory.indentation))
    exact = hereditary_hertz.force(hard(exponent, material=SOFT), followed, trajectory.time)
    np.testing.assert_allclose(trajectory.force, exact, atol=2e-3 * np.abs(exact).max())


def unique(times, values):
    """Both at different instants only."""
    kept = np.append(True, np.diff(times) > 0.0)
    return times[kept], values[kept]


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_elements_and_mesh_agree_on_contact(exponent):
    path = PiecewiseLinearProtocol([0.0, 0.5, 0.6, 1.5], [-1.0, 5.0, -1.0, 5.0])
    row = completed(hard(exponent, material=SOFT), path, 1e-3)
    reach = 1.1 * float(hertz.contact_radius_from_indentation(5.0, 1.0, exponent))
    meshed = completed(hard(exponent, material=SOFT), path, 1e-3, mesh=uniform_mesh(reach, 200))
    times = np.linspace(0.0, 1.5, 100)
    np.testing.assert_allclose(row.at(times), meshed.at(times), atol=8e-3 * np.abs(row.force).max())


@pytest.mark.parametrize("exponent", [*EXPONENTS, 2.0])
def test_jkr_error_falls_with_range(exponent):
    errors, folds = [], []
    for tabor in (1.0, 3.0, 10.0):
        lowest = np.min(jkr.indentation_from_contact_radius(np.linspace(0.01, 3.0, 3000), tabor, exponent))
        radii = np.array([1.3, 1.6, 1.9]) if exponent > 2.0 else np.array([4.0, 5.0, 6.0])
        depths = jkr.indentation_from_contact_radius(radii, tabor, exponent)
        path = PiecewiseLinearProtocol([0.0, 1.0, 2.0], [1.5 * lowest, 1.01 * depths[-1], 1.5 * lowest])
        trajectory = completed(shaped(exponent, tabor), path)
        assert trajectory.stats.method == "elastic branch"
        rise = path.indentations[1] - path.indentations[0]
        force = trajectory.at(2.0 - (depths - path.indentations[0]) / rise)
        exact = jkr.force_from_contact_radius(radii, exponent)
        errors.append(np.max(np.abs(force - exact)) / np.abs(exact).max())
        folds.append(trajectory.jumps[-1].indentation / lowest - 1.0)
    assert np.all(np.diff(errors) < 0.0), errors
    assert errors[-1] < 0.02
    assert abs(folds[-1]) < 0.03


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_pull_off_under_load_is_jkrs(exponent):
    forces = []
    for tabor in (3.0, 10.0):
        pulled = simulate(shaped(exponent, tabor), ForceProtocol([0.0, 1.0, 2.0], [0.0, -1.0, 9.0]))
        assert pulled.status.startswith("detached")
        forces.append(pulled.pull_off_force / jkr.pull_off_force(exponent) - 1.0)
    assert abs(forces[1]) < abs(forces[0]) or abs(forces[1]) < 5e-3
    assert abs(forces[1]) < 0.03


@pytest.mark.parametrize("exponent", EXPONENTS)
def test_long_range_pull_off_is_rigid(exponent):
    tabor = 0.01
    cycle = ramps(0.0, 1.0, 0.0, 1.0, -4.0)
    trajectory = completed(shaped(exponent, tabor), cycle, 1e-3)
    exact = tension_without_deformation(tabor, exponent)
    assert trajectory.at(4.0) == pytest.approx(exact, rel=0.03)
    assert trajectory.at(2.0) == pytest.approx(tension_without_deformation(tabor, exponent, 3.0), rel=0.02)


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("material", [Elastic(), SOFT])
def test_branch_and_steps_match_own_mesh(exponent, material):
    path = PiecewiseLinearProtocol([0.0, 1.0, 2.0], [-2.0, 4.0, -2.0])
    reach = {1.0: 30.0, 1.5: 13.0, 3.0: 4.5, 8.0: 2.2}[exponent]
    own = completed(shaped(exponent, material=material), path, mesh=uniform_mesh(reach, 500))
    chosen = completed(shaped(exponent, material=material), path)
    assert own.stats.method == "boundary elements"
    assert chosen.stats.method == ("boundary elements" if material.strengths.size else "elastic branch")
    times = np.linspace(0.0, 2.0, 41)
    np.testing.assert_allclose(own.at(times), chosen.at(times), atol=8e-3 * np.ptp(chosen.force))
    assert own.pull_off_force == pytest.approx(chosen.pull_off_force, rel=0.01)


@pytest.mark.parametrize(
    "scene",
    [
        Scene(2.0, Elastic()),
        Scene(2.0, SOFT),
        Scene(30.0, SOFT),
        Scene(1.0, SOFT, spring=2.0),
        Scene(1.0, Elastic(), HardContact()),
        Scene(1.0, SOFT, HardContact()),
    ],
)
def test_shape_that_is_a_paraboloid_is_one(scene):
    nearly = Scene(scene.tabor, scene.material, scene.adhesion, scene.spring, PowerLaw(2.0 + 1e-9))
    path = PiecewiseLinearProtocol([0.0, 1.0, 2.0], [-2.0 * scene.tabor, 4.0, -2.0 * scene.tabor])
    # With profiles boundary elements answer both, also at a large Tabor parameter.
    exact, trajectory = (completed(shape, path, "draft", profiles=[2.0]) for shape in (scene, nearly))
    for name in ("pull_off_force", "max_compression", "hysteresis"):
        assert getattr(trajectory, name) == pytest.approx(getattr(exact, name), rel=2e-3, abs=1e-6), name
    assert Scene(scene.tabor, indenter=PowerLaw(2)) == Scene(scene.tabor)


@pytest.mark.parametrize("exponent", EXPONENTS)
@pytest.mark.parametrize("adhesion", [None, HardContact()])
def test_profiles_carry_force_and_shape(exponent, adhesion):
    more = {} if adhesion is None else {"adhesion": adhesion}
    path = PiecewiseLinearProtocol([0.0, 1.0], [-2.0, 4.0])
    profiles = completed(shaped(exponent, material=SOFT, **more), path, profiles=[0.9, 1.0]).profiles
    for number, force in enumerate(profiles.force):
        radius, stress = profiles.radius[number], profiles.traction[number]
        finite = np.isfinite(radius)
        total = 2.0 * np.trapezoid(stress[finite] * radius[finite], radius[finite])
        assert total == pytest.approx(force, rel=0.02, abs=0.25)  # without what is beyond
        height = 1.0 - profiles.indentation[number] + radius[finite] ** exponent / exponent
        np.testing.assert_allclose(profiles.sphere[number, finite], height)
        inside = finite & (radius < 0.5)
        assert np.all(np.abs(profiles.gap[number, inside] - 1.0) < 0.3)
