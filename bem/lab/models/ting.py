"""Ting: a sphere on a viscoelastic half-space or layer without adhesion, a standard linear solid.

The contact is a row of independent springs and dashpots, at distances x from its middle, whose tops the sphere presses
by depth - g(x), where 2 E* x is the slope of the elastic force at the depth g(x) (Popov and Hess, Method of
Dimensionality Reduction, 2015, chapter 8). The surface follows the sphere, or relaxes freely where it would have to be
pulled. That holds for any history, holds and several cycles included, behind a spring too.
"""

from __future__ import annotations

import numpy as np

from bem._support.jit import kernel
from bem._support.validation import FloatArray
from bem.lab.models.hertz import pressing
from bem.lab.models.model import MODULUS, MODULUS_RATIO, RETARDATION_TIME, Model, Path, Values, setup_of
from bem.problem.materials import relaxation_spectrum

_ELEMENTS = 100


def tension(values: Values, path: Path) -> FloatArray:
    """See `Model.tension`."""
    apart = path.position - values["contact_point"]
    depth, force = pressing(path.setup, max(float(apart.max()), 1e-15))
    half_width = np.gradient(force, depth) / 2.0
    elements = (np.arange(_ELEMENTS) + 0.5) * half_width[-1] / _ELEMENTS
    profile, width = np.interp(elements, half_width, depth), 2.0 * half_width[-1] / _ELEMENTS
    setup = setup_of(values, path.setup)
    moduli, times = relaxation_spectrum(setup.material)
    terms = setup.contact_modulus * moduli, setup.time_scale * times
    return -pressed(path.time, apart, profile, width, setup.contact_modulus, *terms, path.compliance)


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
        relaxed, strengths, times: contact modulus after all relaxation (Pa), and strengths (Pa) and times (s) of the
            terms beside it.
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


MODEL = Model(
    "ting",
    "Ting: viscoelastic sphere without adhesion, exact geometry",
    "Ting, J. Appl. Mech. 33 (1966) 845",
    "no adhesion, a standard linear solid or a known series, a half-space or a bonded layer, depth at most the radius",
    (MODULUS, RETARDATION_TIME, MODULUS_RATIO),
    tension,
    1e-3,
)
