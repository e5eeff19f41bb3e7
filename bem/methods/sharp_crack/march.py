"""A contact with a sharp edge along a history of its depth, in compiled steps.

A step is halved while the edge opens by more than half a per cent of its radius in it.

Units: as in `bem.methods.sharp_crack.far_field`.
"""

import numpy as np

from bem._support.jit import kernel
from bem.methods.records import Records, new_records, with_jump, with_record
from bem.methods.sharp_crack.edge import Contact, State
from bem.methods.sharp_crack.steps import advance, dent
from bem.problem.tractions import Law, tail_force_at

_MOST_RUN, _LITTLE_RUN = 0.005, 0.0025  # of the edge in a step, over its radius
_SHORTEST = 1.0 / 500.0  # step, over the whole one


@kernel
def _force(contact: Contact, law: Law, state: State) -> float:
    """Force; without contact that of surfaces which only the dent of the contact before has deformed."""
    if state.radius > 0.0:
        return state.force
    return tail_force_at(law, max(1.0 + contact.tabor * (dent(state) - state.depth), 1.0))


@kernel
def _recorded(records: Records, contact: Contact, law: Law, old: State, new: State) -> Records:
    """The records with one more state, and with the jump where contact begins or ends in it; depths in h0."""
    depth, force = contact.tabor * new.depth, _force(contact, law, new)
    if (old.radius > 0.0) != (new.radius > 0.0):
        before = _force(contact, law, old)
        records = with_record(records, new.time, depth, before, old.radius)
        records = with_jump(records, new.time, depth, (before, force), (np.nan, np.nan), np.nan, depth)
    return with_record(records, new.time, depth, force, new.radius)


@kernel
def follow(
    contact: Contact, law: Law, first: State, spare: State, instants: np.ndarray, times: np.ndarray, depths: np.ndarray
) -> tuple[Records, float, int]:
    """Follow a history from its first state on.

    Args:
        contact: what does not change.
        law: the traction law.
        first: state at the first instant; its arrays are used.
        spare: arrays of the same size.
        instants: (s,) at which a step ends, unless the edge runs.
        times: (p,) of the history, linear in between.
        depths: (p,)

    Returns:
        records, length of the zone over the radius at the largest force, and the number of steps.
    """
    old, segment, steps, part = first, 0, 0, 1.0
    records = with_record(new_records(), old.time, contact.tabor * old.depth, _force(contact, law, old), old.radius)
    largest, zone = old.force, old.zone
    for n in range(instants.size):
        begin, end = old.time, instants[n]
        while times[segment + 1] < end:
            segment += 1
        rate = (depths[segment + 1] - depths[segment]) / (times[segment + 1] - times[segment])
        while old.time < end:
            time = min(old.time + part * (end - begin), end)
            if end - time < 1e-3 * part * (end - begin):
                time = end
            depth = depths[segment] + (time - times[segment]) * rate
            new = advance(contact, old, time, depth, spare)
            run = (old.radius - new.radius) / max(old.radius, 1e-9)
            if run > _MOST_RUN and part > _SHORTEST:
                part *= 0.5
                continue
            if run < _LITTLE_RUN:
                part = min(1.0, 2.0 * part)
            records = _recorded(records, contact, law, old, new)
            old, spare = new, old
            steps += 1
            if old.force > largest:
                largest, zone = old.force, old.zone
    return records, zone, steps
