"""How models are called by the studies of this folder: many protocols at once, and step by step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import surrogate
from bem import Trajectory
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import FMS, PHYSICAL, measurement_grid
from bem.dataset.physical_steps import physical_grid
from experiments.common import without_extrapolation_warnings
from experiments.surrogates.hidden_protocols import Hidden
from surrogate.pretrained.model import NAMES


def ask(model: Any, hidden: Hidden, *, any_solid: bool) -> list[Trajectory]:
    """What a model predicts of some protocols; only one of any solid is told the modulus ratio."""
    given = {"modulus_ratio": hidden.quantities["modulus_ratio"]} if any_solid else {}
    with without_extrapolation_warnings():
        return model.trajectories(hidden.protocols(), tabor=hidden.quantities["tabor"], **given)


def pull_offs(name: str) -> Callable[[Hidden], list[float]]:
    """Pull-off forces by a model of some protocols, from protocols to numbers."""
    model, any_solid = surrogate.load(name), name in NAMES
    return lambda hidden: [one.pull_off_force for one in ask(model, hidden, any_solid=any_solid)]


def streamed(name: str, hidden: Hidden) -> Callable[[int], int]:
    """What takes all steps of one protocol, on the measurement steps of the model's training, and counts them."""
    model: Any = surrogate.load(name)
    protocols = {quantity: hidden.quantities[quantity] for quantity in QUANTITIES}
    if name in NAMES:
        times, indentations = physical_grid(**protocols, modulus_ratio=hidden.quantities["modulus_ratio"])
        counts, given = PHYSICAL, ("tabor", "modulus_ratio")
    else:
        times, indentations = measurement_grid(**protocols)
        counts, given = FMS, ("tabor",)
    edges = (counts[0] - 1, counts[0] + counts[1] - 1)
    with without_extrapolation_warnings():
        streams = [
            model.stream(**{quantity: float(hidden.quantities[quantity][row]) for quantity in given})
            for row in range(len(hidden))
        ]
    points = [list(zip(*pair, strict=True)) for pair in zip(times.tolist(), indentations.tolist(), strict=True)]

    def steps(row: int) -> int:
        stream = streams[row]
        stream.reset()
        for step, (time, indentation) in enumerate(points[row]):
            stream.step(time, indentation, step in edges)
        return len(points[row])

    return steps
