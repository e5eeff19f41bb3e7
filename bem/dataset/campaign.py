"""What a campaign computes: scenes and protocols, each by its index, and what is kept of each trajectory.

A job is either a `Campaign`, protocols of a design, or `bem.Cases`. It travels to the workers without its cases, which
each batch brings with it.
"""

import functools
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from bem._support.validation import FloatArray, whole_number
from bem._support.wording import shown
from bem.dataset import records
from bem.dataset.designs import QUANTITIES, Design
from bem.dataset.file import load_dataset
from bem.dataset.measurement_steps import FMS, STEPS, checked_counts
from bem.dataset.records import RESULTS, SOLIDS, Layout, Record, grid_of
from bem.dataset.sealed_file import FORMAT
from bem.dataset.solids import Solids, solid_of
from bem.methods.version import SOLVER_VERSION
from bem.problem.accuracy import resolve_accuracy
from bem.problem.materials import Elastic, StandardLinearSolid
from bem.problem.protocol import LoadingProtocol, Protocol
from bem.problem.scene import Scene

Solver = Callable[..., Any]
Batch = tuple[tuple[int, Any], ...]
"""Trajectories of a campaign, each with its index and all that a worker needs to know of it."""
LARGEST_BATCH = 1000
SHARE_OF_REST = 5
"""A batch is at most this part of what each worker has yet to do, so that all end at about the same time ..."""
BATCHES_PER_WORKER = 96
"""... and need be no smaller than this part of all it does."""


