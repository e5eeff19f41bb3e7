"""Compare a data set with its trajectories computed again, on any processor.

Another processor rounds differently. Where the step control depends on a last bit, all later steps change, and two
correct solutions differ by about the sum of their errors. Agreement is therefore judged by the accuracy of the data
set: each solution may err by the target, so two may differ by twice the target. Identity to the last bit is counted
separately. Steps, iterations and jumps are not judged.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bem._support.validation import FloatArray, whole_number
from bem.dataset.campaign import Campaign, Solver
from bem.dataset.designs import QUANTITIES, agree
from bem.dataset.executors import LocalExecutor, results
from bem.dataset.file import load_dataset
from bem.dataset.records import FAILED, Record, untabulate
from bem.problem.accuracy import resolve_accuracy

JUDGED = ("pull-off force", "hysteresis", "force history, mean", "force history, any step")
"""What is compared with the allowed difference; `differences` says how."""
NEARLY_CLOSED = 0.01
"""Share of the energy exchanged below which a loop is too thin for an error relative to its own area."""


@dataclass(frozen=True)
class Verification:
    """How a sample of a data set compares with the same trajectories computed again.

    Args:
        indices: the trajectories computed again, increasing, shape (n,).
        differences: by the names of `JUDGED`, of each trajectory, shape (n,); infinite where it completed only once.
        identical: of each, whether everything in the file but the seconds is the same to the last bit, shape (n,).
        allowed: largest difference at which they agree, twice the target error of the data set.
    """

    indices: NDArray[np.int64]
    differences: dict[str, FloatArray]
    identical: NDArray[np.bool_]
    allowed: float

    @property
    def disagreeing(self) -> NDArray[np.int64]:
        """The trajectories of which something differs by more than is allowed."""
        return self.indices[np.max(list(self.differences.values()), axis=0) > self.allowed]

    @property
    def agrees(self) -> bool:
        """Whether no trajectory disagrees."""
        return len(self.disagreeing) == 0

    def __str__(self) -> str:
        """A table of the largest differences, and the verdict."""
        bad, size = self.disagreeing, len(self.indices)
        lines = [
            f"{size} trajectories computed again, {np.sum(self.identical)} of them identical to the last bit",
            f"{'':25}largest difference   allowed",
            *(f"{name:25}{np.max(values):18.1e}{self.allowed:10g}" for name, values in self.differences.items()),
        ]
        verdict = "PASS: all agree"
        if len(bad):
            shown = ", ".join(map(str, bad[:10])) + (", ..." if len(bad) > 10 else "")
            verdict = f"FAIL: {len(bad)} of {size} do not agree: {shown}"
        return "\n".join([*lines, verdict])


def verify(
    path: str | Path,
    *,
    sample: int = 20,
    seed: int | None = None,
    workers: int | None = None,
    solver: Solver | None = None,
    progress: Callable[[int, int, int], None] = lambda _done, _disagreeing, _total: None,
) -> Verification:
    """Compute a random sample of a data set again and compare.

    Args:
        path: the data set file.
        sample: how many trajectories; all of them where there are fewer.
        seed: of the random choice; another one at each call by default.
        workers: processes of this machine.
        solver: a stand-in for `bem.simulate`.
        progress: called with the number of trajectories done, of those that do not agree, and of all.

    Returns:
        The differences of the sample, the largest one allowed, and which trajectories exceed it.

    Raises:
        FileNotFoundError, ValueError: not a data set, or its protocols are not those of its design.
    """
    dataset = load_dataset(path, native=True)
    campaign = Campaign.of(dataset.attributes["campaign"])
    for name in QUANTITIES:
        if not agree(campaign.protocols[name][dataset.columns["index"]], dataset.protocols[name]):
            raise ValueError(f"protocols must be those of the design; received {str(path)!r} with another {name}")
    rows = np.random.default_rng(seed).permutation(len(dataset))[: whole_number("sample", sample, low=1)]
    indentations = dataset.grid()[1]
    written = untabulate(dataset.columns, campaign.layout)
    chosen = {written[row]["index"]: (written[row], indentations[row]) for row in np.sort(rows)}
    allowed = 2.0 * resolve_accuracy(campaign.accuracy).target
    comparisons: dict[int, tuple[dict[str, float], bool]] = {}
    disagreeing = 0
    with LocalExecutor(workers) as executor:
        progress(0, 0, len(chosen))
        for arrival in results(campaign, np.array(list(chosen)), executor, solver):
            for record in arrival.records:
                theirs, path_of_it = chosen[record["index"]]
                apart = differences(record, theirs, path_of_it)
                comparisons[record["index"]] = apart, identical(record, theirs)
                disagreeing += max(apart.values()) > allowed
            progress(len(comparisons), disagreeing, len(chosen))
    return Verification(
        indices=np.array(list(chosen)),
        differences={name: np.array([comparisons[index][0][name] for index in chosen]) for name in JUDGED},
        identical=np.array([comparisons[index][1] for index in chosen]),
        allowed=allowed,
    )


def differences(ours: Record, theirs: Record, indentation: FloatArray) -> dict[str, float]:
    """How far two records of one trajectory, of `indentation` (N,) at the steps, are apart, by the names of `JUDGED`.

    The difference of the pull-off force is relative to itself; that of the hysteresis to itself or, for a loop that is
    nearly closed, to a hundredth of the energy exchanged; that of the force history to its range. Its mean is over all
    steps. A single step may lie on either side of a jump or a steep fall. It is therefore compared with the range of
    the other record from the step before it to the step after it.
    """
    if ours["status"] == theirs["status"] == FAILED:
        return dict.fromkeys(JUDGED, 0.0)
    force, their_force = (np.asarray(record["fms/force"], dtype=np.float64) for record in (ours, theirs))
    names = ("scalars/pull_off_force", "scalars/hysteresis")
    results = np.array([[record[name] for name in names] for record in (ours, theirs)])
    # A trajectory that failed once, or is not finite, agrees with nothing.
    if not all(np.all(np.isfinite(values)) for values in (force, their_force, results)):
        return dict.fromkeys(JUDGED, np.inf)
    exchanged = np.sum(0.5 * np.abs(their_force[1:] + their_force[:-1]) * np.abs(np.diff(indentation)))
    outside = max(_outside(force, their_force), _outside(their_force, force), 0.0)
    errors = (*np.abs(results[0] - results[1]), np.mean(np.abs(force - their_force)), outside)
    pull_off_force, hysteresis = np.abs(results[1])
    scales = (pull_off_force, max(hysteresis, NEARLY_CLOSED * exchanged), np.ptp(their_force), np.ptp(their_force))
    return {name: float(e / max(s, 1e-300)) for name, e, s in zip(JUDGED, errors, scales, strict=True)}


def identical(ours: Record, theirs: Record) -> bool:
    """Whether two records are the same to the last bit, but for the seconds."""
    numbers = ours.keys() - {"reason", "scalars/solver_seconds"}
    same = ours["reason"] == theirs["reason"]
    return same and all(np.array_equal(ours[name], theirs[name], equal_nan=True) for name in numbers)


def _outside(force: FloatArray, reference: FloatArray) -> float:
    """Largest distance of a force (N,) from the range of another one at the same step and its two neighbours."""
    around = np.lib.stride_tricks.sliding_window_view(np.pad(reference, 1, mode="edge"), 3)
    return float(np.max(np.maximum(around.min(axis=1) - force, force - around.max(axis=1))))
