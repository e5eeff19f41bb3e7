"""The same answer on one core and two, in any order, and after an interruption."""

import numpy as np
import pytest
from joblib import Parallel, delayed

from bem import LoadingProtocol, PronySeries, Scene, StandardLinearSolid, simulate
from bem.dataset.designs import Design


def cases():
    drawn = Design("log-uniform").protocols(6, seed=21)
    found = []
    for i in range(6):
        quantities = {name: float(values[i]) for name, values in drawn.items()}
        found.append((Scene(quantities.pop("tabor"), StandardLinearSolid(0.1)), LoadingProtocol(**quantities)))
    found.append((Scene(1.0, PronySeries([0.3, 0.4], [0.2, 2.0])), found[0][1]))
    return found


def force(case):
    trajectory = simulate(*case, "draft")
    return trajectory.time, trajectory.force


def same(first, second):
    for one, other in zip(first, second, strict=True):
        np.testing.assert_array_equal(one[0], other[0])
        np.testing.assert_array_equal(one[1], other[1])


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


def test_deeper_protocols_before_do_not_change_the_answer(answers):
    """The influence matrix that is kept grows with the deepest scene so far."""
    deep = LoadingProtocol(peak_indentation=100.0, loading_rate=1e3, dwell_time=0.01, unloading_rate=1e3)
    simulate(Scene(3.2, StandardLinearSolid(0.1)), deep, "draft")
    same([force(case) for case in cases()], answers)
