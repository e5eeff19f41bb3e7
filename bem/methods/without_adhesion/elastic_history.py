"""A history of an elastic contact without adhesion, by the formula of Hertz, or of Galin and Sneddon.

A prescribed indentation, a spring and a prescribed force are one equation in the contact radius.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.outcomes import COMPLETED
from bem.methods.records import JUMP, MULTIPLY_ADDS, PROFILE, RECORD, STEPS, MarchResult, new_work
from bem.problem.indenter import PARABOLOID


class Device(NamedTuple):
    """What the protocol prescribes: y = inward delta - compliance P."""

    inward: float  # 0 where it is the force, with its sign changed, else 1
    compliance: float


class Shape(NamedTuple):
    """An elastic contact without adhesion."""

    exponent: float  # n of the indenter
    depth: float  # indentation over a^n
    load: float  # compression over a^(n+1)


@kernel
def radius_under(shape: Shape, device: Device, control: float) -> float:
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
        largest = max(largest, radius_under(shape, device, control))
    n, last = shape.exponent, radius_under(shape, device, controls[0])
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
            radius_before, last = last, radius_under(shape, device, control)
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
