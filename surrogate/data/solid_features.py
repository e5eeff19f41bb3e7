"""Features of a contact with any linear solid: what that very solid does along the protocol.

A list of retardation terms tells a network little. What decides the pull-off is the compliance on the crack's own time
scale, x / unloading rate for lengths x of the order of h0, and the state of the memory when the force of Lee and Radok
without adhesion crosses zero (`bem.dataset.lee_radok`). `FEATURES` names the columns; all are logarithms or the like,
of quantities in the units of `bem.problem.protocol`. None depends on the unit of time: a solid of many retardation
times has none of its own.
"""

from __future__ import annotations

import numpy as np

from bem._support.jit import kernel
from bem.dataset.lee_radok import carried, held_to_unloading, hertz_power, relaxation_spectra, to_crossing
from bem.problem.protocol import default_start_indentation

CRACK = np.logspace(-2.0, 2.0, 9)
"""Lengths in h0 whose time at the unloading rate the compliance is taken at."""
LOADED = np.logspace(-2.0, 2.0, 5)
"""The same for the loading rate."""
RECOVERED = np.logspace(-1.5, 1.5, 7)
"""Lengths in h0 in whose time at the unloading rate a contact held at the crossing would regain force."""
BEYOND = np.array([0.3, 1.0, 3.0, 10.0, 30.0])
"""Offsets below the crossing, in h0, at which the force without adhesion is carried on."""
PROTOCOL = ("tabor", "peak_indentation", "loading_rate", "dwell_time", "unloading_rate")
FEATURES = (
    *("tabor", "peak_indentation", "rate_ratio", "dwell_travel"),
    *("modulus_ratio", "peak_force", "held_force", "travel_to_crossing", "travel_after_crossing", "crossing_slope"),
    *("work", "crossing", "relaxation_at_crossing", "half_force"),
    *("compliance_since_turn", "compliance_since_dwell", "compliance_since_loading"),
    *(f"unloading_compliance_{number}" for number in range(CRACK.size)),
    *(f"loading_compliance_{number}" for number in range(LOADED.size)),
    *(f"recovery_{number}" for number in range(RECOVERED.size)),
    *(f"beyond_{number}" for number in range(BEYOND.size)),
)
"""Names of the columns that `solid_features` returns."""
PLAIN = 5
"""How many of the first are the logarithms of quantities that a user gives, or of their ratios."""
_TINY = 1e-9


@kernel
def _creep(strengths: np.ndarray, times: np.ndarray, time: float) -> float:
    """Creep compliance E0 C(t)."""
    compliance = 1.0
    for j in range(strengths.size):
        compliance -= strengths[j] * np.exp(-time / times[j])
    return max(compliance, _TINY)


def solid_features(
    protocols: dict[str, np.ndarray],
    strengths: np.ndarray,
    times: np.ndarray,
    spectra: tuple[np.ndarray, np.ndarray] | None = None,
) -> np.ndarray:
    """Features of many contacts, shape (batch, len(FEATURES)).

    Args:
        protocols: The quantities in `PROTOCOL` by name, each of shape (batch,).
        strengths, times: Retardation terms of each solid, shape (batch, terms); those of strength zero are left out.
        spectra: What `relaxation_spectra` says of them, where that is known.
    """
    columns = np.stack([np.asarray(protocols[name], dtype=np.float64) for name in PROTOCOL])
    start = default_start_indentation(columns[0])
    return _features(columns, start, strengths, times, *(spectra or relaxation_spectra(strengths, times)))


