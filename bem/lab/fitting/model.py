"""The force that a setup predicts along a measured history, which a few straight lines approximate.

The history is the path of the sphere; behind a spring, it is the path of the stage, and the sphere's follows.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.contact_point import noise_of
from bem.lab.curve import ForceCurve
from bem.lab.fitting.jumps import MeasuredJump, instants_of, lateness, shares_between
from bem.lab.setup import Setup
from bem.materials import Elastic, StandardLinearSolid
from bem.protocol import PiecewiseLinearProtocol, default_start_indentation
from bem.reference_solutions.dmt import rigid_force_from_indentation

_CLOSENESS = 1e-3  # of the range of indentation, by which the lines may miss a measured point
_FAR = 3.0  # in default start indentations: farther away nothing acts, and the approach is left out
_BESIDE = 2.0  # samples on either side of a jump that do not count
MOST_KNOTS = 400
_FEWEST = 4  # samples between two corners, from which a line through them is better than one through the corners

SETUP_PARAMETERS = ("relaxed_modulus", "work_of_adhesion", "retardation_time", "modulus_ratio")


def prescribed_path(curve: ForceCurve, setup: Setup) -> FloatArray:
    """What the instrument moved at each point of a curve, in m: the sphere, or the stage behind the setup's spring.

    A curve without a stage gives it as indentation plus compression over stiffness.
    """
    if setup.stiffness is None:
        return curve.indentation
    return curve.indentation - curve.tension / setup.stiffness if curve.stage is None else curve.stage


def straight_lines(time: FloatArray, path: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Instants from zero, in s, and positions, in m, of few points between which a measured path is straight.

    Lines are split at the point they miss most (Ramer, 1972; Douglas and Peucker, 1973) until none is missed by more
    than a thousandth of the range, or by three standard deviations of the noise. A corner falls between two samples: it
    is where the lines through the points on either side of it meet.
    """
    time, first = np.unique(time - time[0], return_index=True)
    depth = path[first]
    allowed = max(_CLOSENESS * float(np.ptp(depth)), 3.0 * noise_of(depth))
    kept, open_pieces = {0, time.size - 1}, [(0, time.size - 1)]
    while open_pieces and len(kept) < MOST_KNOTS:
        begin, end = open_pieces.pop()
        line = np.interp(time[begin : end + 1], time[[begin, end]], depth[[begin, end]])
        missed = np.abs(depth[begin : end + 1] - line)
        worst = int(np.argmax(missed))
        if missed[worst] > allowed:
            kept.add(begin + worst)
            open_pieces += [(begin, begin + worst), (begin + worst, end)]
    return _corners(time, depth, sorted(kept))


def _corners(time: FloatArray, depth: FloatArray, knots: list[int]) -> tuple[FloatArray, FloatArray]:
    """Corners near the samples `knots`: where the lines through the points on either side meet, if within a sample."""
    corners = {knot: (float(time[knot]), float(depth[knot])) for knot in knots}
    straight = [(a, b) for a, b in itertools.pairwise(knots) if b - a > _FEWEST]
    lines = [np.polynomial.Polynomial.fit(time[a + 1 : b], depth[a + 1 : b], 1).convert().coef for a, b in straight]
    for ((_, end), (begin, _)), (before, after) in zip(
        itertools.pairwise(straight), itertools.pairwise(lines), strict=True
    ):
        # One corner may have left two knots, the samples on either side of it.
        if begin - end > 1 or before.size < 2 or after.size < 2 or before[1] == after[1]:
            continue
        instant = (after[0] - before[0]) / (before[1] - after[1])
        if time[end - 1] <= instant <= time[begin + 1]:
            corners[end] = float(instant), float(before[0] + before[1] * instant)
            if begin > end:
                del corners[begin]
    instants, places = np.array(list(corners.values())).T
    return instants, places


