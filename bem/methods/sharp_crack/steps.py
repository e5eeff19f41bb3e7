"""One step of a contact whose edge is a sharp crack.

A step lets the strains relax with the edge at its place. Where the edge then is pulled by more than its toughness it
opens up to the first radius at which it is not, else it closes outwards as far as it can. The nodes that it passes get
the strains of their own instants.

Units: as in `bem.methods.sharp_crack.far_field`. Sources: see `bem.methods.sharp_crack.zone`.
"""

import numpy as np

from bem._support.jit import kernel
from bem.methods.sharp_crack.edge import (
    Contact,
    Opening,
    State,
    closed_radius,
    excess,
    nodes_inside,
    opened_radius,
    strain_outside,
    total_of,
    wake_share,
)
from bem.methods.sharp_crack.edge_tables import (
    ZONE_LENGTH,
    aged_toughness,
    closing_toughness,
    finite_zone,
    interpolated,
    lagging_speed,
    snap_in_depth,
)
from bem.methods.sharp_crack.far_field import held_step, hold, release, surface

_MARK = 0.2  # of the zone's length, between the places from which the speed of a closing edge is measured
_FORGOTTEN = 20.0  # lengths of the glassy zone from the place of rest, after which an edge that stops rests anew
_NEW_ZONE = 1e3  # lengths of zone from the place of rest, after which its closing speed is forgotten
_AROUND = 0.3  # of the radius, at which the gap is around the contact
_PROFILE = 12  # points of the profile of g within such a cell


@kernel
def _relaxed(contact: Contact, old: State, time: float, depth: float, new: State) -> int:
    """Let all strains relax with the edge at its place, into the arrays of `new`; returns the nodes in the contact."""
    radii, relaxation, dt, edge = contact.radii, contact.relaxation, time - old.time, old.radius
    count, terms, decay = nodes_inside(radii, edge), relaxation.times.size, contact.work[0]
    held_step(relaxation, dt, contact.step)
    for i in range(terms):
        decay[i] = np.exp(-dt / relaxation.times[i])
    for j in range(count):
        after = surface(radii[j], depth)
        hold(contact.step, old.strains[j], surface(radii[j], old.depth), after, new.strains[j])
        contact.pulls[j] = (after - total_of(new.strains[j])) / relaxation.ratio
    for j in range(count, radii.size):
        for i in range(terms):
            new.strains[j, i] = old.strains[j, i] * decay[i]
    for j in range(radii.size):
        new.births[j] = old.births[j]
    for i in range(terms):
        new.outer[i] = old.outer[i] * decay[i] if edge > 0.0 else new.strains[0, i]
        new.inner[i] = new.outer[i]
        new.rest[i] = old.rest[i] * decay[i] if edge > 0.0 else new.strains[0, i]
    if edge > 0.0:
        hold(contact.step, old.inner, surface(edge, old.depth), surface(edge, depth), new.inner)
    return count


@kernel
def _open(contact: Contact, old: State, time: float, depth: float, new: State, count: int, radius: float) -> float:
    """Strains where the edge opens up to `radius`, into the arrays of `new`; returns when the bond there was made."""
    radii, relaxation, dt, edge = contact.radii, contact.relaxation, time - old.time, old.radius
    between = contact.work[1]
    for j in range(count):
        if radii[j] < radius and radius > 0.0:
            continue
        passed = min(max((edge - radii[j]) / max(edge - radius, 1e-300), 0.0), 1.0) * dt
        held_step(relaxation, passed, contact.part)
        depth_then = old.depth + passed / dt * (depth - old.depth)
        hold(contact.part, old.strains[j], surface(radii[j], old.depth), surface(radii[j], depth_then), between)
        release(relaxation, between, dt - passed, new.strains[j])
    if radius == 0.0:
        return time
    low = max(min(int(radius / radii[1]), count - 1), 0)
    last = low == count - 1
    right, birth = (edge, old.bonded) if last else (radii[low + 1], old.births[low + 1])
    part = (radius - radii[low]) / max(right - radii[low], 1e-300)
    for i in range(between.size):
        end = old.inner[i] if last else old.strains[low + 1, i]
        between[i] = old.strains[low, i] + part * (end - old.strains[low, i])
    hold(contact.step, between, surface(radius, old.depth), surface(radius, depth), new.inner)
    # Just outside of the zone: as before, until the edge has left the place of rest.
    length = ZONE_LENGTH * aged_toughness(contact.law, 0.0, time - old.left_rest)
    share = np.exp(-(old.rest_radius - radius) * contact.tabor**2 / length)
    for i in range(between.size):
        new.outer[i] = new.inner[i] - share * (new.inner[i] - new.rest[i])
    return old.births[low] + part * (birth - old.births[low])


