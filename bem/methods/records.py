"""What is recorded along a protocol: states, jumps and profiles in tables that grow, work, and the top of each peak.

Work is counted by every kernel in one integer array. Multiply-adds measure the whole: they are estimated from the sizes
of the systems, as processor time is, but do not depend on the processor. Loops without another bound look at `is_spent`
and end where the budget does.

Steps follow the curvature of the history, so a polynomial through the highest step and its neighbours gives a peak
where the highest step alone is too low. It is the cubic through two steps before, because a contact detaches faster
than it was loaded, so the steps before the peak are those that resolve it. Where these are missing, a parabola is used.
The top is added to the records as one more entry.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.outcomes import Outcome
from bem.results.profiles import Profiles
from bem.results.trajectory import Jump

RECORD = np.dtype([(name, np.float64) for name in ("time", "indentation", "force", "contact_radius")])
JUMP = np.dtype([(field.name, np.float64) for field in dataclasses.fields(Jump)])
PROFILE = np.dtype([(name, np.float64) for name in ("number", "indentation", "force", "radius", "gap", "traction")])
"""One node of one profile; traction in mu dgamma / h0."""
COUNTS = (
    "iterations",
    "factorisations",
    "unknowns",
    "steps",
    "rejections",
    "nodes",
    "unstable",
    "multiply_adds",
    "most_work",
    "pause",
)
"""What is counted, in the order of the array. Unknowns are summed over iterations, nodes over steps.

