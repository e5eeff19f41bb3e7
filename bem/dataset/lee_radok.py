"""The force of Lee and Radok without adhesion along a protocol, for any linear solid.

With u the indentation to the power 3/2 and relaxation E(t)/E0 = 1 + sum_j g_j exp(-t / x_j), the force is
u + sum_j g_j m_j with one memory m_j = int exp(-(t - s) / x_j) du(s) for each relaxation time, in units of the relaxed
Hertz force at indentation 1. It is exact while the contact grows; its memory is carried on through the unloading, where
it crosses zero shortly before the pull-off. Units as in `bem.problem.protocol`. Source: Lee and Radok, J. Appl. Mech.
27 (1960) 438; the relaxation spectrum as in `bem.problem.materials.relaxation_spectrum`.
"""

import numpy as np

from bem._support.jit import kernel

# Where the force is computed, as shares of a phase: even in the logarithm, because the fastest relaxation may be far
# faster than the dwell; in the unloading, from fine steps to even ones.
LOADING = np.linspace(0.0, 1.0, 41)
DWELL = np.append(0.0, np.exp(np.linspace(-12.0, 0.0, 40)))
UNLOADING = np.sinh(np.linspace(0.0, 6.0, 81)) / np.sinh(6.0)
_BISECTIONS = 64
_NEAREST = 1e-25  # distance of a root from a retardation time, in units of half the interval between two


@kernel
def hertz_power(indentation: float) -> float:
    """The indentation to the power 3/2 in contact, otherwise zero."""
    return indentation * np.sqrt(indentation) if indentation > 0.0 else 0.0


@kernel
def carried(memory: float, rate: float, dt: float, change: float) -> float:
    """A memory int exp(-r (t - s)) du(s) after a step in which u changes linearly: the recursion of all memories."""
    lost = -np.expm1(-rate * dt)
    return memory + (lost / (rate * dt) * change - lost * memory)


@kernel
def _balance(end: float, distance: float, strengths: np.ndarray, times: np.ndarray) -> float:
    """What is zero at a relaxation time, 1 - sum_i c_i tau_i / (tau_i - x), at a `distance` from one of the `tau_i`."""
    balance = 1.0
    for i in range(strengths.size):
        if strengths[i] > 0.0:
            balance -= strengths[i] * times[i] / ((times[i] - end) - distance)
    return balance


@kernel
def relaxation_spectra(strengths: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Relaxation strengths and times of many solids, (B, m) each; 0 and 1 where a retardation strength is zero.

    Args:
        strengths: retardation strengths, shape (B, m), some of them zero.
        times: retardation times, shape (B, m), increasing where the strengths are not zero.
    """
    moduli, relaxations = np.zeros(strengths.shape), np.ones(strengths.shape)
    for row in range(len(strengths)):
        strength, time = strengths[row], times[row]
        below = 0.0
        for j in range(strength.size):
            if strength[j] == 0.0:
                continue
            half = 0.5 * (time[j] - below)
            # Its distance from the nearer end decides how many digits the root has.
            low = _balance(below, half, strength, time) < 0.0
            end, sign = (below, 1.0) if low else (time[j], -1.0)
            near, far = np.log(_NEAREST * half), np.log(half)
            for _ in range(_BISECTIONS):
                middle = 0.5 * (near + far)
                if (_balance(end, sign * np.exp(middle), strength, time) > 0.0) == low:
                    near = middle
                else:
                    far = middle
            distance = sign * np.exp(0.5 * (near + far))
            total = 0.0
            for i in range(strength.size):
                if strength[i] > 0.0:
                    total += strength[i] * time[i] / ((time[i] - end) - distance) ** 2
            relaxations[row, j] = end + distance
            moduli[row, j] = 1.0 / (total * (end + distance))
            below = time[j]
    return moduli, relaxations


@kernel
def held_to_unloading(
    peak: float, up: float, dwelt: float, moduli: np.ndarray, times: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float, float]:
    """Loading from contact, and dwell.

    Returns:
        the memories (m,) at the end of the dwell, instants of the dwell and forces there (41,), the force at the peak,
        and the work of loading.
    """
    memory, work, last, peak_force = np.zeros(moduli.size), 0.0, 0.0, 0.0
    for i in range(1, LOADING.size):
        high, low = peak * LOADING[i], peak * LOADING[i - 1]
        peak_force = hertz_power(high)
        for j in range(moduli.size):
            if moduli[j] > 0.0:
                change = hertz_power(high) - hertz_power(low)
                memory[j] = carried(memory[j], 1.0 / times[j], (high - low) / up, change)
                peak_force += moduli[j] * memory[j]
        work += 0.5 * (peak_force + last) * (high - low)
        last = peak_force
    instants, forces = dwelt * DWELL, np.full(DWELL.size, peak_force)
    if dwelt > 0.0:
        for i in range(1, DWELL.size):
            forces[i] = hertz_power(peak)
            for j in range(moduli.size):
                if moduli[j] > 0.0:
                    memory[j] = carried(memory[j], 1.0 / times[j], instants[i] - instants[i - 1], 0.0)
                    forces[i] += moduli[j] * memory[j]
    return memory, instants, forces, peak_force, work


@kernel
def to_crossing(
    peak: float, down: float, moduli: np.ndarray, times: np.ndarray, memory: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Unloading until the force vanishes, or until the indentation does; carries the `memory` (m,) there.

    Returns:
        travels from the peak (n,), the last one that to the crossing, forces there (n,), and slopes of the force in the
        indentation at the crossing and at the peak.
    """
    travels, forces = peak * UNLOADING, np.zeros(UNLOADING.size)
    before, stiffness = memory.copy(), 1.0 + np.sum(moduli)
    slope = 0.0
    first = 0.0
    for i in range(UNLOADING.size):
        left = max(peak - travels[i], 0.0)
        before[:] = memory
        forces[i] = hertz_power(left)
        steepness = slope
        slope = 1.5 * np.sqrt(left) * stiffness
        for j in range(moduli.size):
            if moduli[j] > 0.0:
                if i > 0:
                    change = hertz_power(left) - hertz_power(peak - travels[i - 1])
                    memory[j] = carried(memory[j], 1.0 / times[j], (travels[i] - travels[i - 1]) / down, change)
                forces[i] += moduli[j] * memory[j]
                slope += moduli[j] * memory[j] / times[j] / down
        if i == 0:
            first = slope
        elif forces[i] <= 0.0:
            share = forces[i - 1] / (forces[i - 1] - forces[i])
            travels[i] = travels[i - 1] + share * (travels[i] - travels[i - 1])
            forces[i] = 0.0
            change = hertz_power(peak - travels[i]) - hertz_power(peak - travels[i - 1])
            for j in range(moduli.size):
                if moduli[j] > 0.0:
                    memory[j] = carried(before[j], 1.0 / times[j], (travels[i] - travels[i - 1]) / down, change)
            return travels[: i + 1], forces[: i + 1], steepness + share * (slope - steepness), first
    return travels, forces, slope, first
