"""First guesses of a fit, from closed forms: pull-off force, largest compression and depth of a curve."""

from __future__ import annotations

from typing import Any

import numpy as np

from bem._support.validation import finite_number
from bem.lab.contact_point import Contact, find_contact
from bem.lab.curve import ForceCurve
from bem.lab.setup import Setup
from bem.lab.units import Quantity, to_si
from bem.reference_solutions import jkr

_STEPS = 60
_DEEP = 0.3  # of the largest compression, above which a curve is taken for Hertz's


def guess_setup(curve: ForceCurve, *, radius: Quantity, **known: Any) -> Setup:
    """A setup whose modulus and work of adhesion are estimated from the curve.

    The work of adhesion is that of the JKR pull-off force, (3/2) pi R dgamma, and the modulus that of the JKR force at
    the deepest point. Both are elastic: a viscoelastic contact has a smaller work of adhesion and another modulus.

    Args:
        curve: the measurement.
        radius: of the sphere, in m.
        known: other quantities of a `Setup`; a modulus or work of adhesion among them is kept.

    Raises:
        ValueError: the curve shows no contact, or a quantity is out of range.
    """
    r = finite_number("radius", to_si("radius", radius, "length"), above=0.0)
    contact = first_contact(curve)
    tension = curve.tension - contact.force_offset
    pulled = max(curve.pull_off_force - contact.force_offset, 3.0 * contact.noise)
    known.setdefault("work_of_adhesion", pulled / (jkr.PULL_OFF_FORCE * np.pi * r))
    deepest = int(np.argmax(curve.indentation))
    depth = float(curve.indentation[deepest]) - contact.contact_point
    pressed = max(-float(np.min(tension)), 3.0 * contact.noise)
    work = to_si("work_of_adhesion", known["work_of_adhesion"], "energy per area")
    known.setdefault("relaxed_modulus", _modulus(r, work, depth, pressed))
    return Setup(radius=r, **known)


def _modulus(radius: float, work: float, depth: float, pressed: float) -> float:
    """Young's modulus, for nu = 1/2, at which the JKR force at a depth is the measured one."""
    hertz = 0.75 * 0.75 * pressed / (np.sqrt(radius) * max(depth, 1e-12) ** 1.5)
    best, error = hertz, np.inf
    for modulus in hertz * np.geomspace(0.03, 30.0, _STEPS):
        stretch = np.cbrt(radius * (work / (modulus / 0.75)) ** 2)
        force = -float(jkr.force_from_indentation(depth, stretch)) * np.pi * radius * work
        if abs(force - pressed) < error:
            best, error = modulus, abs(force - pressed)
    return float(best)


def first_contact(curve: ForceCurve) -> Contact:
    """The contact as `find_contact` sees it, with the offset as a tension."""
    contact = find_contact(curve)
    if curve.force_sign == "tension":
        return contact
    return Contact(contact.contact_point, -contact.force_offset, contact.noise, contact.index)


def deep_contact(curve: ForceCurve, contact: Contact, radius: float) -> tuple[float, float] | None:
    """Contact point, in m of indentation, and contact modulus E*, in Pa, that Hertz gives the deep part of an approach.

    A rough or hairy surface is felt long before it carries load; the deep part shows where the solid begins. `None`
    where the curve has too few points there or does not grow.

    Args:
        curve: the measurement.
        contact: of `first_contact`.
        radius: of the sphere, in m.
    """
    deepest = int(np.argmax(curve.indentation))
    compression = contact.force_offset - curve.tension[: deepest + 1]
    deep = compression > _DEEP * float(np.max(compression))
    depth, power = curve.indentation[: deepest + 1][deep], np.cbrt(compression[deep]) ** 2
    if depth.size < 5 or not np.ptp(depth) > 0.0:
        return None
    slope, at_zero = np.polyfit(depth, power, 1)
    if not slope > 0.0:
        return None
    return float(-at_zero / slope), float(0.75 * slope**1.5 / np.sqrt(radius))