class Job:
    """Trajectories to simulate, how, and what is kept of each.

    Subclasses have `indices`, shape (n,), `accuracy`, the `layout` of the arrays that hold what is kept, and methods
    `identity`, `cases_of`, `inputs`, `kept` and `read`, as `Campaign` documents them.
    """

    form: ClassVar[str] = FORMAT
    """Name of the file's format."""
    stated: ClassVar[tuple[str, ...]] = ("accuracy",)
    """What of the identity the root attributes state again."""
    finite_in: ClassVar[str] = ""
    """Beginning of the paths of arrays in which every number must be finite."""
    without_trajectory: ClassVar[Record] = {}
    """What is not blank in a record where the solver raised an error."""

    def shard_path(self, out: Path) -> Path:
        """Where the file goes: `out` itself, or beside it for one of several shards."""
        return out

    def batches(self, indices: np.ndarray, workers: int) -> deque[Batch]:
        """Some of the trajectories in batches for these workers, each with its case, in random order.

        The batches become smaller and smaller towards the end.
        """
        order = np.random.default_rng(0).permutation(indices)
        items = list(zip(order.tolist(), self.cases_of(order), strict=True))
        batches: deque[Batch] = deque()
        begin, least = 0, len(items) // (BATCHES_PER_WORKER * workers)
        while begin < len(items):
            size = min(max((len(items) - begin) // (SHARE_OF_REST * workers), least, 1), LARGEST_BATCH)
            batches.append(tuple(items[begin : begin + size]))
            begin += size
        return batches

    def simulated(self, index: int, case: tuple[Scene, Protocol], solver: Solver) -> Record:
        """Simulate one trajectory; an error of the solver, whatever it is, becomes a failed record."""
        # One failing case must not end the batch.
        try:
            trajectory = solver(*case, accuracy=self.accuracy)
            work, results = self.kept(trajectory, case)
        except Exception as error:
            return self.failed(index, f"{type(error).__name__}: {error}")
        if not self._finite(work | results):
            work = work if self._finite(work) else {}
            return self.failed(index, "the solver returned numbers that are not finite", work)
        if not trajectory.completed:
            return self.failed(index, trajectory.status, work)
        return {"index": index, "status": records.COMPLETED, "reason": ""} | work | results

    def failed(self, index: int, reason: str, work: Record | None = None) -> Record:
        """The record of a trajectory without a result, and with the `work` that was done for it."""
        work = work or self.without_trajectory
        return records.blank(self.layout) | work | {"index": index, "status": records.FAILED, "reason": reason}

    def _finite(self, values: Record) -> bool:
        checked = (numbers for path, numbers in values.items() if path.startswith(self.finite_in))
        return all(np.all(np.isfinite(numbers)) for numbers in checked)


def solver_name(solver: Solver | None) -> str:
    """What the identity of a job says of the solver, or of its stand-in."""
    return SOLVER_VERSION if solver is None else f"{solver.__module__}.{solver.__qualname__}"


@dataclass(frozen=True, kw_only=True)
class Campaign(Job):
    """Protocols of a design, and how each of them is simulated.

    Args:
        design: where protocols come from.
        count: how many.
        seed: seed of the design.
        accuracy: as in `bem.simulate`.
        counts: measurement points in loading, dwell and unloading.
        native: whether the solver's own histories are kept too.
        steps: 'uniform', or 'pull-off' for those of `bem.dataset.pull_off_steps`.
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
    stated: ClassVar[tuple[str, ...]] = ("design", "ranges", "modulus_ratio", "seed", "accuracy", "count", "shard")

    def __post_init__(self) -> None:
        resolve_accuracy(self.accuracy)
        if self.steps not in STEPS:
            raise ValueError(f"steps must be one of {', '.join(STEPS)}; received {shown(self.steps)}")
        count = whole_number("count", self.count, low=1, high=self.design.largest_count)
        shards = whole_number("shards", self.shard[1], low=1, high=count)
        object.__setattr__(self, "count", count)
        object.__setattr__(self, "seed", whole_number("seed", self.seed, low=0))
        object.__setattr__(self, "counts", checked_counts(self.counts))
        object.__setattr__(self, "shard", (whole_number("shard", self.shard[0], low=1, high=shards), shards))

    @classmethod
    def of(cls, identity: dict[str, Any]) -> "Campaign":
        """The campaign of an identity, the attribute `campaign` of a data set file.

        Raises:
            ValueError: it describes no campaign.
        """
        try:
            number, total = identity["shard"].split("/")
            solids = Solids.of(identity["solids"]) if "solids" in identity else None
            return cls(
                design=Design(identity["design"], identity["ranges"], identity["modulus_ratio"], solids),
                **{name: identity[name] for name in ("count", "seed", "accuracy", "native")},
                counts=tuple(identity["counts"]),
                steps=identity.get("steps", "uniform"),
                shard=(int(number), int(total)),
            )
        except (AttributeError, KeyError, TypeError) as error:
            raise ValueError(
                f"expected a data set whose attribute 'campaign' describes one; received {shown(identity)}"
            ) from error

    @functools.cached_property
    def protocols(self) -> dict[str, FloatArray]:
        """The quantities of all `count` protocols by name, whatever the shard."""
        return self.design.protocols(self.count, self.seed)

    @functools.cached_property
    def solids(self) -> tuple[FloatArray, FloatArray]:
        """Retardation strengths and times of all `count` solids, (count, m) each; unused terms are 0 and 1."""
        ratio = ({"modulus_ratio": self.design.modulus_ratio} | self.protocols)["modulus_ratio"]
        shares, times = (self.design.solids or Solids(terms=(1, 1))).draw(self.count, self.seed)
        return (1.0 - np.reshape(ratio, (-1, 1))) * shares, times

    @functools.cached_property
    def indices(self) -> np.ndarray:
        """Which of the protocols this campaign simulates."""
        return np.arange(self.shard[0] - 1, self.count, self.shard[1])

    @property
    def layout(self) -> Layout:
        """The arrays of a data set but those of the protocols."""
        return records.measured_layout(sum(self.counts), native=self.native)

    def __getstate__(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}  # without the protocols

    def identity(self, solver: Solver | None = None) -> dict[str, Any]:
        """Everything that determines the numbers."""
        ratio = self.design.modulus_ratio
        identity = {
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
        }
        # Uniform ones are not named, as before there were others.
        if self.steps != "uniform":
            identity |= {"steps": self.steps}
        return identity | ({"solids": self.design.solids.identity} if self.design.solids else {})

    def shard_path(self, out: Path) -> Path:
        """Where the data set goes: `out` itself, or beside it for one of several shards."""
        if self.shard == (1, 1):
            return out
        return out.with_name(f"{out.stem}.shard-{self.shard[0]}-of-{self.shard[1]}{out.suffix}")

    def cases_of(self, indices: np.ndarray) -> list[tuple[Scene, Any]]:
        """Scene and protocol of some of the protocols."""
        drawn = {"modulus_ratio": self.design.modulus_ratio} | self.protocols
        columns = (
            np.broadcast_to(drawn[name], self.count)[indices].tolist() for name in ("modulus_ratio", *QUANTITIES)
        )
        ratios, *columns = columns
        if self.design.solids:
            materials = [solid_of(*terms) for terms in zip(*(values[indices] for values in self.solids), strict=True)]
        else:
            materials = [StandardLinearSolid(ratio) if ratio < 1.0 else Elastic() for ratio in ratios]
        return [
            (Scene(tabor, material), LoadingProtocol(**dict(zip(QUANTITIES[1:], quantities, strict=True))))
            for material, tabor, *quantities in zip(materials, *columns, strict=True)
        ]

    def inputs(self, indices: np.ndarray) -> dict[str, np.ndarray]:
        """The quantities of some of the protocols, and their solids."""
        stored = {f"protocols/{name}": values[indices] for name, values in self.protocols.items()}
        if self.design.solids:
            stored |= zip(SOLIDS, (values[indices] for values in self.solids), strict=True)
        return stored

    def kept(self, trajectory: Any, case: tuple[Scene, LoadingProtocol]) -> tuple[Record, Record]:
        """The work of any trajectory; what was measured of a completed one."""
        stats, jumps = trajectory.stats, trajectory.jumps
        work = {f"scalars/{name}": getattr(stats, name) for name in ("steps", "rejections", "iterations", "nodes")}
        work |= {"scalars/solver_seconds": stats.seconds, "scalars/jump_count": len(jumps)}
        if not trajectory.completed:
            return work, {}
        scene, protocol = case
        drawn = {"tabor": scene.tabor} | {name: getattr(protocol, name) for name in QUANTITIES[1:]}
        terms = (scene.material.strengths, scene.material.times)
        around = dict(zip(("strengths", "retardation_times"), (values[np.newaxis] for values in terms), strict=True))
        around |= {"pull_off_time": trajectory.pull_off_time}
        times, _ = grid_of(self.steps, drawn, self.counts, around)
        results: Record = {"fms/force": np.asarray(trajectory.at(times[0]), dtype=np.float32)}
        results |= {f"scalars/{name}": float(getattr(trajectory, name)) for name in RESULTS}
        for name in records.JUMP_QUANTITIES:
            results[f"jumps/{name}"] = np.array([getattr(jump, name) for jump in jumps], dtype=np.float64)
        if self.native:
            results |= {f"native/{name}": getattr(trajectory, name) for name in records.NATIVE_QUANTITIES}
        return work, results

    def read(self, path: Path) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Arrays and root attributes of a complete data set; see `load_dataset` for its errors."""
        dataset = load_dataset(path, native=True)
        return dataset.columns, dataset.attributes
