"""Contact without adhesion: a formula for an elastic half-space, a row of elements for a viscoelastic one.

The formula is Hertz's, or that of Galin and Sneddon where the indenter is no paraboloid.
No mesh is needed. A prescribed indentation, a spring and a prescribed force are one equation in the contact radius, or
in the indentation. The boundary element solver answers the same scene on a mesh of one's own.
"""

import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import in_python, kernel, kernel_part
from bem.accuracy import Accuracy
from bem.discretisation.elements import Places, Push, Row, Solid, advance, force_of_row, places_of, relaxed, solid_of
from bem.indenter import PARABOLOID, depth_factor
from bem.protocol import ForceProtocol
from bem.reference_solutions.hertz import contact_radius_from_indentation, load_factor
from bem.scene import Scene
from bem.solver.problem import Path, deepest_indentation
from bem.solver.records import (
    COMPLETED,
    DETACHED,
    INTERRUPTED,
    JUMP,
    OUT_OF_WORK,
    PROFILE,
    RECORD,
    Marched,
    new_records,
    with_record,
)
from bem.solver.work import MULTIPLY_ADDS, NODES, REJECTIONS, STEPS, is_spent, new_work

_RECORDS = 4.0  # along the largest contact radius, at a target of 1
_ELEMENTS = 4.0  # along it, at a target of 1
_MOST_SOLUTIONS = 20  # for one step
_BALANCED = 0.01  # error of the force in a step, over what its prediction may err
_PARABOLA = 3  # records that the next is predicted from
_FIRST_REACH = 0.5  # of the row of elements, below which it is made anew for the contact that was found


class Device(NamedTuple):
    """What the protocol prescribes: y = inward delta - compliance P."""

    inward: float  # 0 where it is the force, with its sign changed, else 1
    compliance: float


class Rules(NamedTuple):
    """How finely a history is followed."""

    allowed: float  # error of the prediction in a step, over the scale
    force_scale: float
    depth_scale: float
    longest_step: float  # over its segment


def follow_hard_contact(
    scene: Scene, path: Path, accuracy: Accuracy, glassy: bool, most_work: float, stop: np.ndarray
) -> tuple[Marched, str]:
    """Follow a history without adhesion.

    Args:
        scene: with `HardContact`.
        path: history of indentation or force.
        accuracy: the target.
        glassy: whether the surfaces met just before the start.
        most_work: budget in multiply-adds.
        stop: (1,) uint8, as of `bem.solver.time_stepping.march`.

    Returns:
        What `bem.solver.time_stepping.march` returns, and the name of the rung that answered.
    """
    by_force = isinstance(path, ForceProtocol)
    times, controls = np.array(path.times), np.array(-path.forces if by_force else path.indentations)
    parted = by_force and bool(controls.min() < 0.0)
    if parted:  # the contact ends where its force does
        first = int(np.argmax(controls < 0.0))
        if first == 0:
            return _marched(np.empty(0, RECORD), np.zeros(1, np.int64), DETACHED), "Hertz"
        part = controls[first - 1] / (controls[first - 1] - controls[first])
        times = np.append(times[:first], times[first - 1] + part * (times[first] - times[first - 1]))
        controls = np.append(controls[:first], 0.0)
        if not times[-1] > times[-2]:
            times, controls = times[:-1], controls[:-1]
        if times.size == 1:
            touch = np.array([(times[0], 0.0, 0.0, 0.0)], RECORD)
            return _marched(touch, np.zeros(1, np.int64), DETACHED), "Hertz"
    compliance = 1.0 if by_force else 0.0 if scene.spring is None else 1.0 / scene.spring
    device = Device(0.0 if by_force else 1.0, compliance)
    if scene.material.strengths.size == 0:
        found, rung = _hertz(scene, device, times, controls, accuracy.target), "Hertz"
    else:
        start = (deepest_indentation(scene, path), times, controls)
        found = _elements(scene, device, *start, accuracy.target, glassy, most_work, stop)
        rung = "elements"
    if parted and found.outcome == COMPLETED:
        found = found._replace(outcome=DETACHED)
    steps = np.zeros(path.times.size - 1, dtype=np.int64)
    steps[: found.segment_steps.size] = found.segment_steps
    return found._replace(segment_steps=steps), rung


