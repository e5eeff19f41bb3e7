"""What is kept of the states along a protocol: tables of records and jumps that grow as they fill."""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, kernel_part
from bem._support.linear_algebra import copy_into
from bem.solver.state import State


class Course(NamedTuple):
    """The states along a protocol so far."""

    records: np.ndarray  # (rows, 4): time, indentation, force, contact radius
    jumps: np.ndarray  # (rows, 7): the fields of `bem.trajectory.Jump`
    filled: np.ndarray  # (2,) int64: rows of records and of jumps in use


@kernel_part
def new_course() -> Course:
    """Empty tables."""
    return Course(np.empty((256, 4)), np.empty((16, 7)), np.zeros(2, dtype=np.int64))


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
def with_jump(
    course: Course, time: float, before: State, after: State, eigenvalues: tuple[float, float], lost: float
) -> Course:
    """The course with one more jump, and a record of the state `before` it at the indentation of the one `after`."""
    course = with_record(course, time, after.depth, before.force, before.edge)
    filled = course.filled
    jumps = _with_room(course.jumps, filled[1])
    row = jumps[filled[1]]
    row[0], row[1], row[2], row[3] = time, after.depth, before.force, after.force
    row[4], row[5], row[6] = eigenvalues[0], eigenvalues[1], lost
    filled[1] += 1
    return Course(course.records, jumps, filled)
