"""Force curves from closed forms that share no code with the models: Hertz, cone, DMT, JKR behind a spring, Ting.

A form draws a contact and gives instants (s), places of the stage (m), tensions (N), the arguments of `Setup` that are
known, and the true parameters. Each curve has an unknown contact point, an offset, a tilt, a drag and noise.
`CLASSES[name](rng)` gives the curve, the setup that is known, and the truth; `UNKNOWN` has shapes that no model is for.
"""

from functools import partial

import numpy as np
from scipy.optimize import brentq

from bem.lab import ForceCurve, Setup

POINTS = 2000
INCOMPRESSIBLE = 0.75  # 1 - nu^2: modulus over reduced modulus


def stage_path(rng, far, deep, dwell=0.0, points=POINTS):
    """Instants (s) and places (m) of a stage that approaches from `-far` to `deep`, holds and withdraws."""
    speed = (far + deep) / rng.uniform(0.3, 1.0)
    ramp = (far + deep) / speed
    time = np.linspace(0.0, 2.0 * ramp + dwell * ramp, points)
    position = np.minimum(np.minimum(-far + speed * time, deep), deep - speed * (time - ramp - dwell * ramp))
    return time, position


_SHARES = np.linspace(0.0, 0.98, 100_001)
_LOGARITHM = np.log((1.0 + _SHARES) / (1.0 - _SHARES))


def sphere(depth, radius):
    """Force over the reduced modulus (m^2) of a sphere at depths (m): Sneddon's, by a table of contact radii."""
    force = 0.5 * radius**2 * ((_SHARES**2 + 1.0) * _LOGARITHM - 2.0 * _SHARES)
    return np.interp(depth, 0.5 * radius * _SHARES * _LOGARITHM, force, left=0.0)


def hertz(rng):
    """Hertz, on a spring in half of the cases."""
    radius, modulus = 10 ** rng.uniform(-6.0, -4.5), 10 ** rng.uniform(3.0, 6.0)
    deep, reduced = 0.1 * radius, modulus / INCOMPRESSIBLE
    stiffness = None if rng.random() < 0.5 else 4.0 * reduced * np.sqrt(radius * deep) * rng.uniform(0.2, 2.0)
    press = 0.0 if stiffness is None else reduced * sphere(deep, radius) / stiffness
    time, position = stage_path(rng, rng.uniform(0.5, 2.0) * (deep + press), deep + press, rng.choice([0.0, 0.3]))

    def tension_at(depth):
        return -reduced * sphere(depth, radius)

    def held(stage):
        return brentq(lambda depth: stiffness * (depth - stage) - tension_at(depth), 0.0, stage, xtol=1e-16)

    tension = np.array([tension_at(held(stage) if stiffness and stage > 0.0 else stage) for stage in position])
    setup = {"radius": radius, "relaxed_modulus": 1e4, "stiffness": stiffness}
    return time, position, tension, setup, {"relaxed_modulus": modulus}


def cone(rng):
    """Sneddon's cone."""
    modulus, angle = 10 ** rng.uniform(3.0, 6.0), rng.uniform(15.0, 40.0)
    deep = 1e-6
    time, position = stage_path(rng, rng.uniform(0.5, 2.0) * deep, deep)
    tension = -2 / np.pi * modulus / INCOMPRESSIBLE * np.tan(np.radians(angle)) * np.maximum(position, 0.0) ** 2
    setup = {"radius": 1e-8, "relaxed_modulus": 1e4, "half_angle": angle}
    return time, position, tension, setup, {"relaxed_modulus": modulus}


def dmt(rng):
    """DMT behind a spring, with its jumps."""
    radius, modulus, work = 20e-9, 10 ** rng.uniform(9.0, 10.0), 10 ** rng.uniform(-2.0, -1.0)
    hertzian = 4 / 3 * modulus / INCOMPRESSIBLE * np.sqrt(radius)
    pull = 2.0 * np.pi * radius * work
    deep = (rng.uniform(1.5, 4.0) * pull / hertzian) ** (2 / 3)
    stiffness = pull / deep * rng.uniform(0.2, 3.0)
    reduced = modulus / INCOMPRESSIBLE
    top = deep + (reduced * sphere(deep, radius) - pull) / stiffness
    time, position = stage_path(rng, rng.uniform(0.7, 2.0) * (top + pull / stiffness), top)
    tension = np.zeros(position.size)
    # In contact from stage 0 on, and back to where the depth is zero again.
    for i in range(np.argmax(position > 0.0), position.size - np.argmax(position[::-1] > -pull / stiffness)):
        balance = lambda d, z=position[i]: stiffness * (d - z) - pull + reduced * sphere(d, radius)  # noqa: E731
        depth = brentq(balance, 0.0, abs(position[i]) + 2.0 * pull / stiffness, xtol=1e-18)
        tension[i] = stiffness * (depth - position[i])
    setup = {"radius": radius, "relaxed_modulus": 1e9, "stiffness": stiffness}
    return time, position, tension, setup, {"relaxed_modulus": modulus, "work_of_adhesion": work}


