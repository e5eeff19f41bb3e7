"""A contact with a sharp edge along a history of what its loading device prescribes, in compiled steps.

A device prescribes the depth, the stage behind a spring, depth - compliance * force, or the compression. All three grow
with the depth of a stable contact; with a spring or a prescribed force each step seeks the depth at which they have the
value that the history takes. A step is halved while the edge opens by more than half a per cent of its radius in it, or
contact begins in it.

Units: as in `bem.methods.sharp_crack.far_field`.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.outcomes import COMPLETED, DETACHED, OUT_OF_WORK, Outcome
from bem.methods.records import (
    ITERATIONS,
    MULTIPLY_ADDS,
    NODES,
    REJECTIONS,
    STEPS,
    Records,
    is_spent,
    is_to_pause,
    with_jump,
    with_record,
)
from bem.methods.sharp_crack.edge import Contact, State
from bem.methods.sharp_crack.steps import advance, dent
from bem.problem.tractions import Law, tail_force_at

_MOST_RUN, _LITTLE_RUN = 0.005, 0.0025  # of the edge in a step, over its radius
_SHORTEST = 1.0 / 500.0  # step, over the whole one
_BALANCED = 1e-5  # error of what the device prescribes, over 1 plus its value
_MOST_WIDENINGS, _MOST_TRIALS = 60, 40
_COST = 250  # multiply-adds for a node and a term, by the time that they take


class Device(NamedTuple):
    """What moves the contact."""

    compliance: float  # of the spring between stage and sphere, in mu h0 / (pi R dgamma)
    by_force: bool


class Progress(NamedTuple):
    """A history that has been followed up to a state."""

    records: Records
    state: State
    spare: State  # arrays of the same size
    instant: int  # of those at which steps end, the next
    begin: float  # the instant before
    part: float  # of the step to it, that is taken at once
    rate: float  # of the depth in the last step
    largest: float  # force of a contact
    zone: float  # length of the process zone over the radius at that force
    outcome: Outcome


@kernel
def _force_of(contact: Contact, law: Law, state: State) -> float:
    """Force; without contact that of surfaces which only the dent of the contact before has deformed."""
    if state.radius > 0.0:
        return state.force
    return tail_force_at(law, max(1.0 + contact.tabor * (dent(state) - state.depth), 1.0))


@kernel
def _excess(contact: Contact, law: Law, device: Device, state: State, value: float) -> float:
    """By how much the sphere is deeper than balance asks, in what the device prescribes."""
    force = _force_of(contact, law, state)
    return (-force if device.by_force else state.depth - device.compliance * force) - value


@kernel
def _settled(
    contact: Contact, law: Law, device: Device, old: State, time: float, value: float, rate: float, new: State,
    work: np.ndarray,
) -> tuple[State, bool]:  # fmt: skip
    """The contact at a later time in balance with its device, in the arrays of `new`, and whether there is one."""
    work[ITERATIONS] += 1
    if not device.by_force and device.compliance == 0.0:
        return advance(contact, old, time, value, (value - old.depth) / (time - old.time), new), True
    enough = _BALANCED * (1.0 + abs(value))
    low = old.depth + rate * (time - old.time)
    state = advance(contact, old, time, low, rate, new)
    low_excess = _excess(contact, law, device, state, value)
    if abs(low_excess) <= enough:
        return state, True
    towards = -1.0 if low_excess > 0.0 else 1.0
    width, high, high_excess = max(0.3 * abs(low - old.depth), 1e-6), low, low_excess
    for _ in range(_MOST_WIDENINGS):
        if device.by_force and high_excess > 0.0 and state.radius == 0.0:
            return state, False
        low, low_excess = high, high_excess
        high, width = low + towards * width, 2.5 * width
        work[ITERATIONS] += 1
        state = advance(contact, old, time, high, rate, new)
        high_excess = _excess(contact, law, device, state, value)
        if high_excess * low_excess <= 0.0:
            break
    else:
        return state, False
    for trial in range(_MOST_TRIALS):  # by the method of Illinois, with halvings
        if abs(high_excess) <= enough or abs(high - low) <= 1e-12 * (1.0 + abs(high)):
            break
        middle = 0.5 * (low + high)
        if trial % 4 != 3:
            middle = high - high_excess * (high - low) / (high_excess - low_excess)
        work[ITERATIONS] += 1
        state = advance(contact, old, time, middle, rate, new)
        excess = _excess(contact, law, device, state, value)
        if excess * high_excess < 0.0:
            low, low_excess = high, high_excess
        else:
            low_excess *= 0.5
        high, high_excess = middle, excess
    return state, True


@kernel
def _recorded(records: Records, contact: Contact, law: Law, device: Device, old: State, new: State) -> Records:
    """The records with one more state, and with the jump where contact begins or ends in it; depths in h0."""
    depth, force = contact.tabor * new.depth, _force_of(contact, law, new)
    if (old.radius > 0.0) != (new.radius > 0.0):
        before, moves = _force_of(contact, law, old), device.by_force or device.compliance > 0.0
        place = contact.tabor * old.depth if moves else depth
        records = with_record(records, new.time, place, before, old.radius)
        records = with_jump(records, new.time, place, (before, force), (np.nan, np.nan), np.nan, depth)
    return with_record(records, new.time, depth, force, new.radius)


@kernel
def follow(
    contact: Contact, law: Law, device: Device, progress: Progress, instants: np.ndarray, times: np.ndarray,
    values: np.ndarray, work: np.ndarray,
) -> Progress:  # fmt: skip
    """Follow a history until it ends, the budget is spent, or the work is to pause.

    Args:
        contact: what does not change.
        law: the traction law.
        device: what moves the contact.
        progress: the history so far; the arrays of its states are used.
        instants: (s,) at which a step ends, unless the edge runs.
        times: (p,) of the history, linear in between.
        values: (p,) of what the device prescribes.
        work: counts, as in `bem.methods.records`.
    """
    records, old, spare, n, begin, part, rate, largest, zone, outcome = progress
    if records.filled[0] == 0:
        records = with_record(records, old.time, contact.tabor * old.depth, _force_of(contact, law, old), old.radius)
    cost = _COST * contact.radii.size * contact.relaxation.times.size
    while n < instants.size and outcome == COMPLETED and not is_to_pause(work):
        end = instants[n]
        segment = np.searchsorted(times[1:-1], old.time, side="right")
        slope = (values[segment + 1] - values[segment]) / (times[segment + 1] - times[segment])
        time = min(old.time + part * (end - begin), end)
        if end - time < 1e-3 * part * (end - begin):
            time = end
        before = work[ITERATIONS]
        value = values[segment] + (time - times[segment]) * slope
        new, balanced = _settled(contact, law, device, old, time, value, rate, spare, work)
        work[MULTIPLY_ADDS] += cost * (work[ITERATIONS] - before)
        run = (old.radius - new.radius) / max(old.radius, 1e-9)
        snaps_in = old.radius == 0.0 and new.radius > 0.0
        if (run > _MOST_RUN or snaps_in or not balanced) and part > _SHORTEST:
            part *= 0.5
            work[REJECTIONS] += 1
        elif not balanced:
            force = _force_of(contact, law, old)
            nowhere = (np.nan, np.nan)
            records = with_jump(records, old.time, contact.tabor * old.depth, (force, force), nowhere, np.nan, np.nan)
            outcome = DETACHED
        else:
            if run < _LITTLE_RUN:
                part = min(1.0, 2.0 * part)
            records = _recorded(records, contact, law, device, old, new)
            rate = (new.depth - old.depth) / (time - old.time) if (new.radius > 0.0) == (old.radius > 0.0) else 0.0
            old, spare = new, old
            work[STEPS] += 1
            work[NODES] += contact.radii.size
            if old.radius > 0.0 and old.force > largest:
                largest, zone = old.force, old.zone
            if time == end:
                n, begin = n + 1, end
        if is_spent(work):
            outcome = OUT_OF_WORK
    return Progress(records, old, spare, n, begin, part, rate, largest, zone, outcome)