At a count of `pause` multiply-adds a kernel returns to Python, which calls signal handlers then, and the kernel again.
"""
ITERATIONS, FACTORISATIONS, UNKNOWNS, STEPS, REJECTIONS, NODES, UNSTABLE, MULTIPLY_ADDS, MOST, PAUSE = range(10)
MOST_WORK, MOST_OF_A_DRAFT = 3e11, 3e10
"""Budgets of one simulation, in multiply-adds: about a minute, and a few seconds, of one core."""
SLICE = 200_000_000
"""Multiply-adds between two such pauses, some 50 ms."""
_UNEVEN = 10.0  # ratio of neighbouring steps from which no curve is drawn through them


class Records(NamedTuple):
    """The states along a protocol so far."""

    states: np.ndarray  # (rows,) of `RECORD`
    jumps: np.ndarray  # (rows,) of `JUMP`
    profiles: np.ndarray  # (rows,) of `PROFILE`
    filled: np.ndarray  # (4,) int64: rows of states, of jumps and of profiles in use, and the number of profiles


class MarchResult(NamedTuple):
    """A protocol that was followed, or the part of it that could be."""

    records: np.ndarray  # (n,) of `RECORD`
    jumps: np.ndarray  # (j,) of `JUMP`; the energy lost is NaN where there is memory
    work: np.ndarray  # one of each of `COUNTS`
    segment_steps: np.ndarray  # (s - 1,) int64: steps of each segment
    energies: np.ndarray  # (2,): stored at the beginning and at the end, of an elastic contact
    outcome: Outcome
    profiles: np.ndarray = np.empty(0, PROFILE)  # (p,), one profile after the other


@kernel
def new_records() -> Records:
    """Empty tables."""
    return Records(np.empty(256, RECORD), np.empty(16, JUMP), np.empty(1, PROFILE), np.zeros(4, dtype=np.int64))


@kernel
def with_room(table: np.ndarray, used: int) -> np.ndarray:
    """The table, or one of twice the length with the same rows where all are in use."""
    if used < table.size:
        return table
    longer = np.empty(2 * table.size, table.dtype)
    for row in range(table.size):
        longer[row] = table[row]
    return longer


@kernel
def with_record(records: Records, time: float, depth: float, force: float, edge: float) -> Records:
    """The records with one more state."""
    filled = records.filled
    states = with_room(records.states, filled[0])
    row = states[filled[0]]
    row["time"], row["indentation"], row["force"], row["contact_radius"] = time, depth, force, edge
    filled[0] += 1
    return Records(states, records.jumps, records.profiles, filled)


@kernel
def with_jump(
    records: Records,
    time: float,
    depth: float,
    forces: tuple[float, float],
    eigenvalues: tuple[float, float],
    energy_lost: float,
    depth_after: float,
) -> Records:
    """The records with one more jump; forces and eigenvalues are those before and after it."""
    filled = records.filled
    jumps = with_room(records.jumps, filled[1])
    row = jumps[filled[1]]
    row["time"], row["indentation"] = time, depth
    row["energy_lost"], row["indentation_after"] = energy_lost, depth_after
    row["force_before"], row["force_after"] = forces
    row["eigenvalue_before"], row["eigenvalue_after"] = eigenvalues
    filled[1] += 1
    return Records(records.states, jumps, records.profiles, filled)


@kernel
def new_work(most: float = np.inf) -> np.ndarray:
    """No work yet, and a budget in multiply-adds; int64, one entry for each of `COUNTS`."""
    work = np.zeros(len(COUNTS), dtype=np.int64)
    work[MOST] = np.int64(min(most, 9e18))
    return work


@kernel
def count_factorisation(work: np.ndarray, order: int) -> None:
    """Count a factorisation of that many unknowns, and what else an iteration with it costs."""
    work[FACTORISATIONS] += 1
    work[MULTIPLY_ADDS] += order * order * (order // 3 + 4)


@kernel
def count_iteration(work: np.ndarray, nodes: int, order: int) -> None:
    """Count an iteration over that many nodes, in a linear system of `order` unknowns."""
    work[ITERATIONS] += 1
    work[UNKNOWNS] += order
    work[MULTIPLY_ADDS] += nodes * (nodes + 500) + order * order


@kernel
def is_spent(work: np.ndarray) -> bool:
    """Whether the budget is used up."""
    return work[MULTIPLY_ADDS] >= work[MOST]


def next_slice(work: np.ndarray) -> np.ndarray:
    """The counts, for a slice of work more."""
    work[PAUSE] = work[MULTIPLY_ADDS] + SLICE
    return work


@kernel
def is_to_pause(work: np.ndarray) -> bool:
    """Whether this slice of work is done."""
    return work[MULTIPLY_ADDS] >= work[PAUSE]


def work_by_name(work: np.ndarray) -> dict[str, int]:
    """The counts as a dictionary with the names of `COUNTS`."""
    return {name: int(count) for name, count in zip(COUNTS, work, strict=True)}


def columns_of(records: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Time, indentation, force and contact radius of records (n,) of `RECORD`, each an array of its own."""
    time, depth, force, radius = (np.ascontiguousarray(records[name]) for name in RECORD.names or ())
    return time, depth, force, radius


def profiles_of(rows: np.ndarray, instants: np.ndarray, tabor: float, exponent: float) -> Profiles:
    """The profiles in rows of `PROFILE`, at the first of the `instants` (p,) that were reached."""
    profiles = np.split(rows, np.flatnonzero(np.diff(rows["number"])) + 1) if len(rows) else []
    table = np.full((3, len(profiles), max(map(len, profiles), default=0)), np.nan)
    for number, profile in enumerate(profiles):
        table[:, number, : len(profile)] = profile["radius"], profile["gap"], profile["traction"] / tabor
    depth, force = (np.array([profile[name][0] for profile in profiles]) for name in ("indentation", "force"))
    return Profiles(instants[: len(profiles)], depth, force, *table, tabor, exponent)


