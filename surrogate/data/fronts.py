"""Small networks that place the jumps of a curve: where the contact snaps in, and where it lets go.

A jump moves over the steps from contact to contact, and outputs of fixed steps learn it badly. A front is evaluated at
each of its steps: it reads a few units that the hidden layers of a stage give it, and where the step lies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

UNITS = 32
"""Units of both layers of a front."""
PLACE = 3
"""Coordinates of a step."""
_BEYOND = 0.02  # added to the travel beyond the pull-off, in h0, before its logarithm


def front_steps(counts: Sequence[int]) -> tuple[slice, slice]:
    """Steps of the two fronts: the loading but its first step, and the last steps of the unloading, from the pull-off.

    Args:
        counts: Points of loading, dwell and unloading.
    """
    return slice(1, counts[0]), slice(sum(counts) - round(0.36 * counts[2]), sum(counts))


def places(
    times: np.ndarray,
    indentations: np.ndarray,
    tabor: np.ndarray,
    unloading_rate: np.ndarray,
    pull_off_time: np.ndarray,
    steps: slice,
) -> np.ndarray:
    """Where steps lie, float32 (batch, steps, PLACE).

    They are the indentation on two scales, of h0 and of the Tabor parameter, and the travel beyond the pull-off.

    Args:
        times, indentations: Of all steps, shape (batch, all steps).
        tabor, unloading_rate, pull_off_time: Of each contact, shape (batch,).
        steps: Which steps are asked for.
    """
    depth = indentations[:, steps]
    share = depth / tabor[:, np.newaxis]
    beyond = (times[:, steps] - pull_off_time[:, np.newaxis]) * unloading_rate[:, np.newaxis]
    columns = np.arcsinh(depth), share / (1.0 + np.abs(share)), np.log(np.maximum(beyond, 0.0) + _BEYOND)
    return np.stack(columns, axis=-1).astype(np.float32)


@dataclass(frozen=True)
class Front:
    """Weights, float32: two layers of ReLU, of which the first adds hidden units of a stage and coordinates of steps.

    Args:
        hidden, bias: From the hidden units, shapes (hidden, units) and (units,).
        place: From the coordinates, shape (PLACE, units).
        second, second_bias: Of the second layer.
        out, out_bias: To the one output.
    """

    hidden: np.ndarray
    bias: np.ndarray
    place: np.ndarray
    second: np.ndarray
    second_bias: np.ndarray
    out: np.ndarray
    out_bias: np.ndarray

    def __call__(self, hidden: np.ndarray, place: np.ndarray) -> np.ndarray:
        """What is added to the outputs at its steps, (batch, steps), of hidden units (batch, hidden) and `places`."""
        units = place @ self.place
        units += (hidden @ self.hidden + self.bias)[:, np.newaxis]
        units = np.maximum(units, 0.0, out=units) @ self.second + self.second_bias
        return (np.maximum(units, 0.0, out=units) @ self.out)[..., 0] + self.out_bias

    def as_arrays(self, name: str) -> dict[str, np.ndarray]:
        """What to store, under names that begin with that of the front."""
        return {f"{name}/{key}": values for key, values in vars(self).items()}
