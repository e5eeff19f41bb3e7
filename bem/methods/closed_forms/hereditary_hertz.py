"""Lee and Radok: a sphere on a viscoelastic half-space without adhesion, exact while the contact grows.

The force follows from Hertz's law with the hereditary integral of the material in front of it,

    integral of E0 C(t - s) dF(s) = F_Hertz(indentation(t)),

solved here for a force that is linear between many instants (`bem.problem.materials`). Once the contact shrinks the law
does not hold. Units: see `bem.methods.closed_forms`. Source: Lee and Radok, J. Appl. Mech. 27 (1960) 438; Johnson,
Contact Mechanics (1985), section 6.5.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from bem._support.jit import kernel
from bem._support.validation import FloatArray
from bem.methods.closed_forms import hertz
from bem.problem.materials import recursion_step
from bem.problem.protocol import PiecewiseLinearProtocol
from bem.problem.scene import Scene


def force(scene: Scene, history: PiecewiseLinearProtocol, times: ArrayLike) -> FloatArray:
    """Force at `times` within the history (any shape), never positive; meaningful up to the first unloading."""
    dense = dense_instants(history)
    elastic = hertz.force_from_indentation(history.indentation_at(dense), scene.tabor, scene.exponent)
    values = hereditary(dense, elastic, np.array(scene.material.strengths), np.array(scene.material.times))
    return np.minimum(np.interp(np.asarray(times, dtype=np.float64), dense, values), 0.0)


def dense_instants(history: PiecewiseLinearProtocol) -> FloatArray:
    """Instants dense enough for the integral: equal and, after each corner and the touch, geometric steps."""
    corners = set(history.times.tolist())
    for begin, end, low, high in zip(
        history.times[:-1], history.times[1:], history.indentations[:-1], history.indentations[1:], strict=True
    ):
        if low < 0.0 < high:
            corners.add(float(begin + (end - begin) * -low / (high - low)))
    ordered = np.array(sorted(corners))
    unit = np.unique(np.concatenate([np.linspace(0.0, 1.0, 401), np.geomspace(1e-6, 1.0, 121)]))
    return np.unique(np.concatenate([b + (e - b) * unit for b, e in pairwise(ordered)]))


@kernel
def hereditary(instants: np.ndarray, rubbery: np.ndarray, strengths: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Force F (n,) of which F - sum c_i q_i is the `rubbery` force (n,) at `instants` (n,)."""
    force = np.zeros(instants.size)
    force[0] = rubbery[0]
    memory = np.zeros(times.size)
    decay, gain = np.empty(times.size), np.empty(times.size)
    for n in range(1, instants.size):
        remembered, response = 0.0, 1.0
        for i in range(times.size):
            decay[i], gain[i] = recursion_step(instants[n] - instants[n - 1], times[i])
            remembered += strengths[i] * (decay[i] * memory[i] - gain[i] * force[n - 1])
            response -= strengths[i] * gain[i]
        force[n] = (rubbery[n] + remembered) / response
        for i in range(times.size):
            memory[i] = decay[i] * memory[i] + gain[i] * (force[n] - force[n - 1])
    return force
