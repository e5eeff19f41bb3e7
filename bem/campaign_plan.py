"""What a campaign computes: protocols of a design at one accuracy by one version of the solver, wherever it runs."""

import functools
import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bem._checks import FloatArray
from bem.designs import Design, whole_number
from bem.measurement import FMS
from bem.records import Settings

Solver = Callable[..., Any]
AROUND_THE_SOLVER = frozenset(
    ("__main__", "cli", "dataset_file", "designs", "parts", "plots", "pools", "provenance", "records")
)
"""Modules of this package that decide no trajectory's numbers, beside those called campaign."""


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
        shard: (i, n) for the i-th of n interleaved shares, counting from 1.
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
        whole_number("shards", self.shard[1], low=1)
        whole_number("shard", self.shard[0], low=1, high=self.shard[1])

    @functools.cached_property
    def protocols(self) -> dict[str, FloatArray]:
        """The quantities of all `count` protocols by name, whatever the shard."""
        return self.design.protocols(self.count, self.seed)

    @property
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
            "solver": solver_digest() if solver is None else f"{solver.__module__}.{solver.__qualname__}",
        }

    def path(self, out: str | Path) -> Path:
        """Where the data set goes: `out` itself, or beside it for one of several shards."""
        out = Path(out)
        if self.shard[1] == 1:
            return out
        return out.with_name(f"{out.stem}.shard-{self.shard[0]}-of-{self.shard[1]}{out.suffix}")


@functools.cache
def solver_digest() -> str:
    """Digest of the solver's source, the same wherever and whenever it is installed."""
    package = Path(__file__).parent
    sources = sorted(
        path
        for path in package.rglob("*.py")
        if path.stem not in AROUND_THE_SOLVER and not path.stem.startswith("campaign")
    )
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sources)).hexdigest()[:16]
