"""Models beside the solver: elastic contacts, whose tension depends on the depth alone, and Ting's viscoelastic sphere.

Spheres are parabolic: their contact is small beside the radius. JKR in full, with a the contact radius: depth a^2/R -
sqrt(2 pi w a / E*), tension sqrt(8 pi w E* a^3) - (4/3) E* a^3 / R. Its Tabor parameter is above 5, that of DMT below
0.1; Maugis and Dugdale's attraction, constant up to a range, leads from one to the other.

Ting's sphere does not adhere, on a standard linear solid or a power law. A contact that stays a disc is a row of
independent springs and dashpots, at distances x from its middle, whose tops the profile x^2/R presses to depth - x^2/R
(Popov and Hess, Method of Dimensionality Reduction, 2015, chapter 8). The surface follows the sphere, or relaxes freely
where it would have to be pulled. That holds for any history, behind a spring too. Sources: Ting, J. Appl. Mech. 33
(1966) 845; Efremov et al., Sci. Rep. 7 (2017) 1541.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.special import gamma

from bem._support.jit import kernel
from bem._support.validation import FloatArray
from bem.lab.models.model import (
    ADHESION,
    MODULUS,
    MODULUS_RATIO,
    RETARDATION_TIME,
    Model,
    Parameter,
    Path,
    Values,
    contact_modulus,
)
from bem.lab.setup import Setup
from bem.reference_solutions import maugis_dugdale

TABOR = Parameter("tabor", "", "logarithm", 0.02, 20.0, "a noise far below the pull-off force")
MODULUS_AT_1S = Parameter("modulus_at_1s", "Pa", "logarithm", 1e0, 1e12, "a deeper indentation")
EXPONENT = Parameter("exponent", "", "logit", 1e-3, 0.98, "a dwell and ramps of different lengths")
TABLE = np.linspace(0.0, 1.0, 1500) ** 2
"""Shares of the largest depth or radius at which a branch is tabulated, denser where the contact begins."""
_SMALLEST = 1e-9  # work of adhesion in J/m^2, that stands for none: Maugis' family is scaled by it
_ANGLES = np.geomspace(1e-6, 0.5 * np.pi - 1e-4, 100)[::-1]
_ELEMENTS = 100
_STEP = 1.2  # of the logarithm of the rate
_FASTEST, _SLOWEST = 10.0, 0.03  # rates, over that of the shortest step and of the whole curve

Curve = tuple[FloatArray, FloatArray]
"""Depths (m), growing to at least the deepest, and tensions (N)."""
Relaxation = tuple[float, FloatArray, FloatArray]
"""Contact modulus after all relaxation (Pa), and the terms of E*(t) beside it: strengths (Pa) and times (s)."""


def elastic_tension(branch: Callable[[Values, Setup, float], Curve], values: Values, path: Path) -> FloatArray:
    """See `Model.tension`, by the branch, of values, setup and largest depth, that is stable at fixed indentation.

    A spring moves its end to where contact and spring lose stability together. Beyond its ends the branch is continued
    by its last value.
    """
    apart = path.place - values["contact_point"]
    stretched = 2.0 * np.pi * path.setup.radius * values.get("work_of_adhesion", 0.0) * path.compliance
    depth, force = branch(values, path.setup, max(float(apart.max()), 0.0) + stretched + 1e-15)
    stage = depth - force * path.compliance
    first = int(np.argmin(stage))
    return np.interp(apart, stage[first:], force[first:])


def hertz(values: Values, setup: Setup, deepest: float) -> Curve:
    """Force (4/3) E* sqrt(R) depth^(3/2): Johnson, Contact Mechanics (1985), section 4.2."""
    depth = deepest * TABLE
    return depth, -4.0 / 3.0 * contact_modulus(values, setup) * np.sqrt(setup.radius) * depth**1.5


def cone(values: Values, setup: Setup, deepest: float) -> Curve:
    """Force (2/pi) E* tan(alpha) depth^2, large beside the radius: Sneddon, Int. J. Eng. Sci. 3 (1965) 47."""
    if setup.half_angle is None:
        raise ValueError("half_angle must be given for a cone or a pyramid; received None")
    depth, slope = deepest * TABLE, float(np.tan(np.radians(setup.half_angle)))
    return depth, -2.0 / np.pi * contact_modulus(values, setup) * slope * depth**2


def pyramid(values: Values, setup: Setup, deepest: float) -> Curve:
    """Force 0.7453 E* tan(alpha) depth^2, alpha between a face and the axis: Bilodeau, J. Appl. Mech. 59 (1992) 519."""
    depth, force = cone(values, setup, deepest)
    return depth, 0.7453 * np.pi / 2.0 * force


def dmt(values: Values, setup: Setup, deepest: float) -> Curve:
    """Hertz's contact, pulled by the long-ranged attraction 2 pi R w outside it; see `bem.reference_solutions.dmt`."""
    depth, force = hertz(values, setup, deepest)
    return depth, force + 2.0 * np.pi * setup.radius * values["work_of_adhesion"]


