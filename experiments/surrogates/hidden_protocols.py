"""What the studies of this folder share: protocols that no training has seen, simulated, and their errors."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bem import LoadingProtocol, Trajectory
from bem.dataset.designs import PAPER_RANGES, QUANTITIES, Design
from experiments import common

SEED = 901
"""Of the design; the trainings use others."""
ANY_SOLID = (0.01, 1.0)
LEVELS = (0.5, 0.9, 0.99)


@dataclass(frozen=True)
class Hidden:
    """Protocols off the paper's grid.

    Args:
        quantities: The protocol's and the modulus ratio by name, each of shape (n,).
    """

    quantities: dict[str, np.ndarray]

    @classmethod
    def draw(cls, count: int, modulus_ratio: float | tuple[float, float]) -> Hidden:
        """Draw protocols in the paper's ranges."""
        drawn = Design("log-uniform", modulus_ratio=modulus_ratio).protocols(count, SEED)
        return cls(drawn if "modulus_ratio" in drawn else drawn | {"modulus_ratio": np.full(count, modulus_ratio)})

    @classmethod
    def corners(cls, modulus_ratio: float) -> Hidden:
        """All corners of the paper's ranges, 32 protocols."""
        columns = np.array(list(itertools.product(*PAPER_RANGES.values()))).T
        quantities = dict(zip(PAPER_RANGES, columns, strict=True))
        return cls(quantities | {"modulus_ratio": np.full(columns.shape[1], modulus_ratio)})

    def __len__(self) -> int:
        return len(self.quantities["tabor"])

    def row(self, index: int) -> tuple[dict[str, float], float]:
        """Quantities of one protocol, and its modulus ratio."""
        values = {name: float(self.quantities[name][index]) for name in QUANTITIES}
        return values, float(self.quantities["modulus_ratio"][index])

    def part(self, rows: slice) -> Hidden:
        """Some of the protocols."""
        return Hidden({name: values[rows] for name, values in self.quantities.items()})

    def protocols(self) -> list[LoadingProtocol]:
        """The protocols as a user writes them."""
        names = [name for name in QUANTITIES if name != "tabor"]
        rows = zip(*(self.quantities[name].tolist() for name in names), strict=True)
        return [LoadingProtocol(**dict(zip(names, row, strict=True))) for row in rows]

    def simulated(self, accuracy: str | float = "standard") -> Iterator[Trajectory]:
        """Simulate one after the other."""
        for index in range(len(self)):
            values, ratio = self.row(index)
            yield common.simulated(values, accuracy=accuracy, modulus_ratio=ratio)


def quantiles(errors: np.ndarray) -> dict[str, float]:
    """Median, 90th and 99th percentile in percent."""
    return {f"p{100 * level:.0f}": 100.0 * float(np.quantile(errors, level)) for level in LEVELS}
