"""The same answer on one core and two, and in any order."""

import numpy as np
import pytest
from joblib import Parallel, delayed

from bem import PronySeries, Scene, StandardLinearSolid, simulate
from tests.validation.cases import drawn_from_the_papers_box, ramps


def cases():
    drawn = drawn_from_the_papers_box(6)
    return [*drawn, (Scene(1.0, PronySeries([0.3, 0.4], [0.2, 2.0])), drawn[0][1])]


def force(case):
    trajectory = simulate(*case, "draft")
    return trajectory.time, trajectory.force


def same(first, second):
    for mine, theirs in zip(first, second, strict=True):
        np.testing.assert_array_equal(mine[0], theirs[0])
        np.testing.assert_array_equal(mine[1], theirs[1])


@pytest.fixture(scope="module")
def answers():
    return [force(case) for case in cases()]


WAYS = {
    "in another order": lambda: [force(case) for case in cases()[::-1]][::-1],
    "in two processes": lambda: Parallel(n_jobs=2)(delayed(force)(case) for case in cases()),
    "in two threads": lambda: Parallel(n_jobs=2, backend="threading")(delayed(force)(case) for case in cases()),
}


@pytest.mark.parametrize("way", WAYS)
def test_the_answer_is_the_same(answers, way):
    same(WAYS[way](), answers)


def test_deeper_runs_before_change_nothing(answers):
    """The influence matrix that is kept grows with the deepest scene so far."""
    deep = ramps(100.0, 1e3, 0.01, 1e3)
    simulate(Scene(3.2, StandardLinearSolid(0.1)), deep, "draft")
    same([force(case) for case in cases()], answers)