def with_peaks(records: np.ndarray, unloading: np.ndarray, highest: float = np.inf) -> tuple[np.ndarray, np.ndarray]:
    """Insert the top of every local maximum of the force.

    Args:
        records: (n,) of `RECORD`; a jump is two rows at one time.
        unloading: (n,) bool, carried along.
        highest: force beyond which no top can be.

    Returns:
        records (n + peaks,) and unloading (n + peaks,).
    """
    if len(records) < 3:
        return records, unloading
    table = records.view(np.float64).reshape(len(records), -1)  # its columns are the fields
    time, force = table[:, 0], table[:, 2]
    smooth = _smooth(time, table[:, 1])
    tops = np.flatnonzero(smooth & (force[1:-1] > force[:-2]) & (force[1:-1] > force[2:])) + 1
    positions, rows = [], []
    for i in tops.tolist():
        first = i - 2 if i >= 2 and smooth[i - 2] else i - 1
        top = _top((time[first : i + 2] - time[i]).tolist(), (force[first : i + 2] - force[i]).tolist())
        if top is None or force[i] + top[1] > highest:
            continue
        after, rise = top
        side = i - 1 if after < 0.0 else i + 1
        share = after / (time[side] - time[i])
        row = table[i] + share * (table[side] - table[i])
        if not time[min(i, side)] < row[0] < time[max(i, side)]:
            continue
        row[2] = force[i] + rise
        positions.append(max(i, side))
        rows.append(row)
    if not rows:
        return records, unloading
    # by hand, as `numpy.insert` takes longer than the search
    new = np.array(positions) + np.arange(len(positions))
    old = np.ones(len(records) + len(new), bool)
    old[new] = False
    extended, phase = np.empty((old.size, table.shape[1])), np.empty(old.size, bool)
    extended[old], extended[new] = table, rows
    phase[old], phase[new] = unloading, unloading[np.array(positions) - 1]
    return extended.view(RECORD)[:, 0], phase


def _smooth(time: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """(n - 2,) bool: whether a curve may be drawn through a state (n,) and both its neighbours."""
    steps = time[1:] - time[:-1]
    before, after = steps[:-1], steps[1:]
    even = (before > 0.0) & (after > 0.0) & (before < _UNEVEN * after) & (after < _UNEVEN * before)
    rate = (depth[1:] - depth[:-1]) / np.maximum(steps, 1e-300)
    # no corner of the protocol
    return even & (np.abs(np.diff(rate)) <= 1e-4 * np.maximum(np.abs(rate[1:]), np.abs(rate[:-1])))


def _top(time: list[float], force: list[float]) -> tuple[float, float] | None:
    """Time and force of a maximum between the neighbours of the last entry but one, both counted from there."""
    left, right = time[-3], time[-1]
    slope, curvature, third = _polynomial([*time[:-2], right], [*force[:-2], force[-1]])
    if third == 0.0:
        after = -slope / (2.0 * curvature)
    else:
        discriminant = curvature**2 - 3.0 * third * slope
        if discriminant < 0.0:
            return None
        # of the two, where the curve is highest; in the form that does not cancel
        after = -slope / (curvature - math.sqrt(discriminant))
    rise = after * (slope + after * (curvature + after * third))
    # What rises further above the highest step than its neighbours lie below is not resolved by the steps.
    if not left < after < right or not 0.0 < rise <= 2.0 * max(-force[-3], -force[-1]):
        return None
    return after, rise


def _polynomial(times: list[float], values: list[float]) -> tuple[float, float, float]:
    """Coefficients of t, t^2 and t^3 of the polynomial through two or three points and the origin, by its differences.

    Written here because a general solver takes longer for three unknowns than all else that follows a simulation.
    """
    quotients = [value / time for time, value in zip(times, values, strict=True)]
    first = (quotients[1] - quotients[0]) / (times[1] - times[0])
    if len(times) == 2:
        return quotients[0] - first * times[0], first, 0.0
    second = ((quotients[2] - quotients[1]) / (times[2] - times[1]) - first) / (times[2] - times[0])
    slope = quotients[0] - times[0] * (first - times[1] * second)
    return slope, first - second * (times[0] + times[1]), second
