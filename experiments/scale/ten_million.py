"""Ten million trajectories on a thousand cores: an estimate from the measurement of `bench_campaign`."""

from __future__ import annotations

import math
from typing import Any

TRAJECTORIES, CORES, NODE = 10_000_000, 1000, 64
"""Trajectories and cores of the estimate, and cores of one machine."""


def estimate(content: dict[str, Any]) -> dict[str, float]:
    """Estimate of time, storage and limits.

    Args:
        content: The measurement of `bench_campaign`.

    Returns:
        `core_hours`; `minutes` on all cores, start and tail included; `file_bytes`, and `part_bytes` of the checkpoints
        before; `cores_fed`, the cores for which one process can save, and `cores_scheduled`, with Dask's scheduling
        included; `shards`, one for each machine; `drawing_minutes`, in which each shard draws all protocols;
        `merging_minutes`; and `merging_bytes` of memory.
    """
    one, trajectory, dask = content["one_process"], content["trajectory"], content["dask"]
    slowest = max(tail["tail"] for tail in content["tails"] if tail["workers"] <= NODE)
    drawing, start = one["drawing"] * TRAJECTORIES, sum(content["start"].values())
    shards = math.ceil(CORES / NODE)
    work = trajectory * TRAJECTORIES
    alone = (one["saving"] + one["writing"]) * TRAJECTORIES / shards
    return {
        "core_hours": work / 3600.0,
        "minutes": (max(work / CORES * (1.0 + slowest), alone) + start + drawing) / 60.0,
        "file_bytes": one["bytes"] * TRAJECTORIES,
        "part_bytes": one["part_bytes"] * TRAJECTORIES,
        "cores_fed": trajectory / one["saving"],
        "cores_scheduled": trajectory / (one["saving"] + dask["central"]),
        "shards": shards,
        "drawing_minutes": drawing / 60.0,
        "merging_minutes": one["merging"] * TRAJECTORIES / 60.0,
        "merging_bytes": one["held_bytes"] * TRAJECTORIES,
    }


def page_text(content: dict[str, Any]) -> str:
    """The estimate as a Markdown table, for docs/cluster.md."""
    found, dask, one = estimate(content), content["dask"], content["one_process"]
    tails = {tail["workers"]: 100.0 * tail["tail"] for tail in content["tails"]}
    rows = [
        ("A trajectory, published data set", f"{1e3 * content['trajectory']:.1f} ms"),
        (
            "Start: the command, then a worker",
            " s, ".join(f"{value:.1f}" for value in content["start"].values()) + " s",
        ),
        ("Saved by one process, for each trajectory", f"{1e6 * one['saving']:.0f} µs"),
        (
            f"Scheduled by Dask, {dask['workers']} workers, for each trajectory",
            f"{1e6 * dask['scheduling']:.0f} µs, {100.0 * dask['share']:.1f} % of {1e3 * dask['seconds']:g} ms; "
            f"{100.0 * dask['idle']:.1f} % of a core without work",
        ),
        (
            f"Wait for the last worker, {' / '.join(map(str, tails))} workers",
            " / ".join(f"{value:.1f}" for value in tails.values()) + " %",
        ),
        ("Stored for each trajectory", f"{one['bytes']:.0f} bytes, {one['part_bytes']:.0f} while under way"),
        ("**All trajectories**", f"**{found['core_hours']:.0f} core-hours**"),
        (
            f"Minutes on {CORES:,} cores, {found['shards']} shards of {NODE} processes",
            f"**{found['minutes']:.1f}**, of which {found['drawing_minutes']:.1f} to draw the protocols in every shard",
        ),
        ("File", f"**{found['file_bytes'] / 1e9:.1f} GB**, {found['part_bytes'] / 1e9:.1f} GB of parts before"),
        (
            "Merging the shards, one process",
            f"{found['merging_minutes']:.0f} minutes, {found['merging_bytes'] / 1e9:.0f} GB of memory at least",
        ),
        (
            "Cores that one process can save for",
            f"{found['cores_fed']:.0f}, {found['cores_scheduled']:.0f} with Dask",
        ),
    ]
    table = "\n".join(f"| {name} | {value} |" for name, value in rows)
    where = f"\n\nProcessor seconds of {content['host']}." if "host" in content else ""
    return f"| {TRAJECTORIES:,} trajectories | |\n| --- | --- |\n{table}{where}"
