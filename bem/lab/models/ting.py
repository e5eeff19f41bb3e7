"""Ting: a sphere on a viscoelastic half-space without adhesion, a standard linear solid or a power law.

A contact that stays a disc is a row of independent springs and dashpots, at distances x from its middle, whose tops the
profile x^2/R presses to depth - x^2/R (Popov and Hess, Method of Dimensionality Reduction, 2015, chapter 8). The
surface follows the sphere, or relaxes freely where it would have to be pulled. That holds for any history, behind a
spring too.

The power law, E(t) = E1 (t / 1 s)^(-exponent), is a sum of exponentials with times a factor apart, the trapezoidal rule
of its Laplace integral in the logarithm of the rate, which converges exponentially; one term each stands for all that
are faster than the shortest step and slower than the curve. Sources: Ting, J. Appl. Mech. 33 (1966) 845; Efremov et
al., Sci. Rep. 7 (2017) 1541.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.special import gamma

from bem._support.jit import kernel
from bem._support.validation import FloatArray
from bem.lab.models.model import (
    MODULUS,
    MODULUS_RATIO,
    RETARDATION_TIME,
    Model,
    Parameter,
    Path,
    Values,
    contact_modulus,
)
from bem.materials import PronySeries
from bem.materials_library import relaxation_spectrum

MODULUS_AT_1S = Parameter("modulus_at_1s", "Pa", "logarithm", 1e0, 1e12, "a deeper indentation")
EXPONENT = Parameter("exponent", "", "logit", 1e-3, 0.98, "a dwell and ramps of different lengths")
_ELEMENTS = 100
_STEP = 1.2  # of the logarithm of the rate
_FASTEST, _SLOWEST = 10.0, 0.03  # rates, over that of the shortest step and of the whole curve

Relaxation = tuple[float, FloatArray, FloatArray]
"""Contact modulus after all relaxation (Pa), and the terms of E*(t) beside it: strengths (Pa) and times (s)."""


def tension(relaxation: Callable[[Values, Path], Relaxation], values: Values, path: Path) -> FloatArray:
    """See `Model.tension`, of the solid whose terms `relaxation` gives."""
    apart = path.place - values["contact_point"]
    widest = np.sqrt(path.setup.radius * max(float(apart.max()), 1e-15))
    profile = ((np.arange(_ELEMENTS) + 0.5) * widest / _ELEMENTS) ** 2 / path.setup.radius
    relaxed, strengths, times = relaxation(values, path)
    return -pressed(path.time, apart, profile, 2.0 * widest / _ELEMENTS, relaxed, strengths, times, path.compliance)


@kernel
def pressed(
    time: FloatArray,
    apart: FloatArray,
    profile: FloatArray,
    width: float,
    relaxed: float,
    strengths: FloatArray,
    times: FloatArray,
    compliance: float,
) -> FloatArray:
    """Compression (n,), in N, of a row of elements under a stage at `apart` (n,); of second order in the steps.

    Args:
        time: in s.
        apart: path of the stage from first contact, in m.
        profile: depths (m,) by which the sphere falls back at the elements.
        width: of an element, both sides of the middle together, in m.
        relaxed, strengths, times: as in `Relaxation`.
        compliance: of the spring, in m/N.
    """
    force = np.zeros(time.size)
    surface = np.zeros(profile.size)
    memory = np.zeros((profile.size, times.size))
    free = np.zeros(profile.size)
    decay, gain = np.ones(times.size), strengths.copy()
    touched = False
    for n in range(1, time.size):
        if not touched and apart[n] <= 0.0:
            continue
        step = time[n] - time[n - 1]
        if not touched:
            step *= min(apart[n] / (apart[n] - apart[n - 1]), 1.0)
        touched = True
        stiff = relaxed
        for j in range(times.size):
            decay[j] = np.exp(-step / times[j])
            gain[j] = strengths[j] * (times[j] / step * (1.0 - decay[j]) if step > 1e-9 * times[j] else 1.0)
            stiff += gain[j]
        for i in range(profile.size):
            stress = relaxed * surface[i]
            for j in range(times.size):
                stress += decay[j] * memory[i, j]
            free[i] = surface[i] - stress / stiff
        depth = apart[n]
        # Newton's method from above: the force is convex in the depth.
        for _ in range(50):
            pressing, count = 0.0, 0
            for i in range(profile.size):
                ahead = depth - profile[i] - free[i]
                if ahead > 0.0:
                    pressing += ahead
                    count += 1
            force[n] = stiff * width * pressing
            change = (depth - apart[n] + compliance * force[n]) / (1.0 + compliance * stiff * width * count)
            depth -= change
            if abs(change) <= 1e-12 * abs(depth) + 1e-20:
                break
        for i in range(profile.size):
            moved = max(depth - profile[i], free[i]) - surface[i]
            surface[i] += moved
            for j in range(times.size):
                memory[i, j] = decay[j] * memory[i, j] + gain[j] * moved
    return force


def one_time(values: Values, path: Path) -> Relaxation:
    """Of a standard linear solid, whose relaxation time is modulus ratio times retardation time, or a known series."""
    relaxed, material = contact_modulus(values, path.setup), path.setup.material
    if isinstance(material, PronySeries):
        moduli, times = relaxation_spectrum(material)
        return relaxed, relaxed * moduli, times * path.setup.time_scale
    ratio = values["modulus_ratio"]
    return relaxed, np.array([relaxed * (1.0 / ratio - 1.0)]), np.array([ratio * values["retardation_time"]])


def power_law(values: Values, path: Path) -> Relaxation:
    """Terms between the shortest step of the path and its duration, and one on either side of them.

    The slower rates relax by a part that is linear in time, the faster ones at once: either is known by two moments.
    """
    steps = np.diff(path.time)
    fastest, slowest = _FASTEST / float(np.median(steps)), _SLOWEST / float(np.ptp(path.time))
    logarithms = np.arange(np.log(slowest), np.log(fastest), _STEP)
    low, high = np.exp(logarithms[[0, -1]] + 0.5 * _STEP * np.array([-1.0, 1.0]))
    alpha, modulus = values["exponent"], values["modulus_at_1s"] / (1.0 - path.setup.poisson_ratio**2)
    rates = np.hstack([low * alpha / (1.0 + alpha), np.exp(logarithms), high * (2.0 - alpha) / (1.0 - alpha)])
    last = high**alpha * (2.0 - alpha) / (1.0 - alpha) ** 2
    strengths = np.hstack([low**alpha / alpha, _STEP * np.exp(alpha * logarithms), last])
    return 0.0, modulus / gamma(alpha) * strengths, 1.0 / rates


_LINEAR = "Ting: viscoelastic sphere without adhesion, standard linear solid or the known series"
_POWER = "Ting: viscoelastic sphere without adhesion, power law"
MODELS = (
    Model("ting", _LINEAR, (MODULUS, RETARDATION_TIME, MODULUS_RATIO), partial(tension, one_time), 1e-3),
    Model("ting_power_law", _POWER, (MODULUS_AT_1S, EXPONENT), partial(tension, power_law), 1e-3),
)
