"""Memory of a viscoelastic half-space: one vector per retardation time, independent of the length of the history.

With q_i(t) = int exp(-(t - s)/tau_i) dsigma(s) the displacement is u = mu G (sigma - sum_i c_i q_i), sigma positive in
tension. Over a step every rule below has the form

    q_new = sum_k a_k q_(n-k) + g sigma_new + sum_k b_k sigma_(n-k),     k = 0, 1, 2 steps back,

so the new traction enters with one factor only, `response` = 1 - sum_i c_i g_i, between the modulus ratio and 1.

- First step after a corner of the protocol or a jump: traction linear over the step, integrated exactly
  (`bem.problem.materials`, second order).
- Steps up to a few of the shortest relaxation time: traction a parabola through its last two values and the new one,
  integrated exactly (third order).
- Longer steps: backward differentiation of q' = sigma' - q/tau over three steps (third order), or two where the step
  grew fast. Where surfaces conform, the displacement is imposed and the traction relaxes with the short relaxation time
  k tau; the other two rules, equivalent to Crank-Nicolson and Adams-Moulton, oscillate there, this one damps (Hairer
  and Wanner, Solving Ordinary Differential Equations II, 1996, sections IV.3 and V.1).

The vectors live on the master grid (see `bem.methods.boundary_elements.meshes.master_grid`), so a new choice of nodes
loses nothing, and are carried over where that grid moves or becomes finer. An elastic scene has no terms: nothing here
is then evaluated. Source: `bem.problem.materials`; paper, Eq. (displacement), whose history sum is replaced.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.linear_algebra import copy_into
from bem.methods.boundary_elements.meshes.master_grid import Grid
from bem.methods.boundary_elements.meshes.mesh import prolong
from bem.methods.boundary_elements.meshes.regrid import Remembered, carry, same_grid
from bem.methods.boundary_elements.state import State
from bem.problem.materials import recursion_step

DEPTH = 3  # states kept
_LONGEST_PARABOLA = 4.0  # in shortest relaxation times; the rule oscillates beyond about 6
_FASTEST_GROWTH = 1.5  # of the step, for which backward differentiation over three steps is stable


class Memory(NamedTuple):
    """State of the hereditary part; m terms on a grid of N nodes (N = 0 when there is no term). Newest first."""

    strengths: np.ndarray  # (m,) c_i
    times: np.ndarray  # (m,) tau_i
    vectors: np.ndarray  # (DEPTH, m, N) q_i at the ends of the last steps
    traction: np.ndarray  # (DEPTH, N) sigma there
    steps: np.ndarray  # (DEPTH - 1,) lengths of the last steps; 0 where what lies before must not be used


class StepFactors(NamedTuple):
    """The rule of one step, for each term."""

    vector: np.ndarray  # (DEPTH, m) a_k
    traction: np.ndarray  # (DEPTH, m) b_k
    new_traction: np.ndarray  # (m,) g
    response: float


@kernel
def new_memory(strengths: np.ndarray, times: np.ndarray, grid_size: int) -> Memory:
    """Return the memory of a relaxed half-space without traction."""
    terms = strengths.size
    size = grid_size if terms > 0 else 0
    vectors = np.zeros((DEPTH, terms, size))
    return Memory(strengths, times, vectors, np.zeros((DEPTH, size)), np.zeros(DEPTH - 1))


@kernel
def memory_on(memory: Memory, old: Grid, new: Grid) -> Memory:
    """The memory of the grid `old` on the grid `new`."""
    if same_grid(new, old):
        return memory
    moved = new_memory(memory.strengths, memory.times, new.size)
    copy_into(moved.steps, memory.steps)
    if memory.strengths.size > 0:
        for k in range(DEPTH):
            carry(old, memory.traction[k], new, moved.traction[k])
            for i in range(memory.strengths.size):
                carry(old, memory.vectors[k, i], new, moved.vectors[k, i])
    return moved


@kernel
def shortest_relaxation(strengths: np.ndarray, times: np.ndarray) -> float:
    """Time in which the traction under an imposed displacement relaxes first, tau_1 k / (k + c_1); inf when elastic."""
    if strengths.size == 0:
        return np.inf
    first = np.argmin(times)
    glassy = 1.0 - np.sum(strengths)
    return times[first] * glassy / (glassy + strengths[first])


@kernel
def step_factors(memory: Memory, step: float, with_earlier: bool) -> StepFactors:
    """The rule for a `step`; `with_earlier` allows those that use states before the last one."""
    terms = memory.times.size
    vector, traction = np.zeros((DEPTH, terms)), np.zeros((DEPTH, terms))
    new = np.empty(terms)
    previous = memory.steps[0]
    usable = with_earlier and previous > 0.0
    parabola = step <= _LONGEST_PARABOLA * shortest_relaxation(memory.strengths, memory.times)
    slopes = _backward_slopes(step, memory.steps) if usable and not parabola else np.zeros(DEPTH + 1)
    response = 1.0
    for i in range(terms):
        tau = memory.times[i]
        if usable and not parabola:
            scale = 1.0 / (slopes[0] + 1.0 / tau)
            new[i] = slopes[0] * scale
            for k in range(DEPTH):
                vector[k, i] = -slopes[k + 1] * scale
                traction[k, i] = slopes[k + 1] * scale
        else:
            decay, gain = recursion_step(step, tau)
            bend = _bend(step, tau) / (step + previous) if usable else 0.0
            vector[0, i] = decay
            new[i] = gain + bend / step
            traction[0, i] = -new[i]
            if usable:
                traction[0, i] -= bend / previous
                traction[1, i] = bend / previous
        response -= memory.strengths[i] * new[i]
    return StepFactors(vector, traction, new, response)


@kernel
def _backward_slopes(step: float, steps: np.ndarray) -> np.ndarray:
    """Weights of the newest value and the last three in the slope at the newest, from the polynomial through them."""
    points = 4 if steps[1] > 0.0 and max(step / steps[0], steps[0] / steps[1]) <= _FASTEST_GROWTH else 3
    ago = np.array([0.0, step, step + steps[0], step + steps[0] + steps[1]])
    weights = np.zeros(DEPTH + 1)
    for k in range(1, points):
        weight = 1.0 / ago[k]
        for m in range(1, points):
            if m != k:
                weight *= ago[m] / (ago[m] - ago[k])
        weights[k] = -weight
        weights[0] += weight
    return weights


@kernel
def _bend(step: float, tau: float) -> float:
    """Integral over (0, h) of exp(-(h - s)/tau) (2 s - h) ds, by series where the closed form cancels."""
    x = step / tau
    if x > 0.05:
        decay = np.exp(-x)
        return tau * step * (1.0 + decay) - 2.0 * tau * tau * (1.0 - decay)
    return step * step * x / 6.0 * (1.0 - x / 2.0 + 3.0 * x * x / 20.0 - x * x * x / 30.0)


@kernel
def remembered_in(memory: Memory, factors: StepFactors) -> Remembered:
    """What is known before a step of sigma - sum_i c_i q_i at its end."""
    total = np.zeros(memory.traction.shape[1])
    for i in range(memory.strengths.size):
        for k in range(DEPTH):
            a, b = memory.strengths[i] * factors.vector[k, i], memory.strengths[i] * factors.traction[k, i]
            if a != 0.0 or b != 0.0:
                vector, traction = memory.vectors[k, i], memory.traction[k]
                for j in range(total.size):
                    total[j] -= a * vector[j] + b * traction[j]
    return Remembered(total, factors.response)


@kernel
def remember_start(memory: Memory, state: State, glassy: bool) -> None:
    """Set the memory to a state that has lasted for ever or, if `glassy`, begins at this instant."""
    if memory.strengths.size > 0:
        prolong(state.mesh, state.traction, memory.traction[0])
        if glassy:
            for i in range(memory.strengths.size):
                copy_into(memory.vectors[0, i], memory.traction[0])


@kernel
def remember(memory: Memory, factors: StepFactors, step: float, state: State) -> None:
    """Carry the memory to the end of an accepted step, which ends in `state`."""
    if memory.strengths.size > 0:
        on_grid = np.empty(memory.traction.shape[1])
        prolong(state.mesh, state.traction, on_grid)
        advance(memory, factors, step, on_grid)


@kernel
def advance(memory: Memory, factors: StepFactors, step: float, new_traction: np.ndarray) -> None:
    """Carry the memory to the end of an accepted step with the traction (N,) there."""
    vectors, traction = memory.vectors, memory.traction
    for i in range(memory.strengths.size):
        a0, a1, a2 = factors.vector[0, i], factors.vector[1, i], factors.vector[2, i]
        b0, b1, b2 = factors.traction[0, i], factors.traction[1, i], factors.traction[2, i]
        g = factors.new_traction[i]
        for j in range(new_traction.size):
            value = g * new_traction[j] + a0 * vectors[0, i, j] + b0 * traction[0, j]
            value += a1 * vectors[1, i, j] + b1 * traction[1, j] + a2 * vectors[2, i, j] + b2 * traction[2, j]
            vectors[2, i, j] = vectors[1, i, j]
            vectors[1, i, j] = vectors[0, i, j]
            vectors[0, i, j] = value
    copy_into(traction[2], traction[1])
    copy_into(traction[1], traction[0])
    copy_into(traction[0], new_traction)
    memory.steps[1] = memory.steps[0]
    memory.steps[0] = step


@kernel
def forget_rate(memory: Memory) -> None:
    """Exclude earlier steps from the next one, because the rate changes suddenly at a corner or a jump."""
    memory.steps[:] = 0.0
