"""Where the search of a fit starts: from a first guess, from Hertz's, and with several retardation times and ratios."""

from __future__ import annotations

from bem.lab.contact_point import Contact
from bem.lab.curve import ForceCurve
from bem.lab.fitting.parameters import MEMORY
from bem.lab.guess import deep_contact
from bem.lab.setup import Setup

_RATIOS = (0.5, 0.15)
_TIME_SHARES = (0.02, 0.1, 0.5)  # of the duration in contact, at which retardation times are tried


def starting_points(
    curve: ForceCurve, setup: Setup, contact: Contact, duration: float, free: tuple[str, ...]
) -> list[dict[str, float]]:
    """Points to start from: the setup's own values, Hertz's, and several retardation times and modulus ratios."""
    base = {
        "relaxed_modulus": setup.relaxed_modulus,
        "work_of_adhesion": setup.work_of_adhesion,
        # The force leaves the baseline by attraction, before the undeformed sphere would touch.
        "contact_point": contact.contact_point + 0.5 * setup.adhesion_length,
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
