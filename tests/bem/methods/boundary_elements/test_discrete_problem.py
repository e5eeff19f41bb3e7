"""A scene in the terms of the kernels."""

import numpy as np
import pytest

from bem import ForceProtocol, HardContact, LennardJones, PiecewiseLinearProtocol, Scene, StandardLinearSolid
from bem.methods.boundary_elements.discrete_problem import deepest_indentation, problem_of
from bem.problem.accuracy import resolve_accuracy

PATH = PiecewiseLinearProtocol([0.0, 1.0], [-5.0, 10.0])


@pytest.mark.parametrize(("adhesion", "tension"), [(LennardJones(), 2.0), (HardContact(), 0.0)])
def test_sphere_stays_above_the_bound(adhesion, tension):
    def deepest(path=PATH, spring=None):
        return deepest_indentation(Scene(2.0, adhesion=adhesion, spring=spring), path)

    assert deepest() == 10.0
    stiff, depth, soft = (deepest(spring=spring) for spring in (1e12, 1.0, 0.1))
    assert stiff == pytest.approx(10.0, rel=1e-9)
    assert stiff > depth > soft
    assert depth == pytest.approx(10.0 + tension - 4.0 / (3.0 * np.pi) * (depth / 2.0) ** 1.5)
    pressed = deepest(ForceProtocol([0.0, 1.0], [0.0, -5.0]))
    assert pressed == pytest.approx(2.0 * (0.75 * np.pi * (5.0 + tension)) ** (2.0 / 3.0))


@pytest.mark.parametrize(
    ("scene", "moves"), [(Scene(1.0), False), (Scene(40.0), True), (Scene(40.0, StandardLinearSolid(0.1)), True)]
)
def test_moving_grid_has_its_own_controls(scene, moves):
    accuracy = resolve_accuracy("draft")
    problem = problem_of(scene, PATH, accuracy)
    assert (problem.scheme.series.size > 0) is moves
    assert (problem.controls == accuracy.line_controls()) is moves
    assert problem.scheme.grid.smooth


@pytest.mark.parametrize(
    ("depth", "dwell", "finer"), [(10.0, 9.0, False), (10.0, 11.0, True), (10.0, 1e3, True), (-20.0, 1e3, False)]
)
def test_long_dwell_takes_a_finer_mesh(depth, dwell, finer):
    """An edge that creeps to rest sticks at the nodes of the mesh that fast ramps allow."""
    scene, accuracy = Scene(3.0, StandardLinearSolid(0.1)), resolve_accuracy("standard")
    held = PiecewiseLinearProtocol([0.0, 0.1, 0.1 + dwell, 0.2 + dwell], [-30.0, depth, depth, -30.0])
    spacing, fast = (problem_of(scene, path, accuracy).controls.edge_spacing for path in (held, PATH))
    assert (spacing < 0.95 * fast) is finer


FAST, SLOW, HOLD = [20.0, 0.0, -20.0], [1e-3, -1e-3], [0.0]


@pytest.mark.parametrize(
    ("rates", "wide"),
    [
        (FAST, 0),
        (SLOW + FAST, 0),  # what is remembered of a slow edge is as fine as it is
        ([1e-3, 0.0, -20.0], 0),  # one cycle
        (FAST + SLOW, 3),
        (FAST + HOLD + SLOW, 4),
        (FAST + FAST + [-1e-3] + FAST, 6),
        (HOLD + FAST + [1e-3] + FAST, 4),
    ],
)
def test_spacing_doubles_unless_cycled(rates, wide):
    times = np.arange(len(rates) + 1.0)
    path = PiecewiseLinearProtocol(times, np.cumsum([-3.0, *rates]))
    scheme = problem_of(Scene(1.0, StandardLinearSolid(0.1)), path, resolve_accuracy("standard")).scheme
    assert scheme.wide_segments == wide
    assert scheme.wide.spacing == (2.0 if wide else 1.0) * scheme.grid.spacing