@kernel
def _close(
    contact: Contact, old: State, time: float, depth: float, new: State, count: int, radius: float, speed: float,
    closed: float,
) -> None:  # fmt: skip
    """Strains where the edge closes up to `radius`, into the arrays of `new`."""
    radii, relaxation, dt, edge, law = contact.radii, contact.relaxation, time - old.time, old.radius, contact.law
    ratio, between, ahead = relaxation.ratio, contact.work[1], contact.work[2]
    for i in range(ahead.size):
        ahead[i] = strain_outside(contact, new, count, edge, radius, i)
    for j in range(count, radii.size):
        if radii[j] >= radius:
            break
        met = min(max((radii[j] - edge) / (radius - edge), 0.0), 1.0) * dt
        release(relaxation, old.strains[j], met, between)
        held_step(relaxation, dt - met, contact.part)
        then = surface(radii[j], old.depth + met / dt * (depth - old.depth))
        hold(contact.part, between, then, surface(radii[j], depth), new.strains[j])
        contact.pulls[j] = (surface(radii[j], depth) - total_of(new.strains[j])) / ratio
        new.births[j] = old.time + met
    far = max(surface(radius, depth) - total_of(ahead), 0.0)
    log_speed = np.log(max(closed, 1e-300))
    for i in range(ahead.size):
        new.outer[i] = ahead[i]
        new.inner[i] = ahead[i] + far * interpolated(law.log_speed, law.strains[:, i], log_speed)
    _weigh(contact, radius - radii[nodes_inside(radii, radius) - 1], speed / contact.tabor**2, far, new.weights)


@kernel
def _weigh(contact: Contact, width: float, speed: float, far: float, weights: np.ndarray) -> None:
    """Weights (c,) of the outer value of g in its mean over each cell behind an edge that closes at a speed.

    Behind it the strains grow from those outside, as y is held; `width` is that of the first cell.
    """
    relaxation, spacing, between = contact.relaxation, contact.radii[1], contact.work[1]
    none = contact.work[2]
    none[:] = 0.0
    distance, pull, near = 0.0, far, 0.0
    for cell in range(weights.size):
        end = width + cell * spacing
        outer, total, begin = pull, 0.0, distance
        for i in range(1, _PROFILE + 1):
            part = i / _PROFILE
            behind = end * 1e-4 ** (1.0 - part) if cell == 0 else begin + part * (end - begin)
            held_step(relaxation, behind / speed, contact.part)
            hold(contact.part, none, far, far, between)
            before, pull = pull, far - total_of(between)
            total += 0.5 * (pull + before) * (behind - distance)
            distance = behind
        near = (total / max(end - begin, 1e-300) - pull) / max(outer - pull, 1e-9 * far + 1e-300)
        weights[cell] = near if 0.0 < near < 0.5 and outer - pull > 1e-3 * far else 0.5


@kernel
def _opening(contact: Contact, old: State, new: State, time: float, depth: float, count: int) -> Opening:
    """What pulls the edge open, after all strains have relaxed with it at its place."""
    edge, ratio = old.radius, contact.relaxation.ratio
    pull = (surface(edge, depth) - total_of(new.inner)) / ratio if edge > 0.0 else 0.0
    strain = (total_of(new.inner) - total_of(new.rest)) / np.sqrt(0.5 * max(edge, 1e-9))
    around, outside = 0.0, min((1.0 + _AROUND) * edge, contact.radii[-1])
    for i in range(new.outer.size):
        around += strain_outside(contact, new, count, edge, outside, i)
    dt, rested, bonded = time - old.time, time - old.left_rest, time - old.bonded
    growth = _growth(contact, edge, pull, count)
    return Opening(depth, edge, pull, count, dt, rested, old.rest_radius, strain, old.closed, bonded, growth, around)


