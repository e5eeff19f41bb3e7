"""A history of a viscoelastic contact without adhesion, by a row of elements.

A prescribed indentation, a spring and a prescribed force are one equation in the indentation.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem.methods.outcomes import COMPLETED, OUT_OF_WORK, PAUSED, Outcome
from bem.methods.records import (
    JUMP,
    MULTIPLY_ADDS,
    NODES,
    REJECTIONS,
    STEPS,
    MarchResult,
    Records,
    is_spent,
    is_to_pause,
    new_records,
    new_work,
    next_slice,
    with_record,
)
from bem.methods.without_adhesion.elastic_history import Device
from bem.methods.without_adhesion.elements import Places, Push, Row, Solid, advance, force_of_row, relaxed

_MOST_SOLUTIONS = 20  # for one step
_BALANCED = 0.01  # error of the force in a step, over what its prediction may err
_SETTLED = 0.1  # the same of the indentation
_REJECTED = 1.5  # error of a prediction, over the allowed one, from which the step is tried again
_ROUNDING = 1e-14  # a shorter step, over its segment, does not change the time
_PARABOLA = 3  # records that the next is predicted from


class Course(NamedTuple):
    """How far a viscoelastic contact has been followed."""

    row: Row
    depth: float
    force_scale: float  # largest so far
    records: Records
    segment: int  # the next
    outcome: Outcome  # PAUSED where it goes on


class Rules(NamedTuple):
    """How finely a history is followed."""

    allowed: float  # error of the prediction in a step, over the scale
    force_scale: float
    depth_scale: float
    longest_step: float  # over its segment


@kernel
def _predicted(times: np.ndarray, values: np.ndarray, count: int, time: float) -> float:
    """The polynomial through the first `count` values, at a time."""
    total = 0.0
    for k in range(count):
        weight = values[k]
        for i in range(count):
            if i != k:
                weight *= (time - times[i]) / (times[k] - times[i])
        total += weight
    return total


@kernel
def _solve(
    rules: Rules,
    solid: Solid,
    device: Device,
    places: Places,
    row: Row,
    depth: float,
    guess: float,
    slope_before: float,
    step_before: float,
    control: float,
    step: float,
    can_shrink: bool,
    new: Row,
    work: np.ndarray,
) -> tuple[float, float, float]:
    """Advance the row until the end of a step, where the protocol prescribes `control`.

    The indentation is a parabola through its last two values and the new one. Newton's method with bisection: what is
    prescribed rises with the indentation. A step that will be rejected is not solved to its end.

    Returns:
        Indentation, force and contact radius at the end; the row goes into `new`.
    """
    # How the load of an element answers to the indentation at the end of the step.
    bend = 1.0 / (step * (step + step_before)) if step_before > 0.0 else 0.0
    stiffness, unit_push = 1.0, Push(1.0 / step - bend * step, bend, step)
    for j in range(solid.times.size):
        stiffness += solid.moduli[j] * relaxed(unit_push, solid.relaxations[j], 0.0, 0.0, step)
    low, high, indentation = -np.inf, np.inf, control if device.compliance == 0.0 else guess
    reach = _REJECTED * rules.allowed * rules.depth_scale
    force, radius = 0.0, 0.0
    for _ in range(_MOST_SOLUTIONS):
        work[MULTIPLY_ADDS] += places.heights.size * (2 * solid.times.size + 4) + 500
        rate = (indentation - depth) / step
        curve = bend * step * (rate - slope_before)
        advance(solid, row, places.heights, depth, Push(rate - curve * step, curve, step), new)
        force, radius = force_of_row(places, new, solid.glassy)
        if device.compliance == 0.0:
            break
        excess = device.inward * indentation - device.compliance * force - control
        slope = device.inward + device.compliance * 2.0 / (np.pi * places.tabor) * stiffness * max(
            radius, 0.05 * places.spacing
        )
        if radius == 0.0 and slope > 2.0 * device.inward > 0.0:  # a sphere that flies, whatever it will touch
            slope = device.inward
        if excess < 0.0:
            low = indentation
        else:
            high = indentation
        change = -excess / slope
        settled = abs(change) <= _SETTLED * rules.allowed * rules.depth_scale  # a small contact sinks under no force
        if settled and abs(excess) <= _BALANCED * rules.allowed * device.compliance * max(rules.force_scale, -force):
            break
        before, indentation = indentation, indentation + change
        if indentation != before and not low < indentation < high:
            indentation = 0.5 * (low + high)
        if indentation == before or (can_shrink and (low > guess + reach or high < guess - reach)):
            break
    return indentation, force, radius


@kernel
def _along_segment(
    rules: Rules,
    solid: Solid,
    device: Device,
    places: Places,
    times: np.ndarray,
    controls: np.ndarray,
    course: Course,
    work: np.ndarray,
) -> Course:
    """Follow a history on, whose next segment lies between these `times` (2,) and `controls` (2,), to its end."""
    row, depth, force_scale, records = course.row, course.depth, course.force_scale, course.records
    n, duration, outcome = places.heights.size, times[1] - times[0], COMPLETED
    new = Row(np.empty(n, np.bool_), np.empty((n, solid.times.size)), np.empty(n))
    past, depths, forces = np.zeros(_PARABOLA), np.zeros(_PARABOLA), np.zeros(_PARABOLA)
    depths[0], forces[0] = depth, force_of_row(places, row, solid.glassy)[0]
    step, now, count = min(0.01 * duration, 0.05 * np.min(solid.relaxations)), 0.0, 1
    while now < duration:
        if is_spent(work):
            outcome = OUT_OF_WORK
            break
        at_end = now + 1.0001 * step >= duration
        if at_end:
            step = duration - now
        elif now + 2.0 * step > duration:
            step = 0.5 * (duration - now)
        after = duration if at_end else now + step
        control = controls[1] if at_end else controls[0] + (controls[1] - controls[0]) * (after / duration)
        expected = _predicted(past, depths, count, after)
        slope, before = 0.0, 0.0
        if count > 1 and device.compliance > 0.0:
            before = past[0] - past[1]
            slope = (depths[0] - depths[1]) / before
        can_shrink = step > 1e-9 * duration
        indentation, force, radius = _solve(
            rules, solid, device, places, row, depth, expected, slope, before, control, step, can_shrink, new, work
        )
        error = abs(force - _predicted(past, forces, count, after)) / max(force_scale, -force)
        if device.compliance > 0.0:
            error = max(error * device.inward, abs(indentation - expected) / rules.depth_scale)
        change = 0.9 * (rules.allowed / max(error, 1e-12)) ** (1.0 / count)
        if error > _REJECTED * rules.allowed and can_shrink:
            work[REJECTIONS] += 1
            step *= min(max(change, 0.2), 0.7)
            continue
        row, new, depth, now = new, row, indentation, after
        force_scale = max(force_scale, -force)
        for i in range(_PARABOLA - 1, 0, -1):
            past[i], depths[i], forces[i] = past[i - 1], depths[i - 1], forces[i - 1]
        past[0], depths[0], forces[0] = now, depth, force
        count = min(count + 1, _PARABOLA)
        records = with_record(records, times[1] if at_end else times[0] + now, depth, force, radius)
        work[STEPS] += 1
        work[NODES] += n
        step = min(step * min(max(change, 0.3), 3.0), rules.longest_step * duration)
        step = max(step, _ROUNDING * duration)
    return Course(row, depth, force_scale, records, course.segment + 1, outcome)


@kernel
def _follow(
    rules: Rules,
    solid: Solid,
    device: Device,
    places: Places,
    times: np.ndarray,
    controls: np.ndarray,
    course: Course,
    segment_steps: np.ndarray,
    work: np.ndarray,
) -> Course:
    """Follow a history on to the end of the segment in which a slice of work is done."""
    if course.records.filled[0] == 0:
        force, radius = force_of_row(places, course.row, solid.glassy)
        row, depth, force_scale, records, segment, outcome = course
        records = with_record(records, times[0], depth, force, radius)
        course = Course(row, depth, force_scale, records, segment, outcome)
    while True:
        k, steps = course.segment, work[STEPS]
        course = _along_segment(rules, solid, device, places, times[k : k + 2], controls[k : k + 2], course, work)
        segment_steps[k] = work[STEPS] - steps
        row, depth, force_scale, records, segment, outcome = course
        if outcome != COMPLETED or segment == segment_steps.size:
            return course
        if is_to_pause(work):
            return Course(row, depth, force_scale, records, segment, PAUSED)


def follow_elements(
    rules: Rules,
    solid: Solid,
    device: Device,
    places: Places,
    times: np.ndarray,
    controls: np.ndarray,
    depth: float,
    glassy: bool,
    most_work: float,
) -> MarchResult:
    """Follow the history (`times`, `controls`), linear between its s instants, from the indentation `depth`.

    Args:
        rules, solid, device: the scene.
        places: of the n elements.
        times, controls: (s,) what the protocol prescribes, see `Device`.
        depth: indentation at the start.
        glassy: whether the surfaces met just before the start.
        most_work: budget in multiply-adds.
    """
    work, segment_steps = uncompiled(new_work)(most_work), np.zeros(times.size - 1, np.int64)
    row = Row(depth > places.heights, np.zeros((places.heights.size, solid.times.size)), depth - places.heights)
    if glassy:
        row.memory[row.touching] = row.load[row.touching, np.newaxis]
    row.load[~row.touching | glassy] *= solid.glassy
    course = Course(row, float(depth), float(rules.force_scale), uncompiled(new_records)(), 0, PAUSED)
    while course.outcome == PAUSED:
        course = _follow(rules, solid, device, places, times, controls, course, segment_steps, next_slice(work))
    states = course.records.states[: course.records.filled[0]]
    return MarchResult(states, np.empty(0, JUMP), work, segment_steps, np.zeros(2), course.outcome)
