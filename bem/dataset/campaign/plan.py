"""What a campaign computes: protocols of a design at one accuracy by one version of the solver, wherever it runs."""

import functools
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.validation import FloatArray
from bem.dataset.designs import Design, whole_number
from bem.dataset.measurement_steps import FMS, checked_counts
from bem.dataset.records import Settings
from bem.solver.version import SOLVER_VERSION

Solver = Callable[..., Any]


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """What is computed.

    Args:
        design: where protocols come from.
        count: how many.
        seed: seed of the design.
        accuracy: as in `bem.simulate`.
        counts: measurement points in loading, dwell and unloading.
        native: whether the solver's own histories are kept too.
        shard: (i, n) for the i-th of n interleaved shares, counting from 1, none of them empty.

    Raises:
        ValueError: naming the quantity, the allowed range and the value received.
    """

    design: Design = field(default_factory=Design)
    count: int = 12_450
    seed: int = 0
    accuracy: str | float = "standard"
    counts: tuple[int, int, int] = FMS
    native: bool = False
    shard: tuple[int, int] = (1, 1)

    def __post_init__(self) -> None:
        from bem.accuracy import resolve_accuracy

        resolve_accuracy(self.accuracy)
        count = whole_number("count", self.count, low=1, high=self.design.largest_count)
        shards = whole_number("shards", self.shard[1], low=1, high=count)
        checked = {
            "count": count,
            "seed": whole_number("seed", self.seed, low=0),
            "counts": checked_counts(self.counts),
            "shard": (whole_number("shard", self.shard[0], low=1, high=shards), shards),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @functools.cached_property
    def protocols(self) -> dict[str, FloatArray]:
        """The quantities of all `count` protocols by name, whatever the shard."""
        return self.design.protocols(self.count, self.seed)

    @functools.cached_property
    def indices(self) -> np.ndarray:
        """Which of the protocols this campaign simulates."""
        return np.arange(self.shard[0] - 1, self.count, self.shard[1])

    @property
    def settings(self) -> Settings:
        """How each of them is simulated and measured."""
        return Settings(
            modulus_ratio=self.design.modulus_ratio, accuracy=self.accuracy, counts=self.counts, native=self.native
        )

    def identity(self, solver: Solver | None = None) -> dict[str, Any]:
        """Everything that decides the numbers."""
        return {
            "design": self.design.name,
            "ranges": {name: list(bounds) for name, bounds in self.design.ranges.items()},
            "modulus_ratio": self.design.modulus_ratio,
            "seed": self.seed,
            "count": self.count,
            "accuracy": self.accuracy,
            "counts": list(self.counts),
            "native": self.native,
            "shard": "/".join(map(str, self.shard)),
            "solver": SOLVER_VERSION if solver is None else f"{solver.__module__}.{solver.__qualname__}",
        }

    def path(self, out: str | Path) -> Path:
        """Where the data set goes: `out` itself or what it links to, or beside it for one of several shards.

        Raises:
            ValueError: a link that leads in circles.
        """
        out = Path(out)
        if self.shard[1] > 1:
            out = out.with_name(f"{out.stem}.shard-{self.shard[0]}-of-{self.shard[1]}{out.suffix}")
        return followed(out)


def followed(path: Path) -> Path:
    """The path itself, or what it links to, so that writing replaces that and not the link.

    Raises:
        ValueError: a link that leads in circles.
    """
    try:
        return path.resolve() if path.is_symlink() else path
    except (OSError, RuntimeError) as error:
        raise ValueError(f"out must not be a link in circles; received {str(path)!r}") from error