@kernel
def advance(contact: Contact, old: State, time: float, depth: float, rate: float, new: State) -> State:
    """The contact at a later `time` and `depth`, in the arrays of `new`; `old` is kept.

    `rate` is that of the depth, by which surfaces that approach jump into contact.
    """
    radii, law, unit, edge, dt = contact.radii, contact.law, contact.tabor**2, old.radius, time - old.time
    ratio = contact.relaxation.ratio
    count = _relaxed(contact, old, time, depth, new)
    radius, bonded, closed, rest_radius = edge, old.bonded, old.closed, old.rest_radius
    mark, next_mark = old.mark, old.next_mark
    opening = _opening(contact, old, new, time, depth, count)
    pull, growth, around = opening.pull, opening.growth, opening.around
    # What closes opens only where it is pulled more and more, and what has begun to open closes only where it is not.
    opens, pulled = edge < rest_radius, pull * ratio > surface(edge, old.depth) - total_of(old.inner)
    if edge > 0.0 and pull > 0.0 and (opens or pulled) and excess(contact, opening, edge) > 0.0:
        radius = opened_radius(contact, opening)
        if (rest_radius - radius) * unit >= _NEW_ZONE * ZONE_LENGTH:
            closed = 0.0
        bonded = _open(contact, old, time, depth, new, count, radius)
        mark = next_mark = (radius, time)
    elif edge > 0.0 and opens and pulled:
        radius = edge
    elif edge > 0.0 or depth >= snap_in(contact, new, rate - (dent(new) - dent(old)) / dt):
        if edge == 0.0:
            mark = next_mark = (0.0, old.time)
        radius = closed_radius(contact, new, count, edge, mark, time, dt, depth)
        if radius > edge:
            place, instant = mark
            speed = (radius - place) / (time - instant) * unit
            closed = lagging_speed(law, closed if edge > 0.0 else 0.0, speed, (radius - edge) * unit)
            _close(contact, old, time, depth, new, count, radius, speed, closed)
            zone_length = ZONE_LENGTH * closing_toughness(law, speed)
            bonded = time - zone_length / max(speed, 1e-300)
            if (radius - next_mark[0]) * unit > _MARK * zone_length:
                mark, next_mark = next_mark, (radius, time)
    if radius > edge or (radius == edge and (rest_radius - radius) * unit > _FORGOTTEN * ZONE_LENGTH / ratio):
        rest_radius = radius
        for i in range(new.rest.size):
            new.rest[i] = new.outer[i]
    left_rest = time if radius >= rest_radius else old.left_rest
    if radius <= edge:
        stays = nodes_inside(radii, radius) == count
        for i in range(new.weights.size):
            new.weights[i] = old.weights[i] if stays else 0.5
    force, zone = 0.0, 0.0
    if radius > 0.0:
        force, zone = _force_and_zone(contact, new, radius, depth, 0.0 if rest_radius == radius else growth, around)
    return State(
        time, depth, force, radius, zone, rest_radius, left_rest, bonded, closed, mark, next_mark,
        new.strains, new.births, new.inner, new.outer, new.rest, new.weights,
    )  # fmt: skip


@kernel
def dent(state: State) -> float:
    """Depth at which the sphere touches the surface without force."""
    return -2.0 * total_of(state.strains[0])


@kernel
def snap_in(contact: Contact, new: State, rate: float) -> float:
    """Depth from which surfaces that approach at a rate jump into contact; that of the dent where they do not."""
    return dent(new) + (snap_in_depth(contact.law, contact.tabor, rate) if rate > 0.0 else 0.0)


@kernel
def _force_and_zone(
    contact: Contact, new: State, radius: float, depth: float, growth: float, around: float
) -> tuple[float, float]:
    """Force, and length of the zone over the radius; `growth` is that of an opening edge, 0 for others."""
    radii, pulls = contact.radii, contact.pulls
    count = nodes_inside(radii, radius)
    pull = (surface(radius, depth) - total_of(new.inner)) / contact.relaxation.ratio
    total, weights = 0.0, new.weights
    for j in range(1, count + 1):
        outer, width = (pulls[j], radii[1]) if j < count else (pull, radius - radii[count - 1])
        weight = weights[count - j] if count - j < weights.size else 0.5
        total += (weight * outer + (1.0 - weight) * pulls[j - 1]) * width
    toughness = 2.0 * pull * pull / (np.pi * radius)
    wake = wake_share(radius, pull, surface(radius, depth) - around)
    if growth == 0.0:
        growth, wake = 2.0 * radius * max(pull, 0.0) / np.pi, 1.0
    outside = finite_zone(contact.law, toughness, radius, contact.tabor, growth, wake)[1]
    return 4.0 / np.pi * total + outside, ZONE_LENGTH * toughness / (contact.tabor**2 * radius)


@kernel
def _growth(contact: Contact, edge: float, pull: float, count: int) -> float:
    """Relative growth of g with the radius at the edge, which is that of an opening outside."""
    if edge == 0.0 or pull <= 0.0:
        return 1.0
    radii, pulls = contact.radii, contact.pulls
    near = max(min(int(0.95 * edge / radii[1]), count - 1), 0)
    return max((1.0 - pulls[near] / pull) * edge / (edge - radii[near]), 1e-3)
