"""What a campaign computes: protocols of a design at one accuracy by one version of the solver, wherever it runs."""

import functools
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bem._support.validation import FloatArray, whole_number
from bem._support.wording import shown
from bem.accuracy import resolve_accuracy
from bem.dataset.campaign.work import Solver, expected_seconds, solver_name
from bem.dataset.designs import QUANTITIES, Design
from bem.dataset.file import load_dataset, write_dataset
from bem.dataset.measurement_steps import FMS, checked_counts
from bem.dataset.records import Columns, Record, Settings, failed, simulate_record, tabulate, untabulate

STEPS = ("uniform", "physical")
NAMES = (*QUANTITIES, "modulus_ratio")
"""What a design draws, in its order; the last only where it has a range."""


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """Protocols of a design, and how each of them is simulated.

    Args:
        design: where protocols come from.
        count: how many.
        seed: seed of the design.
        accuracy: as in `bem.simulate`.
        counts: measurement points in loading, dwell and unloading.
        native: whether the solver's own histories are kept too.
        steps: 'uniform', or 'physical' for those of `bem.dataset.physical_steps`.
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
    steps: str = "uniform"
    shard: tuple[int, int] = (1, 1)

    def __post_init__(self) -> None:
        resolve_accuracy(self.accuracy)
        if self.steps not in STEPS:
            raise ValueError(f"steps must be one of {', '.join(STEPS)}; received {shown(self.steps)}")
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
        ratio = self.design.modulus_ratio
        return Settings(
            modulus_ratio=ratio[1] if isinstance(ratio, tuple) else ratio,
            accuracy=self.accuracy,
            counts=self.counts,
            native=self.native,
            steps=self.steps,
        )

    def identity(self, solver: Solver | None = None) -> dict[str, Any]:
        """Everything that determines the numbers."""
        ratio = self.design.modulus_ratio
        return {
            "design": self.design.name,
            "ranges": {name: list(bounds) for name, bounds in self.design.ranges.items()},
            "modulus_ratio": list(ratio) if isinstance(ratio, tuple) else ratio,
            "seed": self.seed,
            "count": self.count,
            "accuracy": self.accuracy,
            "counts": list(self.counts),
            "native": self.native,
            "shard": "/".join(map(str, self.shard)),
            "solver": solver_name(solver),
            # As before there were other steps.
            **({"steps": self.steps} if self.steps != "uniform" else {}),
        }

    def shard_path(self, out: Path) -> Path:
        """Where the data set goes: `out` itself, or beside it for one of several shards."""
        if self.shard == (1, 1):
            return out
        return out.with_name(f"{out.stem}.shard-{self.shard[0]}-of-{self.shard[1]}{out.suffix}")

    def expected_seconds(self, indices: np.ndarray) -> FloatArray:
        """Seconds that some of the trajectories may take, shape (n,)."""
        return expected_seconds({name: values[indices] for name, values in self.protocols.items()}, self.accuracy)

    def items(self, indices: np.ndarray) -> list[tuple[float, ...]]:
        """What a worker needs to know of some of the trajectories: their protocols in the order of `NAMES`."""
        return list(map(tuple, np.stack([values[indices] for values in self.protocols.values()], axis=1).tolist()))

    @property
    def simulator(self) -> functools.partial:
        """The function by which a worker turns an index, an item and a solver into a record."""
        return functools.partial(_simulated, self.settings)

    def failed(self, index: int, reason: str) -> Record:
        """The record of a trajectory without a result."""
        return failed(index, reason, self.settings)

    def columns(self, records: Iterable[Record]) -> Columns:
        """Arrays of some records."""
        return tabulate(records, self.settings)

    def records(self, columns: Columns) -> list[Record]:
        """The records that such arrays hold."""
        return untabulate(columns)

    def read(self, path: Path) -> tuple[Columns, dict[str, Any]]:
        """Arrays and root attributes of a complete file.

        Raises:
            DamagedFileError, ValueError: as `load_dataset`.
        """
        dataset = load_dataset(path, native=True)
        return dataset.columns, dataset.attributes

    def write(self, path: Path, columns: Columns, attributes: dict[str, Any], scratch: Path | None) -> None:
        """Write the file; `scratch` is the folder of its temporary file.

        Raises:
            OSError: nothing was written.
        """
        protocols = {f"protocols/{name}": values[columns["index"]] for name, values in self.protocols.items()}
        attributes = root_attributes(attributes["campaign"]) | attributes
        write_dataset(path, protocols | columns, attributes, self.counts, scratch)


def root_attributes(identity: dict[str, Any]) -> dict[str, Any]:
    """Root attributes that follow from what was computed."""
    names = ("design", "ranges", "modulus_ratio", "seed", "accuracy", "count", "shard")
    return {name: identity[name] for name in names} | {"campaign": identity}


def _simulated(settings: Settings, index: int, protocol: tuple[float, ...], solver: Solver) -> Record:
    return simulate_record(index, dict(zip(NAMES, protocol, strict=False)), settings, solver)