def _radius(scene: Scene, device: Device, controls: np.ndarray, stiffness: float = 1.0) -> np.ndarray:
    """Contact radii (s,) of an elastic contact under `controls` (s,), see `Device`; 0 where it is open."""
    pressed, n = np.maximum(controls, 0.0), scene.exponent
    rigid = contact_radius_from_indentation(pressed, scene.tabor, n)
    steep = device.compliance * stiffness * load_factor(n)
    if steep == 0.0:
        return rigid
    radius = np.cbrt(pressed / steep) if n == PARABOLOID else (pressed / steep) ** (1.0 / (n + 1.0))
    if device.inward:
        radius, depth = np.minimum(radius, rigid), scene.tabor * in_python(depth_factor)(n)
        for _ in range(8 if n == PARABOLOID else 30):  # convex, from above
            excess = depth * radius**n + steep * radius ** (n + 1.0) - pressed
            slope = n * depth * radius ** (n - 1.0) + (n + 1.0) * steep * radius**n
            radius -= excess / np.maximum(slope, 1e-300)
    return radius


def _hertz(scene: Scene, device: Device, times: np.ndarray, controls: np.ndarray, target: float) -> Marched:
    """Hertz's formula at radii dense enough for the monotone cubics between the records."""
    n, depth = scene.exponent, scene.tabor * in_python(depth_factor)(scene.exponent)
    instants, values = times, controls
    crossed = np.flatnonzero(controls[:-1] * controls[1:] < 0.0)
    if crossed.size:
        part = controls[crossed] / (controls[crossed] - controls[crossed + 1])
        instants = np.insert(times, crossed + 1, times[crossed] + part * (times[crossed + 1] - times[crossed]))
        values = np.insert(controls, crossed + 1, 0.0)
    corners = _radius(scene, device, values)
    changes = np.diff(corners)
    counts = np.ceil(_RECORDS / target**0.33 * np.abs(changes) / max(corners.max(), 1e-300)).astype(np.int64)
    counts = np.maximum(counts, 1)
    segment = np.repeat(np.arange(counts.size), counts)
    ends = np.cumsum(counts)
    part = (np.arange(1, ends[-1] + 1) - np.repeat(ends - counts, counts)) / counts[segment]
    radius = np.append(corners[0], corners[segment] + changes[segment] * part)
    force = 0.0 - load_factor(n) * radius ** (n + 1.0)  # no negative zero
    control = device.inward * depth * radius**n - device.compliance * force
    first, last = values[:-1][segment], values[1:][segment]
    along = changes[segment] != 0.0
    part[along] = (control[1:][along] - first[along]) / (last - first)[along]
    part[ends - 1] = 1.0
    records = np.empty(radius.size, RECORD)
    records["time"] = np.append(times[0], instants[:-1][segment] + np.diff(instants)[segment] * part)
    records["time"][ends] = instants[1:]
    control = np.append(values[0], first + (last - first) * part)
    records["indentation"] = control + device.compliance * force if device.inward else depth * radius**n
    records["force"], records["contact_radius"] = force, radius
    factor = 2.0 * in_python(depth_factor)(n) * n * n / ((n + 1.0) * (2.0 * n + 1.0) * math.pi)
    energies = factor * depth * radius[[0, -1]] ** (2.0 * n + 1.0)
    whole = np.searchsorted(instants, times)  # of each corner of the protocol
    return _marched(records, np.diff(np.append(0, ends)[whole]), COMPLETED)._replace(energies=energies)


def _marched(records: np.ndarray, segment_steps: np.ndarray, outcome: int) -> Marched:
    work = new_work()
    work[STEPS], work[MULTIPLY_ADDS] = segment_steps.sum(), 30 * len(records)
    return Marched(records, np.empty(0, JUMP), work, segment_steps, np.zeros(2), outcome)


def _elements(
    scene: Scene,
    device: Device,
    deepest: float,
    times: np.ndarray,
    controls: np.ndarray,
    target: float,
    glassy: bool,
    most_work: float,
    stop: np.ndarray,
) -> Marched:
    """The row of elements, which reaches as far as the contact does."""
    solid = solid_of(scene.material)
    stiffness = solid.glassy if glassy else 1.0
    n, softness = scene.exponent, scene.tabor * in_python(depth_factor)(scene.exponent)
    first = _radius(scene, device, controls[:1], stiffness)[0]
    depth = softness * first**n if first > 0.0 or not device.inward else controls[0]
    # Forces are exact where the indentation is known, and only the curve between them must be resolved.
    allowed = 0.5 * target**0.9 if device.inward else 0.6 * target**1.08
    count = math.ceil(_ELEMENTS / math.sqrt(target))
    while True:
        reach = float(contact_radius_from_indentation(max(deepest, 1e-12), scene.tabor, n))
        rules = Rules(allowed, load_factor(n) * reach ** (n + 1.0), deepest, 0.2)
        places = places_of(scene.tabor, reach, count, n)
        found = follow_elements(rules, solid, device, places, times, controls, depth, glassy, most_work, stop)
        reached = float(found.records["contact_radius"].max())
        if device.compliance == 0.0 or reached > _FIRST_REACH * reach or found.outcome != COMPLETED or reached == 0.0:
            return found
        deepest *= (1.2 * reached / reach) ** n