def jkr(rng):
    """JKR behind a spring, with its jumps."""
    radius, modulus, work = 10 ** rng.uniform(-5.7, -4.7), 10 ** rng.uniform(5.5, 6.5), 10 ** rng.uniform(-2.0, -1.0)
    reduced = modulus / INCOMPRESSIBLE
    work = min(work, 0.05 * reduced * radius)
    a0 = (6.0 * np.pi * work * radius**2 / (4.0 / 3.0 * reduced)) ** (1 / 3)
    stiffness = 2.0 * reduced * a0 * rng.uniform(0.2, 2.0)

    def force_of(a):
        pressed = 0.5 * reduced * ((a**2 + radius**2) * np.log((radius + a) / (radius - a)) - 2.0 * a * radius)
        return -pressed + np.sqrt(8.0 * np.pi * work * reduced * a**3)

    def stage_of(a):
        depth = 0.5 * a * np.log((radius + a) / (radius - a))
        return depth - np.sqrt(2.0 * np.pi * work * a / reduced) - force_of(a) / stiffness

    # The contact stays smaller than the sphere.
    radii = np.linspace(0.05 * a0, min(rng.uniform(1.1, 1.5) * a0, 0.95 * radius), 200_001)
    stages = stage_of(radii)
    turn = int(np.argmin(stages))
    time, position = stage_path(rng, rng.uniform(0.5, 1.5) * (stages[-1] - stages[turn]) - stages[turn], stages[-1])
    tension = np.zeros(position.size)
    for i in range(np.argmax(position > 0.0), position.size - np.argmax(position[::-1] > stages[turn])):
        tension[i] = force_of(brentq(lambda a, z=position[i]: stage_of(a) - z, radii[turn], radii[-1] * 1.001))
    setup = {"radius": radius, "relaxed_modulus": 1e6, "stiffness": stiffness}
    return time, position, tension, setup, {"relaxed_modulus": modulus, "work_of_adhesion": work}


def ting(rng):
    """Ting's integrals for a standard linear solid, with a dwell of the sphere."""
    radius, modulus, ratio = 10e-6, 10 ** rng.uniform(2.5, 4.0), rng.uniform(0.2, 0.6)
    deep = 1e-6
    time, position = stage_path(rng, rng.uniform(0.5, 1.5) * deep, deep, dwell=rng.uniform(0.5, 2.0), points=1500)
    relaxation = 10 ** rng.uniform(-1.3, 0.0) * (time[-1] - time[0]) * 0.3
    # Corners of the path do not fall on the fine grid exactly; both sides use the same path.
    fine = np.linspace(time[0], time[-1], 6001)
    path, middle = np.interp(fine, time, position), 0.5 * (fine[1:] + fine[:-1])
    depth, rate = np.maximum(path, 0.0), np.diff(path)
    power = np.diff(sphere(depth, radius))
    top, touched = int(np.flatnonzero(rate < 0.0)[0]), np.flatnonzero(depth > 0.0)[0]

    def at(age):
        return modulus / INCOMPRESSIBLE * (1.0 + (1.0 / ratio - 1.0) * np.exp(-age / relaxation))

    loading = np.zeros(fine.size)
    for n in range(1, fine.size):
        relaxed = at(fine[n] - middle[:n])
        if n <= top:
            loading[n] = np.sum(relaxed * power[:n])
            continue
        # The contact now is as large as it was at the instant t1: the integral of E d(depth) from there is zero.
        backward = np.cumsum((relaxed * rate[:n])[::-1])[::-1]
        crossing = np.flatnonzero(backward[:top] >= 0.0)
        if crossing.size == 0 or crossing[-1] < touched:
            break
        m = int(crossing[-1])
        share = backward[m] / max(backward[m] - backward[m + 1], 1e-300)
        loading[n] = np.sum(relaxed[:m] * power[:m]) + share * relaxed[m] * power[m]
    tension = -np.interp(time, fine, loading)
    truth = {"relaxed_modulus": modulus, "modulus_ratio": ratio, "retardation_time": relaxation / ratio}
    return time, position, tension, {"radius": radius, "relaxed_modulus": 1e4}, truth


