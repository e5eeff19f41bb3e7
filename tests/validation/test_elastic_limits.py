"""Elastic adhesive contact between the rigid and the JKR limit.

The largest tensions and the two folds were found by an independent solver; the rigid limit is Bradley's.
"""

import pytest

from bem import Scene
from tests.validation.cases import completed, ramps

LARGEST_TENSION = {
    0.02: 2.0,
    0.05: 1.9884,
    0.2: 1.9201,
    1.0: 1.6707,
    2.0: 1.5836,
    3.0: 1.5510,
    5.0: 1.5259,
    8.0: 1.5132,
}
FOLDS = {1.0: (-1.6291, -1.7435), 2.0: (-2.5517, -3.3816), 3.0: (-3.2277, -4.9884)}
STAGE = (-2.8896, -5.2913)  # where it snaps in and off behind a spring of 0.4, mu = 1


def cycle(tabor, accuracy=1e-3, **changes):
    lowest = None if not changes else -10.0
    protocol = ramps(2.0, 1.0, 0.0, 1.0, lowest)
    return completed(Scene(tabor, **changes), protocol, accuracy)


@pytest.mark.parametrize(("tabor", "tension"), LARGEST_TENSION.items())
@pytest.mark.parametrize("accuracy", ["draft", "standard", 1e-3])
def test_the_largest_tension(tabor, tension, accuracy):
    assert cycle(tabor, accuracy).pull_off_force == pytest.approx(tension, rel=2e-3 if tabor < 0.05 else 4e-4)


@pytest.mark.parametrize(("tabor", "folds"), FOLDS.items())
@pytest.mark.parametrize("accuracy", ["draft", "standard", 1e-3])
def test_the_jumps(tabor, folds, accuracy):
    snap_in, snap_off = cycle(tabor, accuracy).jumps
    assert (snap_in.indentation, snap_off.indentation) == pytest.approx(folds, rel=2e-4)
    assert snap_in.force_before < snap_in.force_after
    assert snap_off.force_before > snap_off.force_after


def test_a_soft_spring_moves_the_jumps():
    jumps = cycle(1.0, spring=0.4).jumps
    assert [jump.indentation - jump.force_before / 0.4 for jump in jumps] == pytest.approx(STAGE, rel=2e-4)


@pytest.mark.parametrize("accuracy", [0.05, 0.03, "draft", 0.008])
def test_loose_answer_is_not_pinned(accuracy):
    trajectory = cycle(3.2, accuracy)
    assert len(trajectory.jumps) == 2
    assert trajectory.pull_off_force == pytest.approx(cycle(3.2).pull_off_force, rel=0.01)


@pytest.mark.parametrize("tabor", [0.05, 0.2, 0.5])
def test_long_ranged_adhesion_is_reversible(tabor):
    trajectory = cycle(tabor)
    assert trajectory.jumps == ()
    travel = 2.0 * (trajectory.indentation.max() - trajectory.indentation.min())
    assert trajectory.hysteresis < 1e-3 * trajectory.pull_off_force * travel
