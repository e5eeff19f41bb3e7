"""Which protocols a campaign simulates: sampling designs over five quantities, drawn from a seed.

`paper` draws nodes of the logarithmic grid on which every protocol of the paper's six-row table lies, each node at most
once; `log-uniform` and `sobol` fill the same box continuously. Protocol i depends on design and seed only, so that a
larger count, another machine or another number of workers changes none of those before it. Units as in
`bem.problem.protocol`. Source: paper, section "Dataset generation" and the table of its figure-2 protocols.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bem._support.validation import FloatArray, finite_number, whole_number
from bem._support.wording import shown
from bem.dataset.measurement_steps import FMS, measurement_grid
from bem.dataset.solids import Solids
from bem.problem.protocol import LARGEST_INDENTATION, LARGEST_RATE, LONGEST_DWELL, SMALLEST_RATE
from bem.problem.scene import LARGEST_TABOR, SMALLEST_TABOR

OUTERMOST = 0.2
"""Share of a range, in its logarithm, at each of its ends that belongs to an edge; all edges together are a corner."""
_DENSITIES = {
    "sobol": lambda unit: unit,
    "edges": lambda unit: np.sin(0.5 * np.pi * unit) ** 2,
    "corners": lambda unit: 2.0 * OUTERMOST * unit + (1.0 - 2.0 * OUTERMOST) * (unit >= 0.5),
}
DESIGNS = ("paper", "log-uniform", *_DENSITIES)

PAPER_RANGES = {
    "tabor": (0.2, 3.2),
    "peak_indentation": (2.0, 100.0),
    "loading_rate": (0.1, 1000.0),
    "dwell_time": (1e-3, 3.0),
    "unloading_rate": (0.1, 1000.0),
}
PAPER_POINTS = {"tabor": 12, "peak_indentation": 12, "loading_rate": 18, "dwell_time": 12, "unloading_rate": 18}
QUANTITIES = tuple(PAPER_RANGES)

_LIMITS = {
    "tabor": (SMALLEST_TABOR, LARGEST_TABOR),
    "peak_indentation": (1e-6, LARGEST_INDENTATION),
    "loading_rate": (SMALLEST_RATE, LARGEST_RATE),
    "dwell_time": (1e-12, LONGEST_DWELL),
    "unloading_rate": (SMALLEST_RATE, LARGEST_RATE),
}
_CHECKED_AT_ONCE = 10_000  # protocols whose measurement steps are in memory at a time


def agree(first: FloatArray, second: FloatArray) -> bool:
    """Whether two draws of a quantity are the same but for the last digits, which depend on the processor."""
    return np.allclose(first, second, rtol=1e-12, atol=0.0)


@dataclass(frozen=True)
class Design:
    """A way to draw protocols.

    Args:
        name: one of `DESIGNS`.
        ranges: (low, high) of any of `QUANTITIES`, both positive; the paper's for those left out. Equal bounds fix a
            quantity. The paper's grid keeps its number of points in a changed range.
        modulus_ratio: relaxed over instantaneous modulus of every scene, in (0, 1]; or (low, high) of ratios drawn like
            the other quantities, by any design but 'paper'.
        solids: where spectra come from; standard linear solids by default.

    Raises:
        ValueError: naming the quantity, the allowed range and the value received.

    Examples:
        >>> Design("paper").protocols(2, seed=1)["tabor"].shape
        (2,)
    """

    name: str = "paper"
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    modulus_ratio: float | tuple[float, float] = 0.1
    solids: Solids | None = None

    def __post_init__(self) -> None:
        if self.name not in DESIGNS:
            raise ValueError(f"design must be one of {', '.join(DESIGNS)}; received {shown(self.name)}")
        ratio, limits = self.modulus_ratio, {"above": 0.0, "high": 1.0}
        if isinstance(ratio, list | tuple):
            low, high = _checked_range("modulus_ratio", ratio, **limits)
            ratio = (low, high) if low < high else low
        else:
            ratio = finite_number("modulus_ratio", ratio, **limits)
        if isinstance(ratio, tuple) and self.name == "paper":
            raise ValueError(f"a range of modulus_ratio needs the design {' or '.join(DESIGNS[1:])}; received 'paper'")
        unknown = sorted(set(self.ranges) - set(QUANTITIES))
        if unknown:
            raise ValueError(f"ranges must name some of {', '.join(QUANTITIES)}; received {shown(unknown[0])}")
        merged = PAPER_RANGES | dict(self.ranges)
        merged = {name: _checked_range(name, merged[name], low=low, high=high) for name, (low, high) in _LIMITS.items()}
        object.__setattr__(self, "ranges", merged)
        object.__setattr__(self, "modulus_ratio", ratio)

    @property
    def largest_count(self) -> int:
        """Number of different protocols that the design can draw."""
        if self.name == "paper":
            return int(np.prod([len(grid) for grid in self._grids()]))
        return 2**30

    def protocols(self, count: int, seed: int) -> dict[str, FloatArray]:
        """Draw `count` protocols: the quantities by name, each of shape (count,), with `modulus_ratio` if it is drawn.

        Raises:
            ValueError: for a negative seed, for more protocols than the design offers, or for ranges in which a phase
                of a protocol vanishes in double precision.
        """
        count = whole_number("count", count, low=1, high=self.largest_count)
        seed = whole_number("seed", seed, low=0)
        columns = self._grid_nodes(count, seed) if self.name == "paper" else self._spread(count, seed)
        for first in range(0, count, _CHECKED_AT_ONCE):
            rows = slice(first, first + _CHECKED_AT_ONCE)
            measurement_grid(**{name: columns[name][rows] for name in QUANTITIES}, counts=FMS)
        return columns

    def _grids(self) -> list[FloatArray]:
        return [
            np.geomspace(low, high, PAPER_POINTS[name] if low < high else 1)
            for name, (low, high) in self.ranges.items()
        ]

    def _grid_nodes(self, count: int, seed: int) -> dict[str, FloatArray]:
        grids = self._grids()
        drawn = np.random.default_rng(seed).permutation(self.largest_count)[:count]
        nodes = np.unravel_index(drawn, [len(grid) for grid in grids])
        return {name: grid[node] for name, grid, node in zip(QUANTITIES, grids, nodes, strict=True)}

    def _spread(self, count: int, seed: int) -> dict[str, FloatArray]:
        drawn = dict(self.ranges)
        if isinstance(self.modulus_ratio, tuple):
            drawn["modulus_ratio"] = self.modulus_ratio
        if self.name in _DENSITIES:
            # Imported here because scipy.stats takes half a second.
            from scipy.stats.qmc import Sobol

            sequence = Sobol(d=len(drawn), scramble=True, bits=30, rng=np.random.default_rng(seed))
            unit = _DENSITIES[self.name](sequence.random_base2(int(count - 1).bit_length())[:count])
        else:
            unit = np.random.default_rng(seed).random((count, len(drawn)))
        bounds = np.array(list(drawn.values())).T
        low, high = np.log(bounds)
        values = np.exp(low + (high - low) * unit)
        # The exponential of a logarithm may leave the range by one rounding.
        return dict(zip(drawn, np.clip(values, *bounds).T.copy(), strict=True))


def _checked_range(name: str, bounds: Any, **limits: float) -> tuple[float, float]:
    try:
        low, high = bounds
    except (TypeError, ValueError):
        raise ValueError(f"range of {name} must be two numbers, low and high; received {shown(bounds)}") from None
    low = finite_number(f"lower bound of {name}", low, **limits)
    high = finite_number(f"upper bound of {name}", high, **limits)
    if low > high:
        raise ValueError(f"range of {name} must have its lower bound first; received {low!r} to {high!r}")
    return low, high
