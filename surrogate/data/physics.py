"""Channels that a standard linear solid's physics gives for nothing: no contact with adhesion is solved for them.

With u the force of Hertz at the indentation of each instant and relaxation E(t)/E0 = 1 + (1/k - 1) exp(-t / k), k the
modulus ratio and the retardation time 1:

- `lee_radok`: integral of E(t - s)/E0 du(s), exact without adhesion while the contact grows. Its memory is carried on
  through the unloading, where it turns to tension shortly before the pull-off;
- `hertz`: u itself, the force when all is relaxed;
- `memory_relaxation`, `memory_retardation`: integral of exp(-(t - s) / T) d(indentation), the indentation less what the
  solid has forgotten, for the relaxation time T = k and the retardation time T = 1.

Everything is causal, and linear between the given instants. Units as in `surrogate.data.features`. Source: Lee and
Radok, J. Appl. Mech. 27 (1960) 438.
"""

from __future__ import annotations

import numpy as np

from bem._support.jit import kernel


@kernel
def physics_channels(
    times: np.ndarray, indentations: np.ndarray, tabor: np.ndarray, modulus_ratio: np.ndarray
) -> np.ndarray:
    """The channels above in their order, shape (4, batch, steps); forces are positive in tension.

    Args:
        times: Instants of shape (batch, steps), increasing along the steps.
        indentations: Indentations there.
        tabor: Tabor parameters, shape (batch,).
        modulus_ratio: Relaxed over instantaneous modulus of each solid, shape (batch,).

    Returns:
        Array of shape (4, batch, steps).
    """
    batch, steps = times.shape
    found = np.empty((4, batch, steps))
    for row in range(batch):
        ratio = modulus_ratio[row]
        size = -4.0 / (3.0 * np.pi) * tabor[row] ** -1.5
        strength = 1.0 / ratio - 1.0
        memory, fast, slow, before = 0.0, 0.0, 0.0, 0.0
        for step in range(steps):
            indentation = indentations[row, step]
            hertz = size * indentation * np.sqrt(indentation) if indentation > 0.0 else 0.0
            if step == 0:
                memory = hertz
            else:
                dt = times[row, step] - times[row, step - 1]
                change = indentation - indentations[row, step - 1]
                lost, forgotten = -np.expm1(-dt / ratio), -np.expm1(-dt)
                memory += lost / (dt / ratio) * (hertz - before) - lost * memory
                fast += lost / (dt / ratio) * change - lost * fast
                slow += forgotten / dt * change - forgotten * slow
            before = hertz
            found[0, row, step] = hertz + strength * memory
            found[1, row, step] = hertz
            found[2, row, step] = fast
            found[3, row, step] = slow
    return found
