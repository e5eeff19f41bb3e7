"""Tables of records and jumps along a protocol; they grow as needed."""

from typing import NamedTuple

import numpy as np

from bem._numerics.jit import kernel, kernel_part
from bem._numerics.linear_algebra import copy_into
from bem.solver.instabilities import smallest_eigenvalue
from bem.solver.problem import Problem
from bem.solver.stepping.state import State, energy_of, influence_of


class Course(NamedTuple):
    """The states along a protocol so far."""

    records: np.ndarray  # (rows, 4): time, indentation, force, contact radius
    jumps: np.ndarray  # (rows, 8): the fields of `bem.trajectory.Jump`
    filled: np.ndarray  # (2,) int64: rows of records and of jumps in use


@kernel_part
def new_course() -> Course:
    """Empty tables."""
    return Course(np.empty((256, 4)), np.empty((16, 8)), np.zeros(2, dtype=np.int64))


@kernel
def _with_room(table: np.ndarray, used: int) -> np.ndarray:
    """The table, or one of twice the length with the same rows where all are in use."""
    if used < table.shape[0]:
        return table
    longer = np.empty((2 * table.shape[0], table.shape[1]))
    for row in range(table.shape[0]):
        copy_into(longer[row], table[row])
    return longer


@kernel_part
def with_record(course: Course, time: float, depth: float, force: float, edge: float) -> Course:
    """The course with one more record."""
    filled = course.filled
    records = _with_room(course.records, filled[0])
    row = records[filled[0]]
    row[0], row[1], row[2], row[3] = time, depth, force, edge
    filled[0] += 1
    return Course(records, course.jumps, filled)


@kernel_part
def with_jump(problem: Problem, course: Course, time: float, before: State, after: State, response: float) -> Course:
    """The course with one more jump: the eigenvalues on both sides and the energy it loses.

    A record of the state `before` is added where it would be with stage or force of the state `after`.
    """
    tabor, machine, depth = problem.tabor, problem.machine, after.depth
    eigenvalue_before, eigenvalue_after, lost = 0.0, np.nan, np.nan
    scale = 1.0
    if machine.compliance > 0.0:
        depth = before.depth if machine.by_force else depth + machine.compliance * (before.force - after.force)
        # A soft spring multiplies the eigenvalue of the sphere's motion.
        scale += machine.compliance * problem.scales.force / machine.depth_scale
    if not problem.nonadhesive:
        influence = influence_of(problem, before.mesh, response, before.gap)
        eigenvalue_before = smallest_eigenvalue(influence, tabor, problem.law, response, before.gap) / scale
    if not np.isnan(after.depth):
        influence = influence_of(problem, after.mesh, response, after.gap)
        eigenvalue_after = smallest_eigenvalue(influence, tabor, problem.law, response, after.gap) / scale
    if problem.strengths.size == 0:
        work_done = -before.force * (after.depth - before.depth)
        lost = energy_of(problem, before) + work_done - energy_of(problem, after)
        if not machine.by_force:  # what of the spring's energy went into the contact counts as work
            lost -= 0.5 * machine.compliance * (after.force - before.force) ** 2
    course = with_record(course, time, depth, before.force, before.edge)
    filled = course.filled
    jumps = _with_room(course.jumps, filled[1])
    row = jumps[filled[1]]
    row[0], row[1], row[2], row[3] = time, depth, before.force, after.force
    row[4], row[5], row[6], row[7] = eigenvalue_before, eigenvalue_after, lost, after.depth
    filled[1] += 1
    return Course(course.records, jumps, filled)
