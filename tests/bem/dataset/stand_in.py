"""Stand-ins for the solver, importable by worker processes: closed forms, no contact mechanics."""

import os
import time
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from bem.dataset.cases import ARRAYS
from bem.problem.accuracy import resolve_accuracy
from bem.problem.materials import Elastic, PronySeries
from bem.problem.protocol import history_of
from bem.results.trajectory import Jump, Statistics, Trajectory


def solve(scene, protocol, accuracy="standard"):
    """A trajectory along any history; the largest force is the last one, the smallest that at the peak indentation."""
    path = history_of(protocol, scene.tabor)
    time_ = np.linspace(path.times[0], path.times[-1], 40 + int(10 * scene.tabor))
    time_ = np.unique(np.concatenate([time_, path.times]))
    time_ = np.insert(time_, 5, time_[5])
    depth, share = path.indentation_at(time_), time_ / time_[-1]
    force = (1.0 + scene.tabor) * 6.0 * share**8 - depth * np.exp(-share) * (1.0 + scene.material.modulus_ratio)
    jump = Jump(float(time_[5]), float(depth[5]), 1.0 / 3.0, scene.tabor, 0.0, 0.0)
    counts = dict.fromkeys((field.name for field in fields(Statistics)), 3)
    counts |= {"seconds": 1e-3, "steps_by_phase": {"loading": 2, "unloading": 1}, "nodes": 1.0 / 7.0}
    return Trajectory(
        time_,
        depth,
        force,
        np.sqrt(np.maximum(depth, 0.0)),
        status="completed",
        jumps=(jump,) if scene.tabor > 1.0 else (),
        stats=Statistics(**counts),
        accuracy=resolve_accuracy(accuracy).target,
        unloading=np.diff(depth, prepend=depth[0]) < 0.0,
        energy_balance=1.0 / 9.0 if isinstance(scene.material, Elastic) else np.nan,
    )


def slow(scene, protocol, accuracy="standard"):
    time.sleep(0.01)
    return solve(scene, protocol, accuracy)


def sometimes_fails(scene, protocol, accuracy="standard"):
    if scene.tabor > 3.0:
        raise ArithmeticError("tabor is too large for me")
    status = "no stable equilibrium found" if scene.tabor < 0.25 else "completed"
    return replace(solve(scene, protocol, accuracy), status=status)


def fails_until_mended(scene, protocol, accuracy="standard"):
    complete = solve(scene, protocol, accuracy)
    if Path(os.environ["STAND_IN_MARKER"]).exists():
        return complete
    if scene.tabor > 3.0 or isinstance(scene.material, Elastic):
        raise ArithmeticError("not mended yet")
    begin = {name: getattr(complete, name)[:10] for name in ARRAYS}
    return replace(complete, **begin, status="stopped") if isinstance(scene.material, PronySeries) else complete
