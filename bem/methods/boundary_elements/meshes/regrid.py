"""The memory carried from one grid to the next (`bem.methods.boundary_elements.meshes.master_grid`).

From an equally spaced grid to one of half the spacing, cubics through four nodes give the values between the old ones.
Moving grids lie on one lattice: a node of both keeps its value. A new node gets the cubic through the four old nodes
around it, limited to the values of the two next to it: linear fields are exact, and nothing rises beyond its
neighbours. A node that is left out hands on what it differs from the cubic through those that remain, so that the
force, the integral of sigma r dr, is conserved: the surface far away does not feel the change.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem.methods.boundary_elements.meshes.master_grid import Grid, moves


class Remembered(NamedTuple):
    """What the material contributes to a step."""

    traction: np.ndarray  # (N,): the part of sigma - sum_i c_i q_i that is known before it; (0,) without a memory
    response: float  # factor of the new traction, between the modulus ratio and 1


@kernel
def same_grid(first: Grid, second: Grid) -> bool:
    """Whether two grids of one scene have the same nodes."""
    return first.spacing == second.spacing and (not moves(first) or np.array_equal(first.places, second.places))


@kernel
def carried(remembered: Remembered, old: Grid, new: Grid) -> Remembered:
    """What is remembered, on another grid."""
    if remembered.traction.size == 0 or same_grid(new, old):
        return remembered
    moved = np.empty(new.size)
    carry(old, remembered.traction, new, moved)
    return Remembered(moved, remembered.response)


@kernel
def carry(old: Grid, values: np.ndarray, new: Grid, out: np.ndarray) -> None:
    """Carry `values` (N,) from one moving grid to another, or to half of an equal spacing, into `out` (M,)."""
    if moves(new):
        regrid(old.places, values, new.places, out)
        return
    last = values.size - 1
    for j in range(values.size):
        out[2 * j] = values[j]
        if j < last:
            outer = values[abs(j - 1)] + values[min(j + 2, last)]  # even at the axis
            out[2 * j + 1] = (9.0 * (values[j] + values[j + 1]) - outer) / 16.0


@kernel
def cubic(places: np.ndarray, values: np.ndarray, first: int, x: float) -> float:
    """Polynomial through the four nodes from `first` on, at x."""
    total = 0.0
    for a in range(first, first + 4):
        weight = 1.0
        for b in range(first, first + 4):
            if a != b:
                weight *= (x - places[b]) / (places[a] - places[b])
        total += weight * values[a]
    return total


@kernel
def regrid(places: np.ndarray, values: np.ndarray, new_places: np.ndarray, out: np.ndarray) -> None:
    """Carry `values` (N,) from `places` (N,) to `new_places` (M,), into `out` (M,); both begin and end alike."""
    f = 0
    for i in range(new_places.size):
        x = new_places[i]
        while f < places.size - 2 and places[f + 1] <= x:
            f += 1
        out[i] = 0.0
        if places[f] == x:
            out[i] = values[f]
        elif places[f + 1] == x:
            out[i] = values[f + 1]
        elif f == 0 or f + 2 >= places.size:
            share = (x - places[f]) / (places[f + 1] - places[f])
            out[i] = values[f] + share * (values[f + 1] - values[f])
        else:
            total = cubic(places, values, f - 1, float(x))
            out[i] = min(max(total, min(values[f], values[f + 1])), max(values[f], values[f + 1]))
    _distribute(places, values, new_places, out)


@kernel
def _distribute(places: np.ndarray, values: np.ndarray, new_places: np.ndarray, out: np.ndarray) -> None:
    """Add to `out` (M,) what the nodes left out carry beside the cubic through the new ones."""
    size = new_places.size
    change = np.zeros(size)
    f = 1
    for i in range(size - 1):
        a, b = float(new_places[i]), float(new_places[i + 1])
        while places[f] <= new_places[i]:
            f += 1
        # Between a and b the difference is a sum of hats over the old nodes there, which reach to their neighbours.
        total, moment = 0.0, 0.0
        left = a
        while places[f] < new_places[i + 1]:
            x = float(places[f])
            right = min(float(places[f + 1]), b)
            first = max(0, min(i - 1, size - 4))
            smooth = (
                cubic(new_places, out, first, x) if size > 3 else out[i] + (x - a) / (b - a) * (out[i + 1] - out[i])
            )
            weight = (values[f] - smooth) * _hat_weight(left, x, right)
            total += weight
            moment += weight * (x - a) / (b - a)
            left = x
            f += 1
        change[i] += total - moment
        change[i + 1] += moment
    for i in range(size):
        if change[i] != 0.0:
            left = float(new_places[max(i - 1, 0)])
            right = float(new_places[min(i + 1, size - 1)])
            out[i] += change[i] / _hat_weight(left, float(new_places[i]), right)


@kernel
def _hat_weight(left: float, middle: float, right: float) -> float:
    """Integral of a hat times the radius."""
    return ((middle - left) * (2.0 * middle + left) + (right - middle) * (2.0 * middle + right)) / 6.0
