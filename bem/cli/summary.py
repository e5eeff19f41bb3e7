"""What `bem simulate` prints and writes of a trajectory: text for people, JSON, CSV, and a title for its picture."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

MOST_FORCES = 4
"""Forces named in a title, which has to fit over the picture."""
STILL_ATTACHED = "still attached at the end: the pull-off force is the largest so far"


def title(scene: Any, protocol: Any) -> str:
    """Scene and protocol, a line for each."""
    material = type(scene.material).__name__.replace("StandardLinearSolid", "standard linear solid")
    if hasattr(scene.material, "modulus_ratio"):
        material += f" of modulus ratio {scene.material.modulus_ratio:g}"
    contact = f"Tabor parameter {scene.tabor:g}, {material}"
    if not hasattr(protocol, "peak_indentation"):
        forces = [f"{force:g} at {time:g}" for time, force in zip(protocol.times, protocol.forces, strict=True)]
        more = f", ... ({len(forces)} in all)" if len(forces) > MOST_FORCES else ""
        return f"{contact}\nforces {', '.join(forces[:MOST_FORCES])}{more}"
    return (
        f"{contact}\nindented to {protocol.peak_indentation:g} at rate "
        f"{protocol.loading_rate:g}, held for {protocol.dwell_time:g}, unloaded at rate {protocol.unloading_rate:g}"
    )


def write_csv(trajectory: Any, path: Path) -> None:
    """Write the arrays as comma-separated columns with a header."""
    import numpy as np

    names = arrays_of(trajectory)
    table = np.column_stack([getattr(trajectory, name) for name in names])
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="", fmt="%.10g")


def to_json(trajectory: Any) -> str:
    """Summary and arrays as JSON; NaN, which JSON does not have, becomes null."""
    from bem._support.text_files import plain

    return json.dumps(plain(trajectory.summary() | {name: getattr(trajectory, name) for name in arrays_of(trajectory)}))


def arrays_of(trajectory: Any) -> tuple[str, ...]:
    """Names of the arrays that are written; the stage has one of its own where a spring holds the sphere."""
    arrays = ("time", "indentation", "force", "contact_radius")
    return arrays if trajectory.spring is None else (*arrays, "stage")


def readable(trajectory: Any) -> str:
    """A short summary for people."""
    stats = trajectory.stats
    lines = [f"status           {trajectory.status}"]
    if trajectory.completed:
        lines += [
            f"pull-off force   {trajectory.pull_off_force:.5g}  at time {trajectory.pull_off_time:.6g}"
            if trajectory.pull_off_force > 0.0
            else "pull-off force   none",
            f"max compression  {trajectory.max_compression:.5g}",
            f"hysteresis       {trajectory.hysteresis:.5g}",
            f"work             {work_words(trajectory)}",
            f"end force        {trajectory.end_force:.5g}",
        ]
        if trajectory.pull_off_force > 0.0 and not trajectory.detached:
            lines.append(f"detached         no, {STILL_ATTACHED}")
    lines += [
        f"jump             at indentation {jump.indentation:.5g}{moved_words(jump)}: "
        f"force {jump.force_before:.4g} -> {jump.force_after:.4g}"
        for jump in trajectory.jumps
    ]
    lines.append(
        f"cost             {1e3 * stats.seconds:.1f} ms, {stats.steps} steps, {stats.nodes:.0f} nodes, "
        f"target error {trajectory.accuracy:g}, {stats.multiply_adds:.3g} multiply-adds in {stats.attempts} "
        f"attempt{'s' * (stats.attempts > 1)}, {stats.failed_attempts or 'none'} failed"
    )
    return "\n".join(lines)


def moved_words(jump: Any) -> str:
    """Where a jump takes the sphere, if elsewhere."""
    if math.isnan(jump.indentation_after):
        return " -> flown off"
    return "" if jump.indentation_after == jump.indentation else f" -> {jump.indentation_after:.5g}"


def work_words(trajectory: Any) -> str:
    """The signed work, and what a negative one means."""
    work = trajectory.work()
    if work >= 0.0:
        return f"{work:.5g}"
    if -work <= trajectory.accuracy * trajectory.turnover():
        return f"{work:.5g}: zero to the accuracy"
    return f"{work:.5g}: the contact gave energy back; not dissipation"
