"""The trajectory of an elastic contact at a large Tabor parameter, read off the curve of its equilibria.

An elastic contact remembers nothing but the branch it is on. It moves along the curve (`bem.solver.elastic.curve`) as
the indentation does; at a fold it jumps, at fixed indentation, to the next point of the curve that is stable. Stable
are the parts on which the indentation grows along the curve: at a fold one eigenvalue of the Jacobian changes its sign.
Between the points that were solved the curve is the cubic through the four nearest.
"""

import math
from dataclasses import dataclass

import numpy as np

from bem.scene import Scene
from bem.solver.elastic.curve import Equilibrium, Lattice, lattice_of, solve_closed, solve_open, trace
from bem.solver.instabilities import smallest_eigenvalue
from bem.solver.problem import Problem
from bem.solver.stepping.time_stepping import COMPLETED, NO_EQUILIBRIUM, Marched
from bem.solver.work import FOLD_SOLVES, NODES, STEPS, new_work
from bem.tractions import LENNARD_JONES, LennardJones

_BETWEEN = 48  # samples from one solved point to the next ...
_RECORDED = 8  # ... of which one in so many is recorded
_ROUNDING = 1e-12
_SMALLEST_TABOR = 2.0  # below, the edge is held firmly, and time steps follow it well
_USUAL_TABOR = 4.5  # from here on the curve costs less than time steps, also where a grid that stays would do
_SNAP_IN = 2.64  # undeformed gap at which surfaces snap together, over mu^(3/7); by `simulate`, mu from 4.5 to 8


@dataclass(frozen=True)
class Curve:
    """The curve, finely sampled, from surfaces far apart to the deepest contact; all (n,)."""

    depth: np.ndarray
    force: np.ndarray
    edge: np.ndarray
    energy: np.ndarray
    axis_gap: np.ndarray


