"""The contact itself, adhesion and relaxation together, by `bem.simulate`, along a few straight lines.

An instability falls between two samples. A model jumps where it passes the level of the measured jump, and the forces
between the two instants say nothing. How late it jumps out of contact counts in their place; when it jumps into contact
depends on the range of adhesion, which may be an effective one, and does not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.models.model import ADHESION, MODULUS, MODULUS_RATIO, RETARDATION_TIME, Model, Path, Values, setup_of
from bem.lab.setup import Setup
from bem.methods.closed_forms.dmt import rigid_force_from_indentation
from bem.problem.protocol import PiecewiseLinearProtocol, default_start_indentation
from bem.results.trajectory import Trajectory

_FAR = 3.0  # in default start indentations: farther away nothing acts, and the approach is left out
_FURTHER = 0.1  # of the duration, by which the last line is continued
_NEAR = 0.05  # of the duration, from which on the forces between two jumps lead the search
_SCATTER = 0.02  # adhesion lengths of travel, by which the solver's own error moves a jump
_SLOWER = 3.0  # times as long as those of a sharp crack take the multiplications of boundary elements
_ONE = 5e9  # multiplications and additions that one simulation may take, however few are left
_SATURATES = 30.0  # standard deviations, beyond which lateness counts as its logarithm


@dataclass(frozen=True)
class Jump:
    """A change of a measured force between two samples that stands out of noise and neighbours."""

    time: float
    """Midway between the samples, in s."""
    level: float
    """Tension midway between theirs, over that of the baseline, in N."""
    out: bool
    """Whether out of contact, where the tension falls, or into it."""


class NoContactError(RuntimeError):
    """The solver does not complete a contact."""


def protocol_of(setup: Setup, path: Path, contact_point: float) -> tuple[PiecewiseLinearProtocol, float]:
    """The path in the units of a setup, and the instant, in s, at which it begins.

    The approach from far away is left out; there the force is that of rigid surfaces.
    """
    time, position = path.lines
    # A model that lets go after the end of the measurement is late too.
    further = 1.0 + _FURTHER * (time[-1] - time[0]) / (time[-1] - time[-2])
    time, position = (np.append(row[:-1], row[-2] + further * (row[-1] - row[-2])) for row in (time, position))
    depth = (position - contact_point) / setup.indentation_scale
    near = _FAR * default_start_indentation(setup.tabor)
    inside = np.flatnonzero(depth > near)
    first = int(inside[0]) if inside.size else 0
    if first > 0:
        start = float(np.interp(near, depth[first - 1 : first + 1], time[first - 1 : first + 1]))
        ahead = first + int(start >= time[first])
        time, depth = np.append(start, time[ahead:]), np.append(near, depth[ahead:])
    return PiecewiseLinearProtocol((time - time[0]) / setup.time_scale, depth), float(path.time[0] + time[0])


def tension(
    values: Values,
    path: Path,
    accuracy: str | float = "draft",
    jumps: Sequence[Jump] | None = None,
    budget: list[float] | None = None,
) -> FloatArray:
    """See `Model.tension`; after it, for a measured jump out of contact, how late the model's is.

    Args:
        values, path: as there.
        accuracy: as for `bem.simulate`.
        jumps: of the measured force, for a search; `None`: the tension is that of the model everywhere.
        budget: (1,) multiplications and additions left, from which those of this call are taken; `None`: of this call.

    Returns:
        tension (n,), NaN beside a jump of the model and from there to a near measured one, and lateness in standard
        deviations, (1,) with a measured jump out of contact and (0,) without.

    Raises:
        NoContactError: the solver does not complete the contact, or the budget is spent.
    """
    from bem.methods.sharp_crack.edge_law import interpolated_tables
    from bem.simulation import simulate

    if budget is not None and budget[0] < 0.0:
        raise NoContactError("its search took too long")
    try:
        setup = setup_of(values, path.setup)
        protocol, begin = protocol_of(setup, path, values["contact_point"])
    except ValueError as error:  # a search wanders beyond what the solver takes
        raise NoContactError(str(error)) from error
    most = max(budget[0] if budget else 0.0, _ONE)
    with interpolated_tables():
        trajectory = simulate(setup.scene(), protocol, accuracy, most_work=most)
    if budget is not None:
        budget[0] -= trajectory.stats.multiply_adds * (1.0 if trajectory.stats.method == "sharp crack" else _SLOWER)
    if not trajectory.completed:
        raise NoContactError(str(trajectory.status))
    instants = (path.time - begin) / setup.time_scale
    spacing, late = float(np.median(np.diff(instants))), np.zeros(0)
    # Across a jump of its own the model has no derivative, and its instant is no finer than the samples.
    own = [] if jumps is None else [jump.time for jump in trajectory.jumps]
    gone = np.any(np.abs(np.subtract.outer(instants, own)) < spacing, axis=1)
    travel = float(np.sum(np.abs(np.diff(path.position)))) / float(np.ptp(path.time))
    unsure = np.hypot(spacing * setup.time_scale, _SCATTER * setup.adhesion_length / travel)
    for jump in jumps or ():
        measured = (jump.time - begin) / setup.time_scale
        late_by = _passage(trajectory, jump.level / setup.force_scale, jump.out, measured) - measured
        if abs(late_by) < _NEAR * trajectory.time[-1]:
            gone |= (instants - measured) * (instants - measured - late_by) < 0.0
        if jump.out:
            away = (late_by if np.isfinite(late_by) else trajectory.time[-1]) * setup.time_scale / unsure
            late = np.array([_SATURATES * np.arcsinh(away / _SATURATES)])
    force = trajectory.at(np.clip(instants, 0.0, trajectory.time[-1]))
    apart = (path.position - values["contact_point"]) / setup.indentation_scale
    far = rigid_force_from_indentation(np.minimum(apart, 0.0))
    forces = setup.force_scale * np.where(instants >= 0.0, force, far)
    forces[gone] = np.nan
    return np.append(forces, late)


def _passage(trajectory: Trajectory, level: float, falls: bool, measured: float) -> float:
    """Instant nearest to `measured` at which the tension passes a level downwards, or upwards; NaN for none."""
    above = trajectory.force > level
    passed = np.flatnonzero((above[1:] != above[:-1]) & (above[:-1] == falls))
    if passed.size == 0:
        return np.nan
    time, force = trajectory.time, trajectory.force
    share = (level - force[passed]) / (force[passed + 1] - force[passed])
    instants = time[passed] + share * (time[passed + 1] - time[passed])
    return float(instants[np.argmin(np.abs(instants - measured))])


MODEL = Model(
    "contact",
    "contact: viscoelastic sphere with adhesion",
    "bem.simulate; docs/theory.md",
    "a standard linear solid or a known series, a half-space, depth small beside the radius",
    (MODULUS, ADHESION, RETARDATION_TIME, replace(MODULUS_RATIO, low=0.015, high=0.96)),
    tension,
    0.02,
)
