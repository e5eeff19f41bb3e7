"""What is done with data set files once campaigns have written them: joined from shards, checked by computing again."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bem.accuracy import resolve_accuracy
from bem.campaign import (
    Summary,
    existing,
    results,
    root_attributes,
    summary_of,
    write_result,
)
from bem.campaign_plan import Campaign, Solver
from bem.dataset_file import load_dataset, open_dataset, read_tree
from bem.designs import QUANTITIES, Design, whole_number
from bem.parts import differences
from bem.pools import LocalPool
from bem.provenance import host, provenance, versions
from bem.records import COMPLETED, RESULTS, Record, Settings, tabulate, untabulate

ROUNDING = 1e-6
"""Largest difference, relative to the largest force of a trajectory, that is put down to rounding."""

OF_THE_BUILD = ("python", "numpy", "scipy", "numba", "llvmlite")
"""What, with the solver's source and the processor, decides the last bits of a result."""


def campaign_of(attributes: dict[str, Any]) -> Campaign:
    """The campaign that a data set file with these root attributes holds."""
    identity = attributes["campaign"]
    shard = tuple(int(number) for number in identity["shard"].split("/"))
    return Campaign(
        design=Design(identity["design"], identity["ranges"], identity["modulus_ratio"]),
        **{name: identity[name] for name in ("count", "seed", "accuracy", "native")},
        counts=tuple(identity["counts"]),
        shard=shard,
    )


def merge(shards: Sequence[str | Path], out: str | Path, *, command: str = "", replace: bool = False) -> Summary:
    """Join the data set files of all shards of a campaign into one.

    Raises:
        FileNotFoundError, ValueError: for files that are no data sets, of different campaigns, given twice or missing.
        CampaignError: when the result cannot be written.
    """
    if not shards:
        raise ValueError("shards must name at least one data set file; received none")
    out = Path(out)
    identities, records, seconds = [], {}, []
    for path in shards:
        dataset = load_dataset(path)
        identity = dict(dataset.attributes["campaign"])
        number = identity.pop("shard")
        if identities and (difference := differences(identities[0], identity)):
            raise ValueError(f"shards must belong to one campaign; received {str(path)!r}: {difference}")
        if not records.keys().isdisjoint(dataset.columns["index"].tolist()):
            raise ValueError(f"shards must not overlap; received {str(path)!r}, shard {number}, a second time")
        identities.append(identity)
        seconds.append([dataset.attributes[name] for name in ("wall_seconds", "core_seconds")])
        with open_dataset(path) as file:
            records |= {record.index: record for record in untabulate(read_tree(file))}
    identity = {**identities[0], "shard": "1/1"}
    absent = sorted(set(range(identity["count"])) - records.keys())
    if absent:
        raise ValueError(
            f"shards must hold all {identity['count']} trajectories; received files without {len(absent)} of them, "
            f"the first being trajectory {absent[0]}"
        )
    if out.exists() and (complete := existing(out, identity, replace=replace)):
        return complete
    design = Design(identity["design"], identity["ranges"], identity["modulus_ratio"])
    settings = Settings(counts=tuple(identity["counts"]), native=identity["native"])
    wall, core = np.array(seconds).T
    attributes = root_attributes(identity) | {"wall_seconds": wall.max(), "core_seconds": core.sum(), "workers": 0}
    protocols = design.protocols(identity["count"], identity["seed"])
    write_result(
        out, tabulate(records.values(), settings), protocols, attributes | provenance(command), settings.counts
    )
    return summary_of(out, 0)


@dataclass(frozen=True)
class Verification:
    """How a random sample of a data set compares with the same trajectories computed again.

    Args:
        indices: the trajectories computed again.
        differences: of each, the largest difference of force or results, relative to its largest force or the result.
        same_build: whether the file was written by this version of the solver, compiled by the same packages for the
            same processor. Another build rounds otherwise, and where the step control decides on the last bit, the
            steps after it are others: then the accuracy is what can be asked for.
        tolerance: largest difference at which they agree: rounding, or for another build the accuracy of the file.
    """

    indices: np.ndarray
    differences: np.ndarray
    same_build: bool
    tolerance: float

    @property
    def identical(self) -> int:
        """How many agree to the last bit."""
        return int(np.sum(self.differences == 0.0))

    @property
    def agrees(self) -> bool:
        """Whether all agree to the tolerance."""
        return bool(np.all(self.differences <= self.tolerance))


def verify(
    path: str | Path,
    *,
    sample: int = 20,
    seed: int | None = None,
    workers: int | None = None,
    solver: Solver | None = None,
) -> Verification:
    """Compute a random sample of a data set again and compare.

    Args:
        path: the data set file.
        sample: how many trajectories; all of them where there are fewer.
        seed: of the choice; by default another one each time.
        workers: processes of this machine.
        solver: a stand-in for `bem.simulate`.

    Raises:
        FileNotFoundError, ValueError: not a data set, or its protocols are not those of its design.
    """
    dataset = load_dataset(path)
    campaign = campaign_of(dataset.attributes)
    for name in QUANTITIES:
        if not np.array_equal(campaign.protocols[name][dataset.columns["index"]], dataset.protocols[name]):
            raise ValueError(f"protocols must be those of the design; received {str(path)!r} with another {name}")
    rows = np.random.default_rng(seed).permutation(len(dataset))[: whole_number("sample", sample, low=1)]
    row_of = {int(dataset.columns["index"][row]): int(row) for row in np.sort(rows)}
    found: dict[int, float] = {}
    with LocalPool(workers) as pool:
        for records, _ in results(campaign, np.array(list(row_of)), pool, solver):
            for record in records:
                row = row_of[record.index]
                scalars = {name: dataset.scalars[name][row] for name in RESULTS}
                found[record.index] = _difference(record, dataset.columns["status"][row], dataset.force[row], scalars)
    same_build = _same_build(dataset.attributes, campaign.identity(solver)["solver"])
    return Verification(
        indices=np.array(list(row_of)),
        differences=np.array([found[index] for index in row_of]),
        same_build=same_build,
        tolerance=ROUNDING if same_build else resolve_accuracy(campaign.accuracy).target,
    )


def _same_build(attributes: dict[str, Any], solver: str) -> bool:
    here = versions()
    return (
        attributes["campaign"]["solver"] == solver
        and attributes["host"].rpartition(" cores of ")[2] == host().rpartition(" cores of ")[2]
        and all(attributes["versions"].get(name) == here.get(name) for name in OF_THE_BUILD)
    )


def _difference(record: Record, status: int, force: np.ndarray, scalars: dict[str, float]) -> float:
    if record.status != status:
        return np.inf
    if status != COMPLETED:
        return 0.0
    size = float(np.max(np.abs(force)))
    parts = [float(np.max(np.abs(record.force - force))) / size]
    parts += [abs(record.scalars[name] - value) / max(abs(value), 1e-12) for name, value in scalars.items()]
    return max(parts)