def _refined(along: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, q) at `along` (n,), n at least 4, at `_BETWEEN` equal steps from each to the next."""
    n = along.size
    interval = np.append(np.repeat(np.arange(n - 1), _BETWEEN), n - 2)
    part = np.append(np.tile(np.arange(_BETWEEN) / _BETWEEN, n - 1), 1.0)
    x = along[interval] + part * (along[interval + 1] - along[interval])
    first = np.clip(interval - 1, 0, n - 4)
    total = np.zeros((x.size, values.shape[1]))
    for a in range(4):
        weight = np.ones(x.size)
        for b in range(4):
            if a != b:
                weight *= (x - along[first + b]) / (along[first + a] - along[first + b])
        total += weight[:, None] * values[first + a]
    return total


def sampled(apart: list[Equilibrium], contact: list[Equilibrium]) -> Curve:
    """The curve through these points, at least four without and four with contact."""
    sides = []
    for points in (apart, contact):
        edge, gap = np.array([point.edge for point in points]), np.array([point.gap[0] for point in points])
        along = -np.log(gap - 1.0) if points is apart else np.log(edge[0] + edge)
        values = np.array([(point.depth, point.force, point.edge, point.energy, point.gap[0]) for point in points])
        sides.append(_refined(along, values))
    return Curve(*np.ascontiguousarray(np.vstack(sides).T))


def _beyond(depth: np.ndarray, here: float, target: float, upwards: bool) -> tuple[list[int], int]:
    """Samples passed from the position `here` on the way to an indentation, and the fold reached first, or -1."""
    sign, last, passed = (1 if upwards else -1), _at(depth, here), list[int]()
    j = math.floor(here) + 1 if upwards else math.ceil(here) - 1
    while 0 <= j < depth.size and sign * depth[j] < sign * target:
        if sign * (depth[j] - last) < -_ROUNDING * (1.0 + abs(last)):
            return passed, j - sign
        last = depth[j]
        passed.append(j)
        j += sign
    return passed, -1


def _at(values: np.ndarray, position: float) -> float:
    k = min(int(position), values.size - 2)
    return float(values[k] + (position - k) * (values[k + 1] - values[k]))


def _crossing(depth: np.ndarray, start: int, target: float, upwards: bool) -> float:
    """Position at which the indentation is first at `target` or beyond, along the curve from the sample `start`."""
    sign = 1 if upwards else -1
    rest = depth[start:] if upwards else depth[: start + 1][::-1]
    k = int(np.argmax(sign * (rest[1:] - target) >= 0.0))
    part = (target - rest[k]) / (rest[k + 1] - rest[k]) if rest[k + 1] != rest[k] else 1.0
    return start + sign * (k + part)


class _Walk:
    """The contact on its way along the curve, and what is recorded of it."""

    def __init__(
        self, lattice: Lattice, apart: list[Equilibrium], contact: list[Equilibrium], work: np.ndarray
    ) -> None:
        self.lattice, self.apart, self.contact, self.work = lattice, apart, contact, work
        self.curve = sampled(apart, contact)
        self.position = 0.0
        self.records: list[tuple[float, ...]] = []
        self.jumps: list[tuple[float, ...]] = []

    def to(self, target: float, begin: float, end: float, now: float) -> None:
        """Follow the indentation from `now`, at the time `begin`, to `target` at `end`."""
        depth, upwards = self.curve.depth, target > now
        rate = (end - begin) / (target - now) if target != now else 0.0
        fold = 0
        while fold >= 0 and target != now:
            passed, fold = _beyond(depth, self.position, target, upwards)
            for j in passed:
                if j % _RECORDED == 0 or j == fold:
                    self._record(begin + rate * (depth[j] - now), depth[j], j)
            if fold >= 0:
                self._jump(begin + rate * (depth[fold] - now), fold, _crossing(depth, fold, depth[fold], upwards))
        if target != now:
            start = math.floor(self.position) if upwards else math.ceil(self.position)
            self.position = _crossing(depth, start, target, upwards)
        self._record(end, target, self.position)

    def _record(self, time: float, depth: float, position: float) -> None:
        self.records.append((time, depth, _at(self.curve.force, position), _at(self.curve.edge, position)))

    def _jump(self, time: float, fold: int, landing: float) -> None:
        depth, force, energy = self.curve.depth[fold], self.curve.force, self.curve.energy
        self._record(time, depth, landing)
        eigenvalues = (self._eigenvalue(fold), self._eigenvalue(landing))
        lost = energy[fold] - _at(energy, landing)
        self.jumps.append((time, depth, force[fold], _at(force, landing), *eigenvalues, lost, depth))
        self.work[FOLD_SOLVES] += 1
        self.position = landing

    def _eigenvalue(self, position: float) -> float:
        """Smallest eigenvalue of the Jacobian at fixed indentation, of the state there."""
        first = (len(self.apart) - 1) * _BETWEEN + 1  # sample of the contact
        if position < first:
            near = self.apart[round(position / _BETWEEN)]
            point = solve_open(self.lattice, _at(self.curve.axis_gap, position), near, self.work)
        else:
            near = self.contact[round((position - first) / _BETWEEN)]
            point = solve_closed(self.lattice, _at(self.curve.edge, position), near, self.work)
        point = near if point is None else point
        return float(
            smallest_eigenvalue(point.mesh.influence, self.lattice.problem.tabor, LENNARD_JONES, 1.0, point.gap)
        )


def prefers_curve(scene: Scene, deepest: float) -> bool:
    """Whether the curve serves a scene at less cost than time steps; it needs a grid that moves.

    Args:
        scene: Of any kind.
        deepest: Largest indentation; surfaces that never touch are followed by a few time steps.
    """
    elastic = scene.material.strengths.size == 0 and isinstance(scene.adhesion, LennardJones) and scene.spring is None
    return elastic and scene.tabor >= _USUAL_TABOR and deepest > 1.0 - _SNAP_IN * scene.tabor ** (3.0 / 7.0)


def has_curve(problem: Problem) -> bool:
    """Whether a Lennard-Jones contact is elastic and moved directly, of a large Tabor parameter on a moving grid."""
    elastic = problem.strengths.size == 0 and not problem.nonadhesive and problem.machine.compliance == 0.0
    return elastic and not problem.law.tabulated and problem.tabor >= _SMALLEST_TABOR and problem.series.size > 0


def march_elastic(problem: Problem, times: np.ndarray, depths: np.ndarray) -> Marched:
    """Follow the indentation history (`times`, `depths`), linear between its s instants, as `march` does."""
    work, lattice = new_work(), lattice_of(problem)
    apart, contact = trace(lattice, float(depths.min()), float(depths.max()), work)
    segment_steps, energies = np.zeros(times.size - 1, dtype=np.int64), np.zeros(2)
    if len(apart) < 4 or len(contact) < 4 or contact[-1].depth < depths.max():
        return Marched(np.empty((0, 4)), np.empty((0, 8)), work, segment_steps, energies, NO_EQUILIBRIUM)
    walk = _Walk(lattice, apart, contact, work)
    walk.to(depths[0], times[0], times[0], walk.curve.depth[0])  # the relaxed start: the surfaces have come together
    walk.records, walk.jumps = walk.records[-1:], []
    energies[0] = _at(walk.curve.energy, walk.position)
    for k in range(segment_steps.size):
        steps = len(walk.records)
        walk.to(depths[k + 1], times[k], times[k + 1], depths[k])
        segment_steps[k] = len(walk.records) - steps
    energies[1] = _at(walk.curve.energy, walk.position)
    work[STEPS] = len(walk.records)
    work[NODES] = round(len(walk.records) * np.mean([point.gap.size for point in [*apart, *contact]]))
    return Marched(
        np.array(walk.records), np.array(walk.jumps).reshape(-1, 8), work, segment_steps, energies, COMPLETED
    )
