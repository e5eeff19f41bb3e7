import numpy as np
import pytest

from bem import (
    ForceProtocol,
    HardContact,
    PiecewiseLinearProtocol,
    PowerLaw,
    PronySeries,
    Scene,
    StandardLinearSolid,
    simulate,
)
from bem.methods.without_adhesion.elements import Push, Row, advance, solid_of

SERIES = PronySeries([0.2, 0.3, 0.3], [0.02, 0.5, 7.0])


@pytest.mark.parametrize("seed", range(8))
def test_contact_of_any_history_is_a_disc(seed):
    """Loads of touching elements, and minus the gaps of free ones, never grow with the radius."""
    rng = np.random.default_rng(seed)
    solid, heights = solid_of(SERIES), 0.7 * np.linspace(0.0, 3.0, 40) ** 2
    row = Row(heights < 0.0, np.zeros((40, 3)), -solid.glassy * heights)
    new = Row(np.empty(40, np.bool_), np.empty((40, 3)), np.empty(40))
    depth = 0.0
    for number in range(1000):
        if number % 50 == 0:
            step = 10.0 ** rng.uniform(-4.0, 0.0)
            push = Push((rng.uniform(-1.0, 5.0) - depth) / (50.0 * step), 0.0, step)
        advance(solid, row, heights, depth, push, new)
        depth, row, new = depth + push.rate * step, new, row
        scale = 1e-9 * np.abs(row.load).max()
        assert np.all(np.diff(row.load) < scale)
        assert np.array_equal(row.touching, np.arange(40) < np.count_nonzero(row.touching))


def test_both_forms_of_a_material_are_one():
    solid = solid_of(SERIES)
    np.testing.assert_allclose(solid.released @ solid.touched, np.eye(3), atol=1e-9)
    assert solid.glassy == pytest.approx(1.0 / SERIES.modulus_ratio)


@pytest.mark.parametrize("length", [1e-12, 1e-6, 1.0, 1e6])
def test_a_step_cut_in_two_is_the_same(length):
    solid, heights = solid_of(SERIES), np.linspace(0.0, 2.0, 30) ** 2
    rows = [Row(heights < 1.0, np.zeros((30, 3)), np.maximum(1.0 - heights, 0.0)) for _ in range(3)]
    advance(solid, rows[0], heights, 1.0, Push(0.5 / length, 0.0, length), rows[1])
    uncut = rows[1].load.copy()
    advance(solid, rows[0], heights, 1.0, Push(0.5 / length, 0.0, 0.3 * length), rows[1])
    advance(solid, rows[1], heights, 1.15, Push(0.5 / length, 0.0, 0.7 * length), rows[2])
    np.testing.assert_allclose(rows[2].load, uncut, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("material", [StandardLinearSolid(1.0), StandardLinearSolid(0.1)])
def test_separated_surfaces_bear_nothing(material):
    trajectory = simulate(
        Scene(1.0, material, HardContact()), PiecewiseLinearProtocol([0.0, 1.0, 2.0], [-3.0, -1.0, -2.0])
    )
    assert trajectory.completed
    assert not trajectory.force.any()
    assert not trajectory.contact_radius.any()
    assert trajectory.detached


@pytest.mark.parametrize("material", [StandardLinearSolid(1.0), StandardLinearSolid(0.1)])
def test_sphere_leaves_with_its_weight(material):
    load = ForceProtocol([0.0, 1.0, 2.0, 3.0], [-1.0, -2.0, 2.0, -1.0])
    trajectory = simulate(Scene(1.0, material, HardContact()), load)
    assert trajectory.status.startswith("detached: ")
    assert trajectory.time[-1] == 1.5
    assert trajectory.force[-1] == pytest.approx(0.0, abs=1e-4)
    assert sum(trajectory.stats.steps_by_phase.values()) == trajectory.stats.steps == trajectory.time.size - 1


@pytest.mark.parametrize("material", [StandardLinearSolid(1.0), StandardLinearSolid(0.1)])
def test_weightless_sphere_leaves_at_once(material):
    trajectory = simulate(Scene(1.0, material, HardContact()), ForceProtocol([0.0, 1.0], [0.0, 1.0]))
    assert trajectory.status.startswith("detached: ")
    assert (trajectory.time.tolist(), trajectory.force.tolist()) == ([0.0], [0.0])


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0])
def test_load_from_zero_takes_few_steps(power):
    """The indentation begins with an infinite rate."""
    scene = Scene(1.5, StandardLinearSolid(0.6), HardContact(), indenter=PowerLaw(power))
    trajectory = simulate(scene, ForceProtocol([0.0, 1.0, 2.0], [0.0, -3.0, -3.0]), "reference", most_work=1e8)
    begun = simulate(scene, ForceProtocol([0.0, 1.0, 2.0], [-1e-3, -3.0, -3.0]), "reference")
    assert trajectory.completed
    assert trajectory.stats.steps < 300
    assert trajectory.indentation[-1] == pytest.approx(begun.indentation[-1], rel=1e-3)


@pytest.mark.parametrize("seed", range(12))
def test_a_soft_spring_gives_numbers(seed):
    rng = np.random.default_rng(seed)
    tabor, k, spring = 10.0 ** rng.uniform([-3.3, -3.2, -1.5], [-0.5, -0.3, 0.5])
    protocol = PiecewiseLinearProtocol(np.append(0.0, np.cumsum(10.0 ** rng.uniform(-2, 1, 4))), rng.uniform(-2, 5, 5))
    trajectory = simulate(Scene(tabor, StandardLinearSolid(k), HardContact(), spring=spring), protocol)
    assert trajectory.completed
    assert np.all(np.isfinite(trajectory.force + trajectory.indentation + trajectory.contact_radius))
    assert trajectory.stats.method == "elements"


def test_a_sphere_flies_behind_a_soft_spring():
    material = PronySeries([0.02, 0.34, 0.02], [0.3, 0.5, 4.3])
    scene = Scene(3.5e-4, material, HardContact(), spring=0.14, indenter=PowerLaw(7.0))
    trajectory = simulate(scene, PiecewiseLinearProtocol([0.0, 1.0, 2.0], [-3.0, 0.7, -4.0]), "draft", most_work=1e8)
    assert trajectory.completed
    assert trajectory.stats.method == "elements"


@pytest.mark.parametrize("accuracy", ["draft", "standard"])
@pytest.mark.parametrize("material", [StandardLinearSolid(0.1), SERIES])
def test_contact_radius_of_loading_is_that_of_hertz(material, accuracy):
    """Lee and Radok: while the contact grows its radius is that of an elastic one at the same indentation."""
    scene = Scene(2.0, material, HardContact())
    trajectory = simulate(scene, PiecewiseLinearProtocol([0.0, 1.0, 4.0], [0.0, 10.0, 0.0]), accuracy)
    loading = (trajectory.time <= 1.0) & (trajectory.indentation > 0.5)
    radius = np.sqrt(trajectory.indentation[loading] / scene.tabor)
    error = np.abs(trajectory.contact_radius[loading] - radius).max() / radius.max()
    assert error < 0.5 * trajectory.accuracy
