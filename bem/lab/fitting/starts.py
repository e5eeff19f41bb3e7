"""First guesses of a fit from a curve, by closed forms, and the spread of Hertz's modulus over windows of depth."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from bem._support.validation import FloatArray, finite_number
from bem.lab.contact_point import STANDS_OUT
from bem.lab.curve import ForceCurve
from bem.lab.fitting.measurement import Measurement
from bem.lab.fitting.regression import Regression
from bem.lab.models import LADDER
from bem.lab.setup import Setup
from bem.lab.units import Quantity, to_si
from bem.reference_solutions import jkr

_PLACES = 80  # of the contact point that are tried
WINDOWS = (0.5, 0.65, 0.8, 1.0)
"""Shares of the depth over which Hertz is fitted to the approach."""


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


def hertz_line(data: Measurement) -> dict[str, float]:
    """Modulus and contact point by which Hertz's force, a line in depth^(3/2), misses the approach least."""
    setup, depth = data.path.setup, data.depth
    counted = slice(0, data.top + 1) if np.any(data.weights[: data.top + 1]) else slice(0, None)
    depth, tension = depth[counted], data.tension[counted]
    deepest = float(depth.max())
    places = np.linspace(-0.7, 0.95, _PLACES) * deepest
    power = np.maximum(depth - places[:, None], 0.0) ** 1.5
    centred, rest = power - power.mean(axis=1, keepdims=True), tension - tension.mean()
    square, product = np.sum(centred**2, axis=1), centred @ rest
    best = int(np.argmax(np.where(product < 0.0, product**2, 0.0) / np.maximum(square, 1e-300)))
    slope = min(float(product[best] / max(square[best], 1e-300)), -1e-15 / deepest**1.5)
    modulus = -0.75 * slope / np.sqrt(setup.radius) * (1.0 - setup.poisson_ratio**2)
    return {
        "relaxed_modulus": float(np.clip(modulus, 2.0, 5e11)),
        "contact_point": float(data.path.place[data.first] + places[best]),
    }


def pulled(data: Measurement) -> float:
    """Largest tension over the baseline, in N, at least the noise."""
    baseline = float(np.median(data.tension[: data.first]))
    return max(float(np.max((data.tension - baseline)[data.weights > 0.0])), data.noise)


def windows_of_depth(data: Measurement, start: dict[str, float], weighted: float = 0.0) -> list[float]:
    """Hertz's modulus, in Pa, of the approach down to shares of its depth that hold a force.

    Args:
        data: the curve.
        start: modulus and contact point to begin with.
        weighted: distance from the contact point, in m, within which points count less, in proportion to it, as
            nanite weights them; zero weighs all alike.
    """
    depth = data.depth
    number = np.arange(depth.size)
    away = np.abs(data.path.place - start["contact_point"])
    near: FloatArray = np.minimum(away / weighted, 1.0) if weighted else np.ones(depth.size)
    found = []
    for share in WINDOWS:
        counts = (number <= data.top) & (depth <= share * float(depth.max()))
        part = dataclasses.replace(data, weights=near * counts)
        problem = Regression(LADDER["hertz"], part, start, ("relaxed_modulus", "contact_point"))
        fitted = problem.run(np.zeros(2))
        # Without a force the modulus is any small number.
        if -problem.tension(fitted.x)[counts].min() > STANDS_OUT * data.noise:
            found.append(fitted.values["relaxed_modulus"])
    return found
