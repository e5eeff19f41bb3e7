"""First guesses of a fit from a curve, by closed forms, and the spread of Hertz's modulus over windows of depth."""

from __future__ import annotations

import dataclasses

import numpy as np

from bem._support.validation import FloatArray
from bem.lab.fitting.measurement import Measurement
from bem.lab.fitting.regression import Regression
from bem.lab.models import LADDER

_PLACES = 80  # of the contact point that are tried
WINDOWS = (0.5, 0.65, 0.8, 1.0)
"""Shares of the depth over which Hertz is fitted to the approach."""


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
    """Hertz's modulus, in Pa, of the approach down to shares of its depth.

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
        found.append(problem.run(np.zeros(2)).values["relaxed_modulus"])
    return found