@kernel_part
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


@kernel_part
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
    new: Row,
    work: np.ndarray,
) -> tuple[float, float, float]:
    """Advance the row until the end of a step, where the protocol prescribes `control`.

    The indentation is a parabola through its last two values and the new one. Newton's method with bisection: what is
    prescribed rises with the indentation.

    Returns:
        Indentation, force and contact radius at the end; the row goes into `new`.
    """
    # How the load of an element answers to the indentation at the end of the step.
    bend = 1.0 / (step * (step + step_before)) if step_before > 0.0 else 0.0
    stiffness, one = 1.0, Push(1.0 / step - bend * step, bend, step)
    for j in range(solid.times.size):
        stiffness += solid.moduli[j] * relaxed(one, solid.relaxations[j], 0.0, 0.0, step)
    low, high, found = -np.inf, np.inf, control if device.compliance == 0.0 else guess
    force, radius = 0.0, 0.0
    for _ in range(_MOST_SOLUTIONS):
        work[MULTIPLY_ADDS] += places.heights.size * (2 * solid.times.size + 4) + 500
        rate = (found - depth) / step
        curve = bend * step * (rate - slope_before)
        advance(solid, row, places.heights, depth, Push(rate - curve * step, curve, step), new)
        force, radius = force_of_row(places, new)
        if device.compliance == 0.0:
            break
        excess = device.inward * found - device.compliance * force - control
        slope = device.inward + device.compliance * 2.0 / (np.pi * places.tabor) * stiffness * max(
            radius, 0.05 * places.spacing
        )
        if excess < 0.0:
            low = found
        else:
            high = found
        change = -excess / slope
        if abs(excess) <= _BALANCED * rules.allowed * device.compliance * max(rules.force_scale, -force):
            break
        before, found = found, found + change
        if not low < found < high:
            found = 0.5 * (low + high)
        if found == before:
            break
    return found, force, radius


@kernel
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
    stop: np.ndarray,
) -> Marched:
    """Follow the history (`times`, `controls`), linear between its s instants, from the indentation `depth`.

    Args:
        rules, solid, device: the scene.
        places: of the n elements.
        times, controls: (s,) what the protocol prescribes, see `Device`.
        depth: indentation at the start.
        glassy: whether the surfaces met just before the start.
        most_work: budget in multiply-adds.
        stop: (1,) uint8, as of `bem.solver.time_stepping.march`.
    """
    n, m = places.heights.size, solid.times.size
    work, records, segment_steps = new_work(most_work), new_records(), np.zeros(times.size - 1, dtype=np.int64)
    row = Row(depth > places.heights, np.zeros((n, m)), depth - places.heights)
    new = Row(np.empty(n, np.bool_), np.empty((n, m)), np.empty(n))
    for i in range(n):
        if glassy and row.touching[i]:
            row.memory[i, :] = row.load[i]
        if glassy or not row.touching[i]:
            row.load[i] *= solid.glassy
    force, radius = force_of_row(places, row)
    records = with_record(records, times[0], depth, force, radius)
    past, depths, forces = np.zeros(_PARABOLA), np.zeros(_PARABOLA), np.zeros(_PARABOLA)
    outcome, fastest = COMPLETED, np.min(solid.relaxations)
    force_scale = rules.force_scale
    for k in range(segment_steps.size):
        duration = times[k + 1] - times[k]
        step, now, count = min(0.01 * duration, 0.05 * fastest), 0.0, 1
        past[0], depths[0], forces[0] = 0.0, depth, force
        while now < duration and outcome == COMPLETED:
            if is_spent(work) or stop[0] != 0:
                outcome = OUT_OF_WORK if is_spent(work) else INTERRUPTED
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
            found, force, radius = _solve(
                rules, solid, device, places, row, depth, expected, slope, before, control, step, new, work
            )
            error = abs(force - _predicted(past, forces, count, after)) / max(force_scale, -force)
            if device.compliance > 0.0:
                error = max(error * device.inward, abs(found - expected) / rules.depth_scale)
            change = 0.9 * (rules.allowed / max(error, 1e-12)) ** (1.0 / count)
            if error > 1.5 * rules.allowed and step > 1e-9 * duration:
                work[REJECTIONS] += 1
                step *= min(max(change, 0.2), 0.7)
                force = forces[0]
                continue
            row, new, depth, now = new, row, found, after
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
    states = records.states[: records.filled[0]]
    return Marched(states, np.empty(0, JUMP), work, segment_steps, np.zeros(2), outcome, np.empty(0, PROFILE))