def jkr(values: Values, setup: Setup, deepest: float) -> Curve:
    """Short-ranged adhesion, from where contact and spring lose stability on; see `bem.reference_solutions.jkr`."""
    modulus, work, radius = contact_modulus(values, setup), values["work_of_adhesion"], setup.radius
    pull = 2.0 * np.pi * work / modulus

    def at(a: FloatArray) -> Curve:
        return a**2 / radius - np.sqrt(pull * a), 2.0 * modulus * (np.sqrt(pull * a**3) - 2.0 / 3.0 * a**3 / radius)

    fold = np.cbrt(radius**2 * pull / 16.0)
    # Above the largest radius: depth >= a^2/R - sqrt(pull a), and sqrt(pull a) <= a^2/(4 R) + (3/4) (pull^2 R)^(1/3).
    largest = np.sqrt(4.0 / 3.0 * radius * (deepest + 0.75 * np.cbrt(pull**2 * radius)))
    first = fold
    if setup.stiffness is not None and fold > 0.0:
        coarse = fold + (largest - fold) * TABLE[::15]
        depth, force = at(coarse)
        first = coarse[max(int(np.argmin(depth - force / setup.stiffness)) - 1, 0)]
    return at(first + (largest - first) * TABLE)


def maugis(values: Values, setup: Setup, deepest: float) -> Curve:
    """From DMT to JKR, from the fold on; see `bem.reference_solutions.maugis_dugdale`."""
    work, tabor = max(values["work_of_adhesion"], _SMALLEST), values["tabor"]
    gap = np.cbrt(setup.radius * (work / contact_modulus(values, setup)) ** 2) / tabor
    depth = maugis_dugdale.solution_at_angle(_ANGLES, tabor)[1] * gap
    least = _ANGLES[min(int(np.flatnonzero(depth < deepest)[-1]) + 1, _ANGLES.size - 1)]
    _, depth, force = maugis_dugdale.solution_at_angle(least + (_ANGLES[0] - least) * TABLE[::-1], tabor)
    first = int(np.argmin(depth))
    return depth[first:] * gap, force[first:] * np.pi * setup.radius * work


def relaxing_tension(relaxation: Callable[[Values, Path], Relaxation], values: Values, path: Path) -> FloatArray:
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
    """Of a standard linear solid, whose relaxation time is modulus ratio times retardation time."""
    relaxed, ratio = contact_modulus(values, path.setup), values["modulus_ratio"]
    return relaxed, np.array([relaxed * (1.0 / ratio - 1.0)]), np.array([ratio * values["retardation_time"]])


def power_law(values: Values, path: Path) -> Relaxation:
    """Of E(t) = E1 (t / 1 s)^(-exponent), a sum of exponentials with times a factor apart.

    It is the trapezoidal rule of the Laplace integral in the logarithm of the rate, which converges exponentially,
    between the shortest step of the path and its duration. One term on either side stands for all others: slower ones
    relax by a part that is linear in time, faster ones at once, and either is known by two moments.
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


def _elastic(name: str, title: str, branch: Callable[[Values, Setup, float], Curve], *further: Parameter) -> Model:
    # Where parameters trade off, the error of the table must not look like a difference.
    step = 0.02 if TABOR in further else 1e-4
    return Model(name, title, (MODULUS, *further), partial(elastic_tension, branch), step, ADHESION in further)


def _relaxing(name: str, solid: str, relaxation: Callable[[Values, Path], Relaxation], *parameters: Parameter) -> Model:
    title = f"Ting: viscoelastic sphere without adhesion, {solid}"
    return Model(name, title, parameters, partial(relaxing_tension, relaxation), 1e-3)


MODELS = (
    _elastic("hertz", "Hertz: elastic sphere without adhesion", hertz),
    _elastic("cone", "Sneddon: elastic cone without adhesion", cone),
    _elastic("pyramid", "Bilodeau: elastic pyramid without adhesion", pyramid),
    _elastic("dmt", "DMT: elastic sphere with long-ranged adhesion", dmt, ADHESION),
    _elastic("jkr", "JKR: elastic sphere with short-ranged adhesion", jkr, ADHESION),
    _elastic("maugis", "Maugis-Dugdale: elastic sphere between DMT and JKR", maugis, ADHESION, TABOR),
    _relaxing("ting", "standard linear solid", one_time, MODULUS, RETARDATION_TIME, MODULUS_RATIO),
    _relaxing("ting_power_law", "power law", power_law, MODULUS_AT_1S, EXPONENT),
)
