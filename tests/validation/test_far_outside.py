"""Random scenes far outside what people need: whatever is called completed is finite and within closed bounds."""

import numpy as np
import pytest

import bem
from bem import ConstantStress, Exponential, HardContact, LennardJones
from bem.methods.physical_bounds import most_tension

BUDGET = 2e9  # in multiply-adds; a scene that takes more ends there, and says so


def far_outside(seed):
    """One scene and protocol: any law, solid, tip, spring and rate."""
    rng = np.random.default_rng([57, seed])

    def between(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    tabor, terms = between(1e-5, 50.0), int(rng.integers(0, 4))
    solid = bem.Elastic()
    if terms == 1:
        solid = bem.StandardLinearSolid(between(1e-3, 0.999))
    elif terms > 1:
        shares = rng.dirichlet(np.ones(terms)) * rng.uniform(0.1, 0.999)
        solid = bem.PronySeries(shares, [between(1e-3, 1e3) for _ in shares])
    laws = LennardJones(), Exponential(), ConstantStress(between(0.05, 1.0)), HardContact()
    tip = bem.PowerLaw(rng.uniform(1.0, 8.0)) if rng.random() < 0.4 else None
    spring = between(1e-3, 1e3) if rng.random() < 0.4 else None
    scene = bem.Scene(tabor, solid, laws[rng.integers(4)], spring, tip)
    instants = np.append(0.0, np.cumsum([between(1e-5, 1e3) for _ in range(4)]))
    if rng.random() < 0.25:
        return scene, bem.ForceProtocol(instants, [0.0, *(-between(1e-2, 1e2) for _ in range(3)), rng.uniform(-1, 2)])
    deep = between(0.1, 10.0) * max(tabor, 1.0)
    depths = -3.0 * max(tabor, 1.0), deep, rng.uniform(-1.0, 1.0) * deep, deep, -4.0 * max(tabor, 1.0)
    return scene, bem.PiecewiseLinearProtocol(instants, depths)


def ended(seed):
    """Status of a scene far outside, after what it computed was looked at."""
    scene, protocol = far_outside(seed)
    trajectory = bem.simulate(scene, protocol, "draft", most_work=BUDGET)
    if trajectory.completed and trajectory.time.size:
        columns = trajectory.time, trajectory.indentation, trajectory.force, trajectory.contact_radius
        assert all(np.isfinite(column).all() for column in columns), (seed, scene, trajectory.status)
        largest, rounding = float(trajectory.force.max()), 1e-9 * float(np.abs(trajectory.force).max())
        assert largest <= 1.04 * most_tension(scene) + rounding, (seed, scene, largest)
    return trajectory.status


def test_no_scene_far_outside_is_unphysical():
    assert sum(bem.results.trajectory.is_completed(ended(seed)) for seed in range(12)) >= 4


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 500, 50))
def test_none_of_500_scenes_is_unphysical(first):
    assert sum(bem.results.trajectory.is_completed(ended(seed)) for seed in range(first, first + 50)) >= 20
