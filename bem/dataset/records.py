"""What a campaign stores of each trajectory, as a record and as columns of arrays.

Units as in `bem.protocol`; forces in pi R dgamma, tension positive.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bem._support.validation import FloatArray
from bem.dataset.measurement_steps import FMS, grid_of
from bem.materials import Elastic, StandardLinearSolid
from bem.protocol import LoadingProtocol
from bem.scene import Scene

COMPLETED, FAILED = 0, 1
"""Values of `status`."""

RESULTS = ("pull_off_force", "pull_off_time", "hysteresis", "max_compression", "end_force")
SCALARS = {
    **dict.fromkeys(RESULTS, np.float64),
    "solver_seconds": np.float64,
    "steps": np.int32,
    "rejections": np.int32,
    "iterations": np.int32,
    "nodes": np.float64,
    "jump_count": np.int32,
}
JUMP_QUANTITIES = ("time", "indentation", "force_before", "force_after")
NATIVE_QUANTITIES = ("time", "indentation", "force", "contact_radius")

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How every trajectory of a campaign is simulated and measured.

    Args:
        modulus_ratio: relaxed over instantaneous modulus, of trajectories that do not say their own.
        accuracy: as in `bem.simulate`.
        counts: measurement points in loading, dwell and unloading.
        native: whether the solver's own, adaptive history is kept too.
        steps: 'uniform' or 'physical', see `bem.dataset.physical_steps`.
    """

    modulus_ratio: float = 0.1
    accuracy: str | float = "standard"
    counts: tuple[int, int, int] = FMS
    native: bool = False
    steps: str = "uniform"


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """One trajectory; forces and results are NaN where it failed.

    Args:
        index: its place in the design.
        status: `COMPLETED` or `FAILED`.
        reason: why it failed, empty otherwise.
        force: force at the measurement instants, float32, shape (N,).
        scalars: a number for each of `SCALARS`.
        jumps: one row of `JUMP_QUANTITIES` for each jump, shape (j, 4).
        native: rows `NATIVE_QUANTITIES` of the solver's own history, shape (4, m), or `None`.
    """

    index: int
    status: int
    reason: str
    force: NDArray[np.float32]
    scalars: Mapping[str, float]
    jumps: FloatArray
    native: FloatArray | None = None


def failed(index: int, reason: str, settings: Settings, **scalars: float) -> Record:
    """The record of a trajectory without a result, however far the solver came."""
    return Record(
        index=index,
        status=FAILED,
        reason=reason,
        force=np.full(sum(settings.counts), np.nan, dtype=np.float32),
        scalars={name: np.nan if kind is np.float64 else 0 for name, kind in SCALARS.items()} | scalars,
        jumps=np.empty((0, len(JUMP_QUANTITIES))),
        native=np.empty((len(NATIVE_QUANTITIES), 0)) if settings.native else None,
    )


def simulate_record(index: int, quantities: Mapping[str, float], settings: Settings, solver: Callable) -> Record:
    """Simulate one protocol and keep what the data set holds; an error of the solver becomes a failed record.

    Args:
        index: place of the protocol in its design.
        quantities: tabor, peak_indentation, loading_rate, dwell_time, unloading_rate, and the modulus ratio if it is
            not that of all.
        settings: how to simulate and measure.
        solver: `bem.simulate` or a stand-in with its signature.
    """
    rest = {name: float(value) for name, value in quantities.items()}
    tabor, ratio = rest.pop("tabor"), rest.pop("modulus_ratio", settings.modulus_ratio)
    # One failing case must not end the batch, whatever error it raises.
    try:
        material = StandardLinearSolid(ratio) if ratio < 1.0 else Elastic()
        protocol = LoadingProtocol(**rest)
        trajectory = solver(Scene(tabor=tabor, material=material), protocol, accuracy=settings.accuracy)
        times, _ = grid_of(settings.steps, {"tabor": tabor, **rest}, ratio, settings.counts)
        return _kept(index, trajectory, times[0], settings)
    except Exception as error:
        return failed(index, f"{type(error).__name__}: {error}", settings)


def _kept(index: int, trajectory: Any, times: FloatArray, settings: Settings) -> Record:
    work = {
        "solver_seconds": trajectory.stats.seconds,
        **{name: getattr(trajectory.stats, name) for name in ("steps", "rejections", "iterations", "nodes")},
        "jump_count": len(trajectory.jumps),
    }
    if not trajectory.completed:
        return failed(index, trajectory.status, settings, **work)
    force = np.asarray(trajectory.at(times), dtype=np.float32)
    scalars = {name: float(getattr(trajectory, name)) for name in RESULTS} | work
    jumps = [[getattr(jump, name) for name in JUMP_QUANTITIES] for jump in trajectory.jumps]
    native = np.stack([getattr(trajectory, name) for name in NATIVE_QUANTITIES]) if settings.native else None
    kept = (force, list(scalars.values()), jumps, [] if native is None else native)
    if not all(np.all(np.isfinite(numbers)) for numbers in kept):
        return failed(index, "the solver returned numbers that are not finite", settings, **work)
    return Record(
        index=index,
        status=COMPLETED,
        reason="",
        force=force,
        scalars=scalars,
        jumps=np.array(jumps, dtype=np.float64).reshape(-1, len(JUMP_QUANTITIES)),
        native=native,
    )


def tabulate(records: Iterable[Record], settings: Settings) -> Columns:
    """Arrays named by their path in the file, trajectories in the order of their index."""
    ordered = sorted(records, key=lambda record: record.index)
    columns: Columns = {
        "index": np.array([record.index for record in ordered], dtype=np.int64),
        "status": np.array([record.status for record in ordered], dtype=np.uint8),
        "reason": np.array([record.reason for record in ordered], dtype=object),
        "fms/force": np.array([record.force for record in ordered], dtype=np.float32).reshape(-1, sum(settings.counts)),
    }
    for name, kind in SCALARS.items():
        columns[f"scalars/{name}"] = np.array([record.scalars[name] for record in ordered], dtype=kind)
    owners = [np.full(len(record.jumps), record.index, dtype=np.int64) for record in ordered]
    columns["jumps/trajectory"] = np.concatenate([np.empty(0, dtype=np.int64), *owners])
    jumps = np.concatenate([np.empty((0, len(JUMP_QUANTITIES))), *(record.jumps for record in ordered)])
    columns |= {f"jumps/{name}": jumps[:, i].copy() for i, name in enumerate(JUMP_QUANTITIES)}
    if settings.native:
        lengths = [record.native.shape[1] for record in ordered]
        columns["native/offsets"] = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
        for i, name in enumerate(NATIVE_QUANTITIES):
            columns[f"native/{name}"] = np.concatenate([np.empty(0), *(record.native[i] for record in ordered)])
    return columns


def untabulate(columns: Columns) -> list[Record]:
    """The records of such columns, the inverse of `tabulate`."""
    jumps = np.stack([columns[f"jumps/{name}"] for name in JUMP_QUANTITIES], axis=1)
    owners = columns["jumps/trajectory"]
    offsets = columns.get("native/offsets")
    native = None if offsets is None else np.stack([columns[f"native/{name}"] for name in NATIVE_QUANTITIES])
    return [
        Record(
            index=int(index),
            status=int(columns["status"][row]),
            reason=str(columns["reason"][row]),
            force=columns["fms/force"][row],
            scalars={name: columns[f"scalars/{name}"][row] for name in SCALARS},
            jumps=jumps[slice(*np.searchsorted(owners, [index, index + 1]))],
            native=None if native is None else native[:, offsets[row] : offsets[row + 1]],
        )
        for row, index in enumerate(columns["index"])
    ]
