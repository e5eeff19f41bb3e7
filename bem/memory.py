"""What a viscoelastic half-space remembers: one vector per retardation time, advanced exactly over a step.

With q_i(t) = int exp(-(t - s)/tau_i) dsigma(s) the displacement is u = -mu G (sigma - sum_i c_i q_i), sigma positive in tension. Over a step
of length h the traction is the parabola through its last two values and the new one, so that

    q_i(t + h) = e_i q_i(t) + phi_i (sigma(t + h) - sigma(t)) + psi_i * (divided second difference of sigma),

is exact for it, whatever h; the first step after a corner of the protocol or a jump has no earlier value and is linear (psi_i = 0). The
new traction enters with one factor only, `response` = 1 - sum_i c_i (phi_i + psi_i / h), between the modulus ratio and 1.

The vectors live on the fine master grid (see `bem.mesh`), so a new choice of nodes loses nothing. An elastic scene has no terms: nothing here
is then evaluated. Source: `bem.materials`; paper, Eq. (displacement), whose history sum is replaced.
"""

from typing import NamedTuple

import numpy as np

from bem._jit import kernel
from bem.materials import recursion_step


class Memory(NamedTuple):
    """State of the hereditary part; m terms on a grid of N nodes (N = 0 when there is no term)."""

    strengths: np.ndarray  # (m,) c_i
    times: np.ndarray  # (m,) tau_i
    vectors: np.ndarray  # (m, N) q_i
    traction: np.ndarray  # (N,) at the end of the last step
    earlier: np.ndarray  # (N,) one step before
    last_step: np.ndarray  # (1,) its length; 0 when `earlier` must not be used


class StepFactors(NamedTuple):
    """How memory and new traction enter over one step; arrays (m,)."""

    decay: np.ndarray
    gain: np.ndarray
    bend: np.ndarray
    response: float


@kernel
def new_memory(strengths: np.ndarray, times: np.ndarray, grid_size: int) -> Memory:
    """A relaxed half-space that has never felt a traction."""
    terms = strengths.size
    size = grid_size if terms > 0 else 0
    return Memory(strengths, times, np.zeros((terms, size)), np.zeros(size), np.zeros(size), np.zeros(1))


@kernel
def step_factors(memory: Memory, step: float, curved: bool) -> StepFactors:
    """Decay e, gain phi and bend psi of each term over a `step`; `curved` asks for the parabola where one is known."""
    terms = memory.times.size
    decay, gain, bend = np.empty(terms), np.empty(terms), np.zeros(terms)
    response = 1.0
    previous = memory.last_step[0]
    for i in range(terms):
        tau = memory.times[i]
        decay[i], gain[i] = recursion_step(step, tau)
        if curved and previous > 0.0:
            x = step / tau
            # int_0^h exp(-(h - s)/tau) (2 s - h) ds, by series where the closed form cancels
            if x > 0.05:
                integral = tau * step * (1.0 + decay[i]) - 2.0 * tau * tau * (1.0 - decay[i])
            else:
                integral = step * step * x / 6.0 * (1.0 - x / 2.0 + 3.0 * x * x / 20.0 - x * x * x / 30.0)
            bend[i] = integral / (step + previous)
        response -= memory.strengths[i] * (gain[i] + bend[i] / step)
    return StepFactors(decay, gain, bend, response)


@kernel
def remembered_traction(memory: Memory, factors: StepFactors, step: float) -> np.ndarray:
    """The part of sigma - sum_i c_i q_i at the end of the step that is known before it; (N,)."""
    known = np.zeros(memory.traction.size)
    previous = memory.last_step[0]
    for i in range(memory.strengths.size):
        c, e, phi, psi = memory.strengths[i], factors.decay[i], factors.gain[i], factors.bend[i]
        vector = memory.vectors[i]
        if psi > 0.0:
            now = c * (phi + psi / step + psi / previous)
            before = c * psi / previous
            for j in range(known.size):
                known[j] += now * memory.traction[j] - before * memory.earlier[j] - c * e * vector[j]
        else:
            for j in range(known.size):
                known[j] += c * (phi * memory.traction[j] - e * vector[j])
    return known


@kernel
def advance(memory: Memory, factors: StepFactors, step: float, traction: np.ndarray) -> None:
    """Carry the memory to the end of an accepted step with the new `traction` (N,) there."""
    previous = memory.last_step[0]
    for i in range(memory.strengths.size):
        e, phi, psi = factors.decay[i], factors.gain[i], factors.bend[i]
        vector = memory.vectors[i]
        for j in range(traction.size):
            change = traction[j] - memory.traction[j]
            value = e * vector[j] + phi * change
            if psi > 0.0:
                value += psi * (change / step - (memory.traction[j] - memory.earlier[j]) / previous)
            vector[j] = value
    memory.earlier[:] = memory.traction
    memory.traction[:] = traction
    memory.last_step[0] = step


@kernel
def forget_rate(memory: Memory) -> None:
    """At a corner of the protocol or a jump the traction's rate changes suddenly: the next step starts linear."""
    memory.last_step[0] = 0.0
