"""Contact without adhesion: a formula for an elastic half-space, a row of elements for a viscoelastic one.

The formula is Hertz's, or that of Galin and Sneddon where the indenter is no paraboloid.
No mesh is needed. A prescribed indentation, a spring and a prescribed force are one equation in the contact radius, or
in the indentation. The boundary element solver answers the same scene on a mesh of one's own.
"""

import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem.methods.boundary_elements.discrete_problem import Path, deepest_indentation
from bem.methods.closed_forms.hertz import contact_radius_from_indentation, load_factor
from bem.methods.outcomes import COMPLETED, DETACHED, OUT_OF_WORK, PAUSED, Outcome
from bem.methods.records import (
    JUMP,
    MULTIPLY_ADDS,
    NODES,
    PROFILE,
    RECORD,
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
from bem.methods.without_adhesion.elements import (
    Places,
    Push,
    Row,
    Solid,
    advance,
    force_of_row,
    places_of,
    relaxed,
    solid_of,
)
from bem.problem.accuracy import Accuracy
from bem.problem.indenter import PARABOLOID, depth_factor
from bem.problem.protocol import ForceProtocol
from bem.problem.scene import Scene

_RECORDS = 4.0  # along the largest contact radius, at a target of 1
_ELEMENTS = 4.0  # along it, at a target of 1
_MOST_SOLUTIONS = 20  # for one step
_BALANCED = 0.01  # error of the force in a step, over what its prediction may err
_SETTLED = 0.1  # the same of the indentation
_REJECTED = 1.5  # error of a prediction, over the allowed one, from which the step is tried again
_ROUNDING = 1e-14  # a shorter step, over its segment, does not change the time
_PARABOLA = 3  # records that the next is predicted from
_FIRST_REACH = 0.5  # of the row of elements, below which it is made anew for the contact that was found


class Device(NamedTuple):
    """What the protocol prescribes: y = inward delta - compliance P."""

    inward: float  # 0 where it is the force, with its sign changed, else 1
    compliance: float


class Shape(NamedTuple):
    """An elastic contact without adhesion."""

    exponent: float  # n of the indenter
    depth: float  # indentation over a^n
    load: float  # compression over a^(n+1)


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


def follow_hard_contact(
    scene: Scene, path: Path, accuracy: Accuracy, glassy: bool, most_work: float
) -> tuple[MarchResult, str]:
    """Follow a history without adhesion.

    Args:
        scene: with `HardContact`.
        path: history of indentation or force.
        accuracy: the target.
        glassy: whether the surfaces met just before the start.
        most_work: budget in multiply-adds.

    Returns:
        What `bem.methods.boundary_elements.time_stepping.march` returns, and the name of the method that answered.
    """
    by_force = isinstance(path, ForceProtocol)
    times, controls = np.array(path.times), np.array(-path.forces if by_force else path.indentations)
    compliance = 1.0 if by_force else 0.0 if scene.spring is None else 1.0 / scene.spring
    device = Device(0.0 if by_force else 1.0, compliance)
    parted = by_force and bool(controls.min() < 0.0)
    if parted:  # the contact ends where its force does
        first = int(np.argmax(controls < 0.0))
        share = controls[first - 1] / (controls[first - 1] - controls[first]) if first else 0.0
        end = times[first - 1] + share * (times[first] - times[first - 1]) if first else times[0]
        more = int(first > 0 and end > times[first - 1])
        times, controls = np.append(times[:first], [end] * more), np.append(controls[:first], [0.0] * more)
    method = "Hertz"
    if times.size < 2:
        touch = np.zeros(times.size, RECORD)
        touch["time"] = times
        result = MarchResult(touch, np.empty(0, JUMP), new_work(), np.zeros(0, np.int64), np.zeros(2), COMPLETED)
    elif scene.material.strengths.size == 0:
        result = follow_hertz(_shape_of(scene), device, times, controls, _RECORDS / accuracy.target**0.33)
    else:
        method, solid = "elements", solid_of(scene.material)
        deepest, n = deepest_indentation(scene, path), scene.exponent
        shape = _shape_of(scene, solid.glassy if glassy else 1.0)
        radius = uncompiled(_radius_under)(shape, device, float(controls[0]))
        depth = shape.depth * radius**n if radius > 0.0 or not device.inward else float(controls[0])
        # Forces are exact where the indentation is known, and only the curve between them must be resolved.
        allowed = 0.5 * accuracy.target**0.9 if device.inward else 0.6 * accuracy.target**1.08
        count, followed = math.ceil(_ELEMENTS / math.sqrt(accuracy.target)), False
        while not followed:  # by a row that reaches as far as the contact does
            reach = float(contact_radius_from_indentation(max(deepest, 1e-12), scene.tabor, n))
            rules = Rules(allowed, load_factor(n) * reach ** (n + 1.0), deepest, 0.2)
            places = places_of(scene.tabor, reach, count, n)
            result = follow_elements(rules, solid, device, places, times, controls, depth, glassy, most_work)
            reached = float(result.records["contact_radius"].max())
            followed = device.compliance == 0.0 or reached > _FIRST_REACH * reach or reached == 0.0
            followed = followed or result.outcome != COMPLETED
            deepest *= (1.2 * reached / reach) ** n
    if parted and result.outcome == COMPLETED:
        result = result._replace(outcome=DETACHED)
    steps = np.zeros(path.times.size - 1, dtype=np.int64)
    steps[: result.segment_steps.size] = result.segment_steps
    return result._replace(segment_steps=steps), method


def _shape_of(scene: Scene, stiffness: float = 1.0) -> Shape:
    factor = uncompiled(depth_factor)(scene.exponent)
    return Shape(scene.exponent, scene.tabor * factor, stiffness * load_factor(scene.exponent))


@kernel
def _radius_under(shape: Shape, device: Device, control: float) -> float:
    """Contact radius under a control, see `Device`; 0 where it is open."""
    pressed, n = max(control, 0.0), shape.exponent
    rigid, steep = (pressed / shape.depth) ** (1.0 / n), device.compliance * shape.load
    if steep == 0.0:
        return rigid
    radius = (pressed / steep) ** (1.0 / (n + 1.0))
    if device.inward > 0.0:
        radius = min(radius, rigid)
        for _ in range(30):  # Newton's method: convex, from above
            excess = shape.depth * radius**n + steep * radius ** (n + 1.0) - pressed
            slope = n * shape.depth * radius ** (n - 1.0) + (n + 1.0) * steep * radius**n
            change = excess / max(slope, 1e-300)
            radius -= change
            if abs(change) <= 1e-15 * radius:
                break
    return radius


@kernel
def _power(shape: Shape, radius: float) -> float:
    return radius * radius if shape.exponent == PARABOLOID else radius**shape.exponent


@kernel
def _record(row: np.ndarray, shape: Shape, device: Device, time: float, control: float, radius: float) -> None:
    """Fill a row of `RECORD` with the elastic contact of a radius."""
    power = _power(shape, radius)
    force = 0.0 - shape.load * power * radius  # no negative zero
    depth = control + device.compliance * force if device.inward > 0.0 else shape.depth * power
    row["time"], row["indentation"], row["force"], row["contact_radius"] = time, depth, force, radius


@kernel
def follow_hertz(shape: Shape, device: Device, times: np.ndarray, controls: np.ndarray, density: float) -> MarchResult:
    """Follow a history, as `follow_elements`, of an elastic contact by Hertz's formula.

    `density` is the number of records along the largest radius, enough for the monotone cubics between them.
    """
    steps, energies, largest, filled = np.zeros(times.size - 1, np.int64), np.zeros(2), 1e-300, 1
    states = np.empty(1 + 2 * steps.size * np.int64(np.ceil(density)), RECORD)
    for control in controls:
        largest = max(largest, _radius_under(shape, device, control))
    n, last = shape.exponent, _radius_under(shape, device, controls[0])
    stored = shape.depth * shape.load * n / (2.0 * n + 1.0)
    energies[0] = stored * last ** (2.0 * n + 1.0)
    _record(states[0], shape, device, times[0], controls[0], last)
    for s in range(steps.size):
        begin, first = times[s], controls[s]
        meets = controls[s] * controls[s + 1] < 0.0  # or parts: both pieces of the segment are followed
        for piece in range(2 if meets else 1):
            end, control = times[s + 1], controls[s + 1]
            if meets and piece == 0:
                end, control = begin + first / (first - control) * (end - begin), 0.0
            radius_before, last = last, _radius_under(shape, device, control)
            count = max(np.int64(np.ceil(density * abs(last - radius_before) / largest)), 1)
            for k in range(1, count):
                radius = radius_before + (last - radius_before) * (k / count)
                power = _power(shape, radius)
                reached = device.inward * shape.depth * power + device.compliance * shape.load * power * radius
                share = (reached - first) / (control - first)
                instant, value = begin + (end - begin) * share, first + (control - first) * share
                _record(states[filled + k - 1], shape, device, instant, value, radius)
            filled, steps[s] = filled + count, steps[s] + count
            _record(states[filled - 1], shape, device, end, control, last)
            begin, first = end, control
    energies[1] = stored * last ** (2.0 * n + 1.0)
    work = new_work()
    work[STEPS], work[MULTIPLY_ADDS] = filled - 1, 30 * filled
    return MarchResult(states[:filled], np.empty(0, JUMP), work, steps, energies, COMPLETED, np.empty(0, PROFILE))


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
        force, radius = force_of_row(places, new)
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
    energies, no_jumps, no_profiles = np.zeros(2), np.empty(0, JUMP), np.empty(0, PROFILE)
    return MarchResult(states, no_jumps, work, segment_steps, energies, course.outcome, no_profiles)


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
    row, depth, force_scale, records, outcome = course.row, course.depth, course.force_scale, course.records, COMPLETED
    n, segment = places.heights.size, course.segment
    new = Row(np.empty(n, np.bool_), np.empty((n, solid.times.size)), np.empty(n))
    force, radius = force_of_row(places, row)
    if records.filled[0] == 0:
        records = with_record(records, times[0], depth, force, radius)
    past, depths, forces = np.zeros(_PARABOLA), np.zeros(_PARABOLA), np.zeros(_PARABOLA)
    fastest = np.min(solid.relaxations)
    while segment < segment_steps.size and outcome == COMPLETED:
        k = segment
        duration = times[k + 1] - times[k]
        step, now, count = min(0.01 * duration, 0.05 * fastest), 0.0, 1
        past[0], depths[0], forces[0] = 0.0, depth, force
        while now < duration and outcome == COMPLETED:
            if is_spent(work):
                outcome = OUT_OF_WORK
                break
            at_end = now + 1.0001 * step >= duration
            if at_end:
                step = duration - now
            elif now + 2.0 * step > duration:
                step = 0.5 * (duration - now)
            after = duration if at_end else now + step
            control = controls[k + 1] if at_end else controls[k] + (controls[k + 1] - controls[k]) * (after / duration)
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
                force = forces[0]
                continue
            row, new, depth, now = new, row, indentation, after
            force_scale = max(force_scale, -force)
            for i in range(_PARABOLA - 1, 0, -1):
                past[i], depths[i], forces[i] = past[i - 1], depths[i - 1], forces[i - 1]
            past[0], depths[0], forces[0] = now, depth, force
            count = min(count + 1, _PARABOLA)
            records = with_record(records, times[k + 1] if at_end else times[k] + now, depth, force, radius)
            work[STEPS] += 1
            work[NODES] += n
            segment_steps[k] += 1
            step = min(step * min(max(change, 0.3), 3.0), rules.longest_step * duration)
            step = max(step, _ROUNDING * duration)
        segment += 1
        if outcome == COMPLETED and segment < segment_steps.size and is_to_pause(work):
            outcome = PAUSED
    return Course(row, depth, force_scale, records, segment, outcome)
