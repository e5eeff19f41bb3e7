"""The gap where surfaces press on each other, from the traction: the law inverted on its steep branch."""

import numpy as np

from bem._support.jit import kernel
from bem.problem.tractions import GAP_AT_PEAK, PEAK_TRACTION, Law, slope_at, traction_at

PRESSED = 1.08  # below this gap (in h0) the traction is the unknown; other laws scale its distance from 1
LARGEST_TENSION = 0.9 * PEAK_TRACTION  # of a node whose unknown is the traction


@kernel
def pressed_below(law: Law) -> float:
    """Gap below which the traction is the unknown."""
    return 1.0 + (PRESSED - 1.0) * law.rise


@kernel
def pressed_gap(scaled_traction: float, guess: float) -> float:
    """Gap on the steep branch h < 3^(1/6) with Lennard-Jones traction `scaled_traction` (in dgamma/h0).

    Newton's method from a nearby `guess`.
    """
    c = 0.375 * scaled_traction
    z = max(1.0 / (guess * guess * guess), 0.65)
    if c < -1.0:
        z = max(z, np.cbrt(-c))
    for _ in range(40):
        change = (z - z * z * z - c) / (3.0 * z * z - 1.0)
        z = max(z + change, 0.6)
        if abs(change) <= 1e-8 * z:  # quadratic convergence: the next change would be below rounding
            break
    return 1.0 / np.cbrt(z)


@kernel
def pressed_gap_of(law: Law, scaled_traction: float, guess: float) -> float:
    """`pressed_gap` of any law; tension counts up to `LARGEST_TENSION`."""
    if not law.tabulated:
        return pressed_gap(scaled_traction, guess)
    capped, joint = min(scaled_traction, LARGEST_TENSION), law.numbers[0, 0]
    if capped <= traction_at(law, joint):
        unit = law.numbers[0, 2]
        near = max(1.0 + (min(guess, joint) - 1.0) / unit, 0.3)
        return 1.0 + unit * (pressed_gap(capped / law.numbers[0, 1], near) - 1.0)
    gap = joint  # the traction rises ever more slowly, so that Newton's method comes from below
    for _ in range(40):
        change = (capped - traction_at(law, gap)) / slope_at(law, gap)
        gap = min(gap + change, law.peak_gap)
        if abs(change) <= 1e-10:
            break
    return gap


@kernel
def pressed_gaps(scaled: np.ndarray, count: int, guess: np.ndarray, law: Law, out: np.ndarray) -> None:
    """`pressed_gap` of the first `count` nodes at once, from `guess` (n,) near the answer, into `out` (n,).

    Two steps of Newton's method for z = 1/h^3 and three for its cube root, without a branch, so that the compiler
    vectorises them; a node that they do not settle is solved by itself. Tension counts up to `LARGEST_TENSION`.
    """
    if law.tabulated:
        for j in range(count):
            out[j] = pressed_gap_of(law, scaled[j], guess[j])
        return
    for j in range(count):
        near = guess[j]
        c = 0.375 * scaled[j]
        z = max(1.0 / (near * near * near), 0.65)
        z = max(z + (z - z * z * z - c) / (3.0 * z * z - 1.0), 0.6)
        change = (z - z * z * z - c) / (3.0 * z * z - 1.0)
        z = max(z + change, 0.6)
        h = near * (4.0 - z * near * near * near) * (1.0 / 3.0)
        h = h * (4.0 - z * h * h * h) * (1.0 / 3.0)
        miss = 1.0 - z * h * h * h
        h = h * (1.0 + miss * (1.0 / 3.0))
        out[j] = h if abs(change) + abs(miss) < 1e-4 else -1.0
    for j in range(count):
        if not out[j] > 0.0:
            out[j] = pressed_gap(min(scaled[j], LARGEST_TENSION), guess[j])


@kernel
def changed_gap(law: Law, gap: float, scaled_traction: float, pressed: float) -> float:
    """The gap of a node whose traction is to become `scaled_traction`, on the scale on which the law rises.

    `pressed` is the gap of that traction. A node that tension takes off the steep branch moves outwards a little.
    """
    scaled, moved = 1.0 + (gap - 1.0) / law.rise, pressed
    if scaled_traction > LARGEST_TENSION:
        scaled = min(max(scaled, 1.0) * 1.08, 1.15) if scaled < 1.1 else scaled * 1.05
        moved = 1.0 + law.rise * (scaled - 1.0)
    elif scaled >= 0.98 * GAP_AT_PEAK:
        moved = 1.0 + law.rise * (0.95 * scaled - 1.0)
    return moved