def pressed_by(rng, force_of, share=(0.05, 0.3)):
    """A sphere without spring on a solid whose compression is `force_of(depth, radius, reduced, deep)`."""
    radius, modulus = 10 ** rng.uniform(-6.0, -4.5), 10 ** rng.uniform(3.0, 6.0)
    deep = rng.uniform(*share) * radius
    time, position = stage_path(rng, rng.uniform(0.5, 2.0) * deep, deep)
    tension = -force_of(np.maximum(position, 0.0), radius, modulus / INCOMPRESSIBLE, deep)
    return time, position, tension, {"radius": radius, "relaxed_modulus": 1e4}, {"relaxed_modulus": modulus}


def flat_punch(rng):
    """The end of a cylinder as wide as the sphere: a line."""
    return pressed_by(rng, lambda depth, radius, reduced, _: 2.0 * reduced * radius * depth)


def layer(rng):
    """An incompressible layer bonded to glass, 0.3 to 1 of its thickness wide in contact (Dimitriadis, 2002)."""
    chi = rng.uniform(0.3, 1.0)

    def force(depth, radius, reduced, deep):
        x = chi * np.sqrt(depth / deep)
        series = 1.0 + 1.133 * x + 1.283 * x**2 + 0.769 * x**3 + 0.0975 * x**4
        return 4 / 3 * reduced * np.sqrt(radius) * depth**1.5 * series

    return pressed_by(rng, force)


def two_slopes(rng):
    """A solid that is two to ten times stiffer from a depth on."""
    stiffer, begins = rng.uniform(2.0, 10.0), rng.uniform(0.3, 0.7)

    def force(depth, radius, reduced, deep):
        further = np.maximum(depth - begins * deep, 0.0)
        return 4 / 3 * reduced * np.sqrt(radius) * (depth**1.5 + (stiffer - 1.0) * further**1.5)

    return pressed_by(rng, force)


def deep_sphere(rng):
    """A sphere pressed to 0.5 to 1 of its radius: Sneddon's depth and force at a contact radius, in closed form."""
    return pressed_by(rng, lambda depth, radius, reduced, _: reduced * sphere(depth, radius), (0.5, 1.0))


def measured(form, rng, noise=None, correlation=0.0):
    """The curve that an instrument writes whose position counts from elsewhere, the known setup, and the truth.

    `noise` is a share of the range of the force, by default 0.2 to 5 %, log-uniform.
    """
    time, position, tension, setup, truth = form(rng)
    noise = noise or float(np.exp(rng.uniform(np.log(0.002), np.log(0.05))))
    size, speed = np.ptp(tension), np.gradient(position, time)
    disturbances = {
        "force_offset": rng.uniform(-0.3, 0.3) * size,
        "tilt": rng.uniform(-0.05, 0.05) * size / np.ptp(position),
        "drag": rng.uniform(0.0, 0.03) * size / np.abs(speed).max(),
    }
    offset, tilt, drag = disturbances.values()
    scatter = rng.standard_normal(time.size)
    for i in range(1, time.size if correlation else 0):
        scatter[i] = correlation * scatter[i - 1] + np.sqrt(1.0 - correlation**2) * scatter[i]
    force = tension + (offset + tilt * position - drag * speed) + noise * size * scatter
    contact_point = rng.uniform(-1.0, 1.0) * np.ptp(position)
    stage, stiffness = position + contact_point, setup.get("stiffness")
    behind = {"indentation": stage + force / stiffness, "stage": stage} if stiffness else {"indentation": stage}
    curve = ForceCurve(time=time, force=force, **behind)
    return curve, Setup(work_of_adhesion=1e-3, **setup), disturbances | {"contact_point": contact_point} | truth


CLASSES = {form.__name__: partial(measured, form) for form in (hertz, cone, dmt, jkr, ting)}
UNKNOWN = {form.__name__: partial(measured, form) for form in (flat_punch, layer, two_slopes, deep_sphere)}
"""Shapes of which the models know none but the last, at depths where they used to err."""
