"""Where the search of a fit starts: from a first guess, from Hertz's, and with several retardation times and ratios."""

from __future__ import annotations

import numpy as np

from bem.lab.contact_point import Contact
from bem.lab.curve import ForceCurve
from bem.lab.fitting.parameters import MEMORY
from bem.lab.guess import deep_contact
from bem.lab.setup import Setup

_RATIOS = (0.5, 0.15)
_TIME_SHARES = (0.02, 0.1, 0.5)  # of the duration in contact, at which retardation times are tried
_FASTER, _STIFFER, _LARGEST_RATIO = (30.0, 6.0), 3.0, 0.8


def starting_points(
    curve: ForceCurve, setup: Setup, contact: Contact, duration: float, free: tuple[str, ...]
) -> list[dict[str, float]]:
    """Points to start from: the setup's own values, Hertz's, and several retardation times and modulus ratios."""
    base = {
        "relaxed_modulus": setup.relaxed_modulus,
        "work_of_adhesion": setup.work_of_adhesion,
        "contact_point": contact.contact_point + _attracted_from(setup),
        "retardation_time": setup.time_scale,
        "modulus_ratio": setup.material.modulus_ratio,
    }
    bases = [base]
    if {"contact_point", "relaxed_modulus"} <= set(free) and (deep := deep_contact(curve, contact, setup.radius)):
        # The stage is as much further as the force offset bends the spring.
        bent = 0.0 if setup.stiffness is None else contact.force_offset / setup.stiffness
        modulus = deep[1] * (1.0 - setup.poisson_ratio**2)
        bases.append(base | {"contact_point": deep[0] - bent, "relaxed_modulus": modulus})
    if not set(free) & set(MEMORY):
        return [*bases, base | {"work_of_adhesion": 0.5 * base["work_of_adhesion"]}]
    times = [share * duration for share in _TIME_SHARES] if "retardation_time" in free else [base["retardation_time"]]
    ratios = _RATIOS if "modulus_ratio" in free else (base["modulus_ratio"],)
    starts = bases
    for time in times:
        for ratio in ratios:
            # A force measured at speed is that of a stiffer solid, and adheres more, than the relaxed one.
            softer = {
                "relaxed_modulus": base["relaxed_modulus"] * ratio**0.5,
                "work_of_adhesion": base["work_of_adhesion"] * ratio**0.5,
            }
            starts.append(base | softer | {"retardation_time": time, "modulus_ratio": ratio})
    return starts


def faster_memories(found: dict[str, float], free: tuple[str, ...]) -> list[dict[str, float]]:
    """Points with shorter retardation times than those of a solution; none unless the time is free.

    A force that decays over the dwell looks like the beginning of a slow relaxation or the whole of a faster and
    smaller one. The search does not cross from one to the other; the instantaneous modulus of both is the same.
    """
    if not {"retardation_time", "modulus_ratio"} <= set(free):
        return []
    stiffer = min(_STIFFER, _LARGEST_RATIO / found["modulus_ratio"])
    changes = {"modulus_ratio": stiffer, "relaxed_modulus": stiffer, "work_of_adhesion": stiffer**0.5}
    changed = {name: found[name] * factor for name, factor in changes.items() if name in free}
    return [found | changed | {"retardation_time": found["retardation_time"] / faster} for faster in _FASTER]


def _attracted_from(setup: Setup) -> float:
    """How far before the undeformed sphere would touch attraction moves the force off the baseline, in m.

    A spring jumps where the attraction of rigid surfaces, 8/3 pi R dgamma over the gap squared, changes as its
    stiffness; a soft one does so from afar.
    """
    near = 0.5 * setup.adhesion_length
    if setup.stiffness is None:
        return near
    stiffness = setup.stiffness * setup.gap / setup.force_scale
    return max(near, (np.cbrt(16.0 / 3.0 / stiffness) - 1.0) * setup.gap)
