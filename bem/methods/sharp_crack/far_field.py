"""The far field of a sharp crack: an axisymmetric contact with memory, by Abel transforms local in the radius.

With the traction sigma and the displacement u of the half-space,

    g(x) = int_x^inf r sigma / sqrt(r^2 - x^2) dr,        y(x) = 1/2 d/dx int_0^x r u / sqrt(x^2 - r^2) dr,
    y = k g + sum_i e_i,        tau_i de_i/dt = c_i g - e_i,

k = 1 - sum_i c_i. In the contact x < a the sphere prescribes y = (x^2 - depth) / 2, which is linear in time over a
step, so that the strains e_i are exact sums of exponentials; outside, g = 0 and they decay. They are continuous
across the edge. The force is (4 / pi) int_0^a g dx.

Units: radius in beta, depth in mu h0, time in retardation times, force in pi R dgamma, tension positive.
Source: Haiat, Phan Huy and Barthel, J. Mech. Phys. Solids 51 (2003) 69; Greenwood, J. Phys. D 43 (2010) 202001.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.validation import FloatArray


class Relaxation(NamedTuple):
    """The strains in the contact, where y is prescribed, in eigenvectors."""

    ratio: float  # k
    times: np.ndarray  # (m,) retardation times, of free decay
    rates: np.ndarray  # (m,) eigenvalues, negative
    vectors: np.ndarray  # (m, m) eigenvectors in columns
    inverse: np.ndarray  # (m, m)
    gains: np.ndarray  # (m,) of y


class HeldStep(NamedTuple):
    """What a step in the contact makes of the strains: matrix @ strains + first * y_before + last * y_after."""

    matrix: np.ndarray  # (m, m)
    first: np.ndarray  # (m,)
    last: np.ndarray  # (m,)


def relaxation_of(strengths: FloatArray, times: FloatArray) -> Relaxation:
    """The relaxation of a Prony series with retardation `strengths` and `times` (m,)."""
    ratio = 1.0 - float(strengths.sum())
    drive = strengths / (ratio * times)
    rates, vectors = np.linalg.eig(-np.outer(drive, np.ones(times.size)) - np.diag(1.0 / times))
    vectors = np.ascontiguousarray(vectors.real)
    inverse = np.linalg.inv(vectors)
    return Relaxation(ratio, times, np.ascontiguousarray(rates.real), vectors, inverse, inverse @ drive)


@kernel
def new_step(terms: int) -> HeldStep:
    """Room for a step of that many terms."""
    return HeldStep(np.empty((terms, terms)), np.empty(terms), np.empty(terms))


@kernel
def held_step(relaxation: Relaxation, dt: float, out: HeldStep) -> None:
    """The step of length `dt` into `out`."""
    rates, vectors, terms = relaxation.rates, relaxation.vectors, relaxation.rates.size
    for i in range(terms):
        out.first[i] = out.last[i] = 0.0
        for j in range(terms):
            out.matrix[i, j] = 0.0
    for n in range(terms):
        exponent = rates[n] * dt
        if abs(exponent) < 1e-3:
            mean, end = 1.0 + exponent * (0.5 + exponent / 6.0), 0.5 + exponent * (1.0 / 6.0 + exponent / 24.0)
        else:
            mean = np.expm1(exponent) / exponent
            end = (mean - 1.0) / exponent
        gain, decay = relaxation.gains[n] * dt, np.exp(exponent)
        for i in range(terms):
            out.first[i] += vectors[i, n] * gain * (mean - end)
            out.last[i] += vectors[i, n] * gain * end
            for j in range(terms):
                out.matrix[i, j] += vectors[i, n] * decay * relaxation.inverse[n, j]


@kernel
def hold(step: HeldStep, strains: np.ndarray, before: float, after: float, out: np.ndarray) -> None:
    """Strains (m,) after a step in which y goes from `before` to `after`, into `out` (m,), another array."""
    for i in range(out.size):
        total = step.first[i] * before + step.last[i] * after
        for j in range(out.size):
            total += step.matrix[i, j] * strains[j]
        out[i] = total


@kernel
def release(relaxation: Relaxation, strains: np.ndarray, dt: float, out: np.ndarray) -> None:
    """Strains (m,) after free decay for `dt`, into `out` (m,)."""
    for i in range(out.size):
        out[i] = strains[i] * np.exp(-dt / relaxation.times[i])


@kernel
def surface(radius: float, depth: float) -> float:
    """Y in the contact."""
    return 0.5 * (radius * radius - depth)
