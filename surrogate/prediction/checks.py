"""Checks of the inputs of a trained model; quantities are dimensionless, as in `bem.protocol`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.validation import real_array
from bem._support.wording import shown
from bem.materials import Elastic, StandardLinearSolid
from bem.protocol import LARGEST_INDENTATION, LARGEST_RATE, LONGEST_DWELL, SMALLEST_RATE
from bem.scene import Scene
from bem.tractions import LennardJones

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

LONGEST_HISTORY = LONGEST_DWELL + 4.0 * LARGEST_INDENTATION / SMALLEST_RATE
"""Duration of the slowest protocol, in retardation times."""

SHORTEST_STEP = 1e-24
"""Smallest time step: far below that of any allowed motion, and far above that at which a division overflows."""


def real_number(name: str, value: Any) -> float:
    """Return a number, or the one element of an array, as a float; NaN and infinity are allowed.

    Raises:
        ValueError: the value is not one real number.
    """
    number = real_array(name, value)
    if number.size != 1:
        raise ValueError(f"Expected one number as {name}. Received: shape {number.shape}")
    return float(number.item())


def contacts(scene: Scene | Sequence[Scene], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Tabor parameters and modulus ratios of shape `(count,)`, from one scene per history or one for all.

    Raises:
        ValueError: a scene is none, their number does not fit, or one is not of the kind that the models learned:
            Lennard-Jones adhesion, a standard linear solid or an elastic one, and no spring.
    """
    scenes = [scene] if isinstance(scene, Scene) else list(scene) if isinstance(scene, Iterable) else [scene]
    if len(scenes) not in (1, count):
        raise ValueError(f"Expected one scene, or one for each of {count} histories. Received: {len(scenes)}")
    values = np.empty((2, count))
    values[:] = np.transpose([_contact(one, index if len(scenes) > 1 else None) for index, one in enumerate(scenes)])
    return values[0], values[1]


def _contact(scene: Scene, index: int | None) -> tuple[float, float]:
    where = "" if index is None else f" as scene {index}"
    if not isinstance(scene, Scene):
        raise ValueError(f"Expected a bem.Scene. Received: {shown(scene)}{where}")
    if not isinstance(scene.adhesion, LennardJones) or scene.spring is not None or scene.indenter is not None:
        other = "a spring" if scene.spring is not None else shown(scene.indenter or scene.adhesion)
        raise ValueError(
            "Expected Lennard-Jones adhesion, a paraboloid and no spring, as in the training. "
            f"Received: {other}{where}; the solver knows it (`bem.simulate`)"
        )
    if isinstance(scene.material, StandardLinearSolid):
        return scene.tabor, scene.material.modulus_ratio
    if isinstance(scene.material, Elastic):
        return scene.tabor, 1.0
    raise ValueError(
        f"Expected a standard linear solid, as in the training. Received: {shown(scene.material)}{where}; the solver "
        "knows it (`bem.simulate`)"
    )


def check_history(times: np.ndarray, indentations: np.ndarray) -> None:
    """Check times and indentations of shape `(batch, steps)`.

    Raises:
        ValueError: the shapes differ, a value is NaN or infinite, times do not increase strictly, or a value is outside
            the bounds of `bem.protocol`.
    """
    if times.ndim != 2 or times.shape != indentations.shape or times.size == 0:
        raise ValueError(
            "Expected times and indentations of the same shape (batch, steps). "
            f"Received: times of shape {times.shape}, indentations of shape {indentations.shape}"
        )
    with np.errstate(all="ignore"):
        # Models use the time since the first point; by rounding, two late times may have the same one.
        since = times - times[:, :1]
        steps, rises = since[:, 1:] - since[:, :-1], indentations[:, 1:] - indentations[:, :-1]
        sound = ((steps >= SHORTEST_STEP) & (np.abs(rises) <= LARGEST_RATE * steps)).all(axis=1)
        sound &= (np.abs(indentations) <= LARGEST_INDENTATION).all(axis=1) & (since[:, -1] <= LONGEST_HISTORY)
    if sound.all():
        return
    row = int(sound.argmin())
    time, place = times[row], f" in history {row}" if len(times) > 1 else ""
    for name, values in (("times", time), ("indentations", indentations[row])):
        if not np.isfinite(values).all():
            raise ValueError(f"Expected finite {name}. Received: NaN or infinity{place}")
    for step in np.flatnonzero(steps[row] <= 0.0)[:1]:
        found = f"{float(time[step + 1])!r} after {float(time[step])!r}"
        raise ValueError(f"Expected times that increase strictly. Received: {found}{place}")
    for name, values, low, high in (
        ("indentations", indentations[row], -LARGEST_INDENTATION, LARGEST_INDENTATION),
        ("times after the first", since[row], 0.0, LONGEST_HISTORY),
        ("time steps", steps[row], SHORTEST_STEP, LONGEST_HISTORY),
        ("rates", rises[row] / steps[row], -LARGEST_RATE, LARGEST_RATE),
    ):
        for value in values[(values < low) | (values > high)][:1].tolist():
            raise ValueError(f"Expected {name} within {low:g} and {high:g}. Received: {value!r}{place}")


def checked_edge(edge: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    """Return edge marks of shape `shape` as float64.

    Raises:
        ValueError: the shape is another one, or a mark is neither zero nor one.
    """
    edge = real_array("edge", edge)
    if edge.shape != shape:
        raise ValueError(f"Expected edge marks of shape {shape}. Received: shape {edge.shape}")
    bad = edge[~((edge == 0.0) | (edge == 1.0))]
    if bad.size:
        raise ValueError(f"Expected edge marks of zero or one. Received: {bad[0]:g}")
    return edge
