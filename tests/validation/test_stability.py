"""No accepted state is unstable, and each jump starts where the smallest eigenvalue vanishes, at every accuracy."""

import numpy as np
import pytest

from bem import Scene, StandardLinearSolid, simulate
from bem.methods.boundary_elements.jumps import is_unstable
from bem.problem.tractions import slope
from bem.simulation import count_unstable
from tests.bem.methods.contacts import lennard_jones, mesh_for
from tests.validation.cases import case, corners_of_the_papers_box, drawn_from_the_papers_box, ramps

# Largest eigenvalue of the last state before a jump; of a contact at rest it is about 1. Last digits change how near to
# a fold the longer steps of draft come.
AT_A_FOLD = {"draft": 0.1, "standard": 0.05, 1e-3: 0.05}


def assert_stable(scene, protocol, accuracy):
    assert count_unstable(scene, protocol, accuracy) == 0
    for jump in simulate(scene, protocol, accuracy).jumps:
        assert 0.0 <= jump.eigenvalue_before < AT_A_FOLD[accuracy], jump
        assert jump.eigenvalue_after > 0.0, jump


@pytest.mark.parametrize("accuracy", ["draft", "standard"])
@pytest.mark.parametrize("tabor", [0.2, 1.0, 3.2])
def test_fast_deep_states_are_stable(tabor, accuracy):
    assert_stable(*case(tabor, 0.1, 100.0, 1000.0, 0.001, 1000.0), accuracy)


@pytest.mark.parametrize("tabor", [1.1, 3.0])
def test_elastic_states_are_stable(tabor):
    protocol = ramps(5.0, 1.0, 0.0, 1.0)
    assert_stable(Scene(tabor), protocol, "standard")


@pytest.mark.parametrize(
    ("tabor", "ratio", "spring", "quantities"),
    [
        (5.316873658476408, 0.7756758488989576, 0.508368479497854, (0.59940202438, 0.39209586212, 12.43288608132)),
        (5.784228622807013, 0.5895452471596649, 0.8920491944325272, (4.93633637589, 145.38252489496, 4.86580984788)),
        (7.636038601647814, 0.5226689115331333, 1.8274505638971905, (1.14487486814, 76.15176015927, 9.78708197326)),
    ],
)
def test_states_behind_a_spring_are_stable(tabor, ratio, spring, quantities):
    """The factorisation kept from the pressed contact knows nothing of the fold, and a step may pass it."""
    depth, loading, unloading = quantities
    dwell = 0.1 if tabor > 7.0 else 0.0
    fast = ramps(depth, loading, dwell, unloading)
    scene = Scene(tabor, StandardLinearSolid(ratio), spring=spring)
    assert count_unstable(scene, fast, "draft") == 0


def test_count_sees_a_negative_eigenvalue():
    tabor = 3.0
    _, mesh = mesh_for(tabor, edge=0.0, peak=1.0)
    for height in np.linspace(4.0, 1.3, 200):  # of an undeformed sphere, until something must let go
        gap = height + 0.5 * tabor * mesh.radii**2
        slopes = np.array([slope(h) for h in gap])
        values = np.linalg.eigvals(np.eye(gap.size) + tabor * mesh.influence.T * slopes).real
        if np.min(values) < -0.02:
            break
        assert np.min(values) < 0.02 or not is_unstable(lennard_jones(tabor), mesh.influence, gap, 1.0)
    assert np.sum(values < 0.0) == 1
    assert is_unstable(lennard_jones(tabor), mesh.influence, gap, 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", ["draft", "standard", 1e-3])
def test_papers_box_is_stable(accuracy):
    for scene, protocol in [*corners_of_the_papers_box(), *drawn_from_the_papers_box(100)]:
        assert_stable(scene, protocol, accuracy)


@pytest.mark.slow
def test_stiffer_and_softer_are_stable():
    for ratio in (0.5, 0.03, 0.01):
        for scene, protocol in drawn_from_the_papers_box(30):
            stiff = Scene(scene.tabor, StandardLinearSolid(ratio))
            assert count_unstable(stiff, protocol, "standard") == 0