@kernel
def _features(
    protocols: np.ndarray,
    starts: np.ndarray,
    strengths: np.ndarray,
    times: np.ndarray,
    moduli: np.ndarray,
    relaxations: np.ndarray,
) -> np.ndarray:
    """See `solid_features`; relaxation strengths and times as of `relaxation_spectra`."""
    batch = protocols.shape[1]
    features = np.empty((batch, len(FEATURES)))
    for row in range(batch):
        _, peak, up, dwelt, down = protocols[:, row]
        strength, time, modulus, relaxation = strengths[row], times[row], moduli[row], relaxations[row]
        memory, _, held, peak_force, work = held_to_unloading(peak, up, dwelt, modulus, relaxation)
        travels, forces, slope, _ = to_crossing(peak, down, modulus, relaxation, memory)
        travel, whole = travels[-1], hertz_power(peak)
        crossing = peak - travel
        for i in range(1, travels.size):
            work -= 0.5 * (forces[i] + forces[i - 1]) * (travels[i] - travels[i - 1])
        half = 1
        while forces[half] > 0.5 * forces[0]:
            half += 1
        share = (forces[half - 1] - 0.5 * forces[0]) / (forces[half - 1] - forces[half])
        since = travel / down
        relaxed = 1.0
        for j in range(modulus.size):
            relaxed += modulus[j] * np.exp(-since / relaxation[j])
        values = features[row]
        values[0], values[1] = np.log(protocols[0, row]), np.log(peak)
        values[2], values[3] = np.log(up / down), np.log(dwelt * down)
        values[4] = np.log(_creep(strength, time, 0.0))
        values[5], values[6] = np.log(peak_force / whole), np.log(held[-1] / whole)
        values[7], values[8] = np.log(travel / peak), np.log(crossing - starts[row])
        values[9] = np.log(max(slope, 0.0) + 0.3)
        values[10] = np.log(max(work, _TINY) + 1e-3 * whole * peak)
        values[11], values[12] = np.log(crossing + 0.3), np.log(relaxed)
        values[13] = np.log((travels[half - 1] + share * (travels[half] - travels[half - 1])) / peak + 1e-3)
        values[14] = np.log(_creep(strength, time, since))
        values[15] = np.log(_creep(strength, time, since + dwelt))
        values[16] = np.log(_creep(strength, time, since + dwelt + peak / up))
        column = 17
        for length in CRACK:
            values[column] = np.log(_creep(strength, time, length / down))
            column += 1
        for length in LOADED:
            values[column] = np.log(_creep(strength, time, length / up))
            column += 1
        for length in RECOVERED:
            regained = 0.0
            for j in range(modulus.size):
                regained += modulus[j] * memory[j] * np.expm1(-length / down / relaxation[j])
            values[column] = np.log(max(regained, 0.0) + 1e-2)
            column += 1
        for offset in BEYOND:
            values[column] = np.arcsinh(_carried_on(crossing, offset, down, modulus, relaxation, memory))
            column += 1
    return features


@kernel
def _carried_on(
    crossing: float, offset: float, down: float, moduli: np.ndarray, relaxations: np.ndarray, memory: np.ndarray
) -> float:
    """Force without adhesion at an offset below the crossing, where it is a tension; it has left contact at 0."""
    force, pieces = hertz_power(crossing - offset), 4
    depth = min(offset, crossing)
    for j in range(moduli.size):
        kept = memory[j]
        if moduli[j] == 0.0:
            continue
        for piece in range(pieces if depth > 0.0 else 0):
            high, low = crossing - depth * piece / pieces, crossing - depth * (piece + 1) / pieces
            change = hertz_power(low) - hertz_power(high)
            kept = carried(kept, 1.0 / relaxations[j], (high - low) / down, change)
        force += moduli[j] * kept * np.exp(-(offset - depth) / down / relaxations[j])
    return force


@kernel
def forces_without_adhesion(
    times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, moduli: np.ndarray, relaxations: np.ndarray
) -> np.ndarray:
    """Force of Lee and Radok, in pi R dgamma and positive in tension, at steps (batch, steps); zero once it crosses.

    Between steps the indentation to the power 3/2 is taken to be linear in time.
    """
    forces = np.zeros(times.shape)
    for row in range(len(times)):
        unit = -4.0 / (3.0 * np.pi) * tabor[row] ** -1.5
        memory = np.zeros(moduli.shape[1])
        for i in range(1, times.shape[1]):
            here, before = hertz_power(indentations[row, i]), hertz_power(indentations[row, i - 1])
            total = here
            for j in range(memory.size):
                if moduli[row, j] > 0.0:
                    step = times[row, i] - times[row, i - 1]
                    memory[j] = carried(memory[j], 1.0 / relaxations[row, j], step, here - before)
                    total += moduli[row, j] * memory[j]
            forces[row, i] = unit * max(total, 0.0)
    return forces
