"""What is done with data set files once campaigns have written them: joined from shards, checked by computing again."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bem._wording import shown
from bem.accuracy import resolve_accuracy
from bem.campaign import Summary, existing, root_attributes, summary_of, write_result
from bem.campaign_plan import Campaign, Solver, followed
from bem.campaign_work import results
from bem.dataset_file import SUFFIXES, Dataset, load_dataset
from bem.designs import QUANTITIES, Design, agree, whole_number
from bem.outputs import require_suffix
from bem.parts import differences
from bem.pools import LocalPool
from bem.provenance import host, merged, provenance, versions
from bem.records import JUMP_QUANTITIES, RESULTS, SCALARS, Record, tabulate, untabulate

ROUNDING = 1e-6
"""Largest difference, relative to the largest force of a trajectory, that is put down to rounding."""

OF_THE_BUILD = ("python", "numpy", "scipy", "numba", "llvmlite")
"""What, with the solver's source and the processor, decides the last bits of a result."""

OF_ANY_BUILD = frozenset(("status", "force", *RESULTS))
"""What agrees to the accuracy whatever build computed it."""


def campaign_of(attributes: dict[str, Any]) -> Campaign:
    """The campaign that a data set file with these root attributes holds.

    Raises:
        ValueError: they describe none.
    """
    identity = attributes["campaign"]
    try:
        number, total = identity["shard"].split("/")
        return Campaign(
            design=Design(identity["design"], identity["ranges"], identity["modulus_ratio"]),
            **{name: identity[name] for name in ("count", "seed", "accuracy", "native")},
            counts=tuple(identity["counts"]),
            shard=(int(number), int(total)),
        )
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(
            f"expected a data set whose attribute 'campaign' describes one; received {shown(identity)}"
        ) from error


def merge(shards: Sequence[str | Path], out: str | Path, *, command: str = "", replace: bool = False) -> Summary:
    """Join the data set files of all shards of a campaign into one.

    Raises:
        FileNotFoundError, ValueError: for files that are no data sets, of different campaigns, given twice or missing,
            or a name that does not end as those of HDF5 files do.
        CampaignError: when the result cannot be written.
    """
    if not shards:
        raise ValueError("shards must name at least one data set file; received none")
    require_suffix(out, SUFFIXES)
    out = followed(Path(out))
    datasets: list[Dataset] = []
    records: dict[int, Record] = {}
    identity: dict[str, Any] = {}
    for path in shards:
        dataset = load_dataset(path, native=True)
        campaign_of(dataset.attributes)
        described = {**dataset.attributes["campaign"], "shard": "1/1"}
        identity = identity or described
        if difference := differences(identity, described):
            raise ValueError(f"shards must belong to one campaign; received {str(path)!r}: {difference}")
        if not records.keys().isdisjoint(dataset.columns["index"].tolist()):
            number = dataset.attributes["campaign"]["shard"]
            raise ValueError(f"shards must not overlap; received {str(path)!r}, shard {number}, a second time")
        datasets.append(dataset)
        records |= {record.index: record for record in untabulate(dataset.columns)}
    absent = sorted(set(range(identity["count"])) - records.keys())
    if absent:
        raise ValueError(
            f"shards must hold all {identity['count']} trajectories; received files without {len(absent)} of them, "
            f"the first being trajectory {absent[0]}"
        )
    # A merged file of this campaign is made anew: its shards may have been completed since.
    existing(out, identity, replace=replace)
    campaign = campaign_of({"campaign": identity})
    columns = tabulate(records.values(), campaign.settings)
    attributes = root_attributes(identity) | provenance(command) | _joined([found.attributes for found in datasets])
    write_result(out, columns, campaign.protocols, attributes, campaign.counts)
    return summary_of(out, 0)


