"""First guesses of a fit, from closed forms: pull-off force, largest compression and depth of a curve."""

from __future__ import annotations

from typing import Any

import numpy as np

from bem._support.validation import finite_number
from bem.lab.curve import ForceCurve
from bem.lab.setup import Setup
from bem.lab.units import Quantity, to_si
from bem.reference_solutions import jkr


def guess_setup(curve: ForceCurve, *, radius: Quantity, **known: Any) -> Setup:
    """A setup whose modulus and work of adhesion are estimated from the curve.

    The work of adhesion is that of the JKR pull-off force, (3/2) pi R dgamma, and the modulus Hertz's at the deepest
    point. Both are elastic: a viscoelastic contact has a smaller work of adhesion and another modulus.

    Args:
        curve: the measurement.
        radius: of the sphere, in m.
        known: other quantities of a `Setup`; a modulus or work of adhesion among them is kept.

    Raises:
        ValueError: the curve shows no contact, or a quantity is out of range.
    """
    r = finite_number("radius", to_si("radius", radius, "length"), above=0.0)
    curve = curve.with_sign("tension")
    contact = curve.contact()
    pulled = max(curve.pull_off_force - contact.force_offset, 3.0 * contact.noise)
    known.setdefault("work_of_adhesion", pulled / (jkr.PULL_OFF_FORCE * np.pi * r))
    depth = max(float(np.max(curve.indentation)) - contact.contact_point, 1e-12)
    pressed = max(contact.force_offset - float(np.min(curve.force)), 3.0 * contact.noise)
    known.setdefault("relaxed_modulus", 0.75 * 0.75 * pressed / (np.sqrt(r) * depth**1.5))
    return Setup(radius=r, **known)
