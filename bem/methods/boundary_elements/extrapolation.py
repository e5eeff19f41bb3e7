"""Prediction of the next solution by extrapolation, and its error, which sets the time step.

Pressed nodes are extrapolated in traction, the others in gap (see `bem.methods.boundary_elements.equilibrium`), by the
polynomial through the last solutions since the last corner or jump. The iteration starts from the cubic through four.
The step is judged by the parabola through three: its difference from the solution measures how curved the history is at
this step length.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import copy_into, dot
from bem.methods.boundary_elements.meshes.mesh import Mesh
from bem.methods.boundary_elements.state import State, transfer
from bem.problem.tractions import PEAK_TRACTION, Interface, force_of, traction_at
from bem.problem.tractions.pressed import pressed_below, pressed_gaps

DEPTH = 4  # solutions kept, all of which the iteration starts from
CONTROL = 3  # solutions whose polynomial is judged


class Scales(NamedTuple):
    """Scale and weights of differences between prediction and solution."""

    force: float  # below this the force counts as small, in pi R dgamma
    force_weight: float = 2.0  # of relative differences in force
    local_weight: float = 1.0  # of those in gaps and tractions


class Recent(NamedTuple):
    """The last solutions, newest first."""

    gap: np.ndarray  # (DEPTH, n)
    traction: np.ndarray  # (DEPTH, n)
    time: np.ndarray  # (DEPTH,)
    force: np.ndarray  # (DEPTH,)
    count: np.ndarray  # (1,) int64: how many are valid


@kernel
def start_recent(state: State, time: float) -> Recent:
    """Start with the present solution only."""
    size = state.gap.size
    profiles = np.zeros((DEPTH, size)), np.zeros((DEPTH, size))
    recent = Recent(profiles[0], profiles[1], np.zeros(DEPTH), np.zeros(DEPTH), np.zeros(1, dtype=np.int64))
    push_recent(recent, state, time)
    return recent


@kernel
def push_recent(recent: Recent, state: State, time: float) -> None:
    """Put a new solution in front of the others."""
    for k in range(DEPTH - 1, 0, -1):
        copy_into(recent.gap[k], recent.gap[k - 1])
        copy_into(recent.traction[k], recent.traction[k - 1])
        recent.time[k] = recent.time[k - 1]
        recent.force[k] = recent.force[k - 1]
    copy_into(recent.gap[0], state.gap)
    copy_into(recent.traction[0], state.traction)
    recent.time[0] = time
    recent.force[0] = state.force
    recent.count[0] = min(recent.count[0] + 1, DEPTH)


@kernel
def recent_on(interface: Interface, recent: Recent, old: Mesh, new: Mesh) -> Recent:
    """The solutions of one mesh on another."""
    size = new.radii.size
    moved = Recent(np.zeros((DEPTH, size)), np.zeros((DEPTH, size)), recent.time, recent.force, recent.count)
    for k in range(recent.count[0]):
        transfer(interface, old, recent.gap[k], recent.traction[k], new, moved.gap[k], moved.traction[k])
    return moved


@kernel
def _lagrange_weights(recent: Recent, time: float, most: int) -> np.ndarray:
    """Weights (DEPTH,) of the last solutions, `most` of them, in the polynomial through them, at `time`."""
    count = min(recent.count[0], most)
    weights = np.ones(DEPTH)
    for k in range(DEPTH):
        for m in range(count):
            if m != k and k < count:
                weights[k] *= (time - recent.time[m]) / (recent.time[k] - recent.time[m])
        if k >= count:
            weights[k] = 0.0
    return weights


@kernel
def expected_force(recent: Recent, time: float) -> float:
    """Extrapolate the force to `time`."""
    return dot(_lagrange_weights(recent, time, CONTROL), recent.force)


@kernel
def predict(
    interface: Interface,
    recent: Recent,
    time: float,
    gap: np.ndarray,
    tractions: np.ndarray,
    most: int = CONTROL,
    judged: bool = False,
) -> None:
    """Extrapolate to `time` into `gap` and `tractions` (n,), by the polynomial through the last `most` solutions.

    Where it is only `judged`, pressed nodes keep their last gap, which nobody looks at.
    """
    tabor, law, weights = interface.tabor, interface.law, _lagrange_weights(recent, time, most)
    n, inside, below = gap.size, 0, pressed_below(law)
    for j in range(n):
        gap[j], tractions[j] = 0.0, 0.0
        if recent.gap[0, j] < below:
            inside = j + 1
    for k in range(min(recent.count[0], most)):
        weight, openings, stresses = weights[k], recent.gap[k], recent.traction[k]
        for j in range(n):
            gap[j] += weight * openings[j]
            tractions[j] += weight * stresses[j]
    if interface.nonadhesive:
        for j in range(n):
            gap[j] = max(gap[j], 1.0)
            tractions[j] = min(tractions[j], 0.0)
        return
    pressed, scaled, last = np.empty(inside), np.empty(inside), recent.gap[0]
    for j in range(inside):
        # Where the traction is not extrapolated, what is found is not used.
        scaled[j] = tractions[j] / tabor if last[j] < below else -1.0
    if not judged:
        pressed_gaps(scaled, inside, last, law, pressed)
    for j in range(n):
        if last[j] >= below:
            gap[j] = min(max(gap[j], law.floor + 0.7 * (last[j] - law.floor)), 1.6 * last[j])
        elif scaled[j] >= 0.85 * PEAK_TRACTION:
            gap[j] = 1.0 + 0.12 * law.rise
        else:
            gap[j] = last[j] if judged else pressed[j]
            continue
        tractions[j] = tabor * traction_at(law, gap[j])


@kernel
def prediction_error(
    interface: Interface,
    weights: np.ndarray,
    guess_gap: np.ndarray,
    guess_traction: np.ndarray,
    gap: np.ndarray,
    tractions: np.ndarray,
    scales: Scales,
    force_expected: float,
) -> float:
    """Largest relative difference between prediction and solution, in the nodes that matter and in the force.

    The force is compared with `force_expected`, or, where that is NaN, with the one of the predicted state. A contact
    that remembers nothing does not depend on how it was reached: there only the course of the force must be followed,
    and the predicted state need only be near enough for Newton-Raphson.
    """
    force = force_of(interface, weights, gap, tractions)
    expected = force_of(interface, weights, guess_gap, guess_traction) if np.isnan(force_expected) else force_expected
    difference = scales.force_weight * abs(expected - force) / max(abs(force), scales.force)
    if interface.nonadhesive:
        return difference
    largest_pressure, worst, below = interface.tabor, 0.0, pressed_below(interface.law)
    for j in range(gap.size):
        largest_pressure = max(largest_pressure, -tractions[j])
    for j in range(gap.size):
        if gap[j] < below and guess_gap[j] < below:
            error = abs(guess_traction[j] - tractions[j]) / largest_pressure
        else:
            error = abs(guess_gap[j] - gap[j]) / gap[j]
            if gap[j] > 2.0:
                error *= (2.0 / gap[j]) ** 2
        worst = max(worst, error)
    return max(scales.local_weight * worst, difference)


@kernel
def bend_of_force(recent: Recent, time: float, force: float) -> float:
    """How far the `force` at `time` lies from the straight line through the last two; 0 where there is only one."""
    if recent.count[0] < 2:
        return 0.0
    slope = (recent.force[0] - recent.force[1]) / (recent.time[0] - recent.time[1])
    return abs(force - recent.force[0] - slope * (time - recent.time[0]))


@kernel
def history_error(
    interface: Interface, recent: Recent, weights: np.ndarray, time: float, force: float, scales: Scales
) -> float:
    """How far the force history between two steps lies from the parabola through them, as `prediction_error`.

    A nearly rigid contact is predicted over any distance, since its gap is known; its force may rise and fall within a
    step all the same, and would be missing from the history.

    Args:
        interface: of the scene.
        recent: at least two solutions before the step.
        weights: of the force on their mesh.
        time: at the end of the step.
        force: there.
        scales: by which the difference is weighed.
    """
    newest, before = recent.time[0], recent.time[1]
    rise = (force - recent.force[0]) / (time - newest)
    rise_before = (recent.force[0] - recent.force[1]) / (newest - before)
    middle = 0.5 * (newest + time)
    curvature = (rise - rise_before) / (time - before)
    parabola = recent.force[0] + rise * (middle - newest) + curvature * (middle - newest) * (middle - time)
    gap, tractions = np.empty(recent.gap.shape[1]), np.empty(recent.gap.shape[1])
    predict(interface, recent, middle, gap, tractions, CONTROL, True)
    expected = force_of(interface, weights, gap, tractions)
    return scales.force_weight * abs(expected - parabola) / max(abs(expected), scales.force)