@dataclass
class Model:
    """Predicted tension at the instants of a measured curve.

    Args:
        curve: the measurement.
        setup: what is known; parameters of `tension` replace its values.
        measured: the curve's jumps, with levels counted from the force without contact.
        least: smallest standard deviation of the instant of a jump, in s.
    """

    curve: ForceCurve
    setup: Setup
    measured: tuple[MeasuredJump, ...] = ()
    least: float = 0.0
    evaluations: int = 0
    jumps: tuple[float, ...] = ()
    """Instants of the curve at which the last prediction jumped, in s."""
    passages: FloatArray = field(init=False)
    """Instants at which it passed the levels of the measured jumps, in s, shape (measured,); NaN for none."""
    _lines: tuple[FloatArray, FloatArray] = field(init=False)
    _sample: float = field(init=False)

    def __post_init__(self) -> None:
        self.passages = np.full(len(self.measured), np.nan)
        self._sample = float(np.median(np.diff(np.unique(self.curve.time))))
        self._lines = straight_lines(self.curve.time, prescribed_path(self.curve, self.setup))

    def setup_of(self, values: Mapping[str, float]) -> Setup:
        """The setup with the values of its parameters."""
        changes = {name: values[name] for name in SETUP_PARAMETERS if name in values}
        return self.setup.replaced(**changes)

    def protocol(self, setup: Setup, contact_point: float = 0.0) -> tuple[PiecewiseLinearProtocol, float]:
        """The measured path in the units of a setup, and the instant, in s, at which it begins.

        The approach from far away is left out; there the force is that of rigid surfaces.
        """
        time, depth = self._lines
        depth = (depth - contact_point) / setup.indentation_scale
        near = _FAR * default_start_indentation(setup.tabor)
        inside = np.flatnonzero(depth > near)
        first = int(inside[0]) if inside.size else 0
        if first > 0:
            share = (near - depth[first - 1]) / (depth[first] - depth[first - 1])
            start = time[first - 1] + share * (time[first] - time[first - 1])
            if start < time[first]:
                time, depth = np.append(start, time[first:]), np.append(near, depth[first:])
            else:
                time, depth = time[first:], depth[first:]
        begin = float(time[0])
        return PiecewiseLinearProtocol((time - begin) / setup.time_scale, depth), begin

    def tension(self, values: Mapping[str, float], accuracy: str | float) -> FloatArray | None:
        """Predicted tension in N at the curve's instants, shape (n,); `None` where the solver did not complete.

        Args:
            values: setup parameters and `contact_point`, as far as they differ from the setup and from 0.
            accuracy: as for `bem.simulate`.
        """
        from bem.solver.simulation import simulate

        self.evaluations += 1
        setup = self.setup_of(values)
        protocol, begin = self.protocol(setup, values.get("contact_point", 0.0))
        trajectory = simulate(setup.scene(), protocol, accuracy)
        if not trajectory.completed:
            self.jumps, self.passages = (), np.full(len(self.measured), np.nan)
            return None
        origin = self.curve.time[0] + begin
        self.jumps = tuple(origin + setup.time_scale * jump.time for jump in trajectory.jumps)
        self.passages = instants_of(
            self.measured, origin + setup.time_scale * trajectory.time, setup.force_scale * trajectory.force
        )
        instants = (self.curve.time - origin) / setup.time_scale
        force = trajectory.at(np.clip(instants, 0.0, trajectory.time[-1]))
        # A jump is spread over one sample, so that predictions change steadily when it moves from one to the next.
        sample = self._sample / setup.time_scale
        for jump in trajectory.jumps:
            late = (instants - jump.time) / sample
            share = 0.5 - np.abs(late)
            other = np.where(late >= 0.0, jump.force_before, jump.force_after)
            force = np.where(share > 0.0, (1.0 - share) * force + share * other, force)
        # The approach that was left out: from that far the surfaces attract each other as rigid ones.
        apart = (prescribed_path(self.curve, setup) - values.get("contact_point", 0.0)) / setup.indentation_scale
        return setup.force_scale * np.where(
            instants >= 0.0, force, rigid_force_from_indentation(np.minimum(apart, 0.0))
        )

    def late(self) -> FloatArray:
        """How late the last prediction jumps, in standard deviations, shape (measured,)."""
        return lateness(self.measured, self.passages, self.least, float(np.ptp(self.curve.time)))

    def shares(self) -> FloatArray:
        """By what factor the residuals of the last prediction count, (n,): less between its jumps and the measured."""
        return shares_between(self.measured, self.passages, self.late(), self.curve.time, self._sample)

    def away_from_jumps(self, predictions: Sequence[tuple[float, ...]]) -> np.ndarray:
        """Which points of the curve, (n,) bool, no jump passes between predictions, by more than two samples.

        Args:
            predictions: instants of the jumps of each, in s; as many in each, or they count one by one.
        """
        alike = [jumps for jumps in predictions if len(jumps) == len(predictions[0])]
        spans = [(min(passed), max(passed)) for passed in zip(*alike, strict=True)]
        spans += [(jump, jump) for jumps in predictions if len(jumps) != len(predictions[0]) for jump in jumps]
        beside = _BESIDE * self._sample
        time = self.curve.time
        away = [(time < first - beside) | (time > last + beside) for first, last in spans]
        return np.logical_and.reduce([np.ones(len(self.curve), dtype=bool), *away])


def with_memory(setup: Setup, duration: float) -> Setup:
    """The setup with a standard linear solid in place of an elastic one; its retardation time is `duration` / 10."""
    if not isinstance(setup.material, Elastic):
        return setup
    return setup.replaced(
        material=StandardLinearSolid(modulus_ratio=0.3), retardation_time=setup.retardation_time or 0.1 * duration
    )