def _joined(shards: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Cost and origin of shards that were computed side by side."""
    wall, core, workers = ([found[name] for found in shards] for name in ("wall_seconds", "core_seconds", "workers"))
    names = ("versions", "host", "git_revision")
    origins = merged({name: found[name] for name in names if name in found} for found in shards)
    memory = max(found.get("peak_memory", 0) for found in shards)
    cost = {"wall_seconds": max(wall), "core_seconds": sum(core), "workers": sum(workers), "peak_memory": memory}
    return cost | origins


@dataclass(frozen=True)
class Verification:
    """How a random sample of a data set compares with the same trajectories computed again.

    Args:
        indices: the trajectories computed again.
        differences: of each, the largest difference of what is compared: of times, forces and the like relative to the
            largest of the trajectory, of results relative to themselves; infinite where counts, reasons or what is
            finite differ.
        exact: of each, whether everything in the file but the seconds is the same to the last bit.
        same_build: whether the file was written by this version of the solver, compiled by the same packages for the
            same processor. Then everything is compared. Another build rounds otherwise, and where the step control
            decides on the last bit, the steps after it are others: then status, force and results are compared, and the
            accuracy is what can be asked for.
        tolerance: largest difference at which they agree: rounding, or for another build the accuracy of the file.
    """

    indices: np.ndarray
    differences: np.ndarray
    exact: np.ndarray
    same_build: bool
    tolerance: float

    @property
    def identical(self) -> int:
        """How many agree to the last bit."""
        return int(np.sum(self.exact))

    @property
    def bad(self) -> np.ndarray:
        """The trajectories that do not agree to the tolerance."""
        return self.indices[~(self.differences <= self.tolerance)]

    @property
    def agrees(self) -> bool:
        """Whether all agree to the tolerance."""
        return len(self.bad) == 0


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
    dataset = load_dataset(path, native=True)
    campaign = campaign_of(dataset.attributes)
    for name in QUANTITIES:
        if not agree(campaign.protocols[name][dataset.columns["index"]], dataset.protocols[name]):
            raise ValueError(f"protocols must be those of the design; received {str(path)!r} with another {name}")
    rows = np.random.default_rng(seed).permutation(len(dataset))[: whole_number("sample", sample, low=1)]
    written = untabulate(dataset.columns)
    chosen = {written[row].index: written[row] for row in np.sort(rows)}
    same_build = _same_build(dataset.attributes, campaign.identity(solver)["solver"])
    found: dict[int, tuple[float, bool]] = {}
    with LocalPool(workers) as pool:
        for arrival in results(campaign, np.array(list(chosen)), pool, solver):
            for record in arrival.records:
                parts = _differences(record, chosen[record.index])
                compared = [value for name, value in parts.items() if same_build or name in OF_ANY_BUILD]
                found[record.index] = max(compared), max(parts.values()) == 0.0
    return Verification(
        indices=np.array(list(chosen)),
        differences=np.array([found[index][0] for index in chosen]),
        exact=np.array([found[index][1] for index in chosen]),
        same_build=same_build,
        tolerance=ROUNDING if same_build else resolve_accuracy(campaign.accuracy).target,
    )


def _same_build(attributes: dict[str, Any], solver: str) -> bool:
    here = versions()
    hosts, builds = (
        value if isinstance(value, list) else [value] for value in (attributes["host"], attributes["versions"])
    )
    return (
        attributes["campaign"]["solver"] == solver
        and all(one.rpartition(" cores of ")[2] == host().rpartition(" cores of ")[2] for one in hosts)
        and all(one.get(name) == here.get(name) for one in builds for name in OF_THE_BUILD)
    )


def _differences(record: Record, written: Record) -> dict[str, float]:
    """By name, how far two records of one trajectory are apart; zero where they agree to the last bit."""
    found = {
        "status": 0.0 if record.status == written.status else np.inf,
        "reason": 0.0 if record.reason == written.reason else np.inf,
        "force": _apart(record.force, written.force),
    }
    for name in set(SCALARS) - {"solver_seconds"}:
        found[name] = _apart(np.array([record.scalars[name]]), np.array([written.scalars[name]]))
    for name in set(SCALARS) - {*RESULTS, "nodes", "solver_seconds"}:
        found[name] = np.inf if found[name] else 0.0
    for column, name in enumerate(JUMP_QUANTITIES):
        found[f"jumps/{name}"] = _apart(record.jumps[:, column], written.jumps[:, column])
    if (record.native is None) != (written.native is None):
        found["native"] = np.inf
    elif record.native is not None and written.native is not None:
        rows = zip(record.native, written.native, strict=True)
        found |= {f"native/{number}": _apart(*pair) for number, pair in enumerate(rows)}
    return found


def _apart(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Largest difference relative to the largest of theirs; infinite for other shapes, or where one is not finite."""
    if ours.shape != theirs.shape:
        return np.inf
    differ = (ours != theirs) & ~(np.isnan(ours) & np.isnan(theirs))
    if not np.any(differ):
        return 0.0
    size = float(np.max(np.abs(theirs)))
    step = float(np.max(np.abs(ours.astype(np.float64) - theirs)[differ]))
    return step / size if np.isfinite(step) and np.isfinite(size) and size > 0.0 else np.inf
