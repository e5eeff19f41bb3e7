"""Stand-ins for the solver, importable by worker processes: closed forms, no contact mechanics."""

import os
import signal
import time
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from loky import get_reusable_executor

from bem.accuracy import resolve_accuracy
from bem.materials import Elastic, StandardLinearSolid
from bem.protocol import LoadingProtocol, history_of
from bem.scene import Scene
from bem.trajectory import Jump, Statistics, Trajectory


def work():
    return SimpleNamespace(seconds=1e-3, steps=7, rejections=1, iterations=20, nodes=12.5)


@dataclass
class History:
    time: np.ndarray
    indentation: np.ndarray
    force: np.ndarray
    status: str = "completed"
    jumps: tuple = ()
    stats: SimpleNamespace = field(default_factory=work)

    @property
    def completed(self):
        return self.status == "completed"

    @property
    def contact_radius(self):
        return np.sqrt(np.maximum(self.indentation, 0.0))

    @property
    def pull_off_force(self):
        return self.force.max()

    @property
    def pull_off_time(self):
        return self.time[self.force.argmax()]

    @property
    def hysteresis(self):
        return abs(np.trapezoid(self.force, self.indentation))

    @property
    def max_compression(self):
        return self.force.min()

    @property
    def end_force(self):
        return self.force[-1]

    def at(self, times):
        return np.interp(times, self.time, self.force)


def solve(scene, protocol, accuracy="standard"):
    path = protocol.history(scene.tabor)
    time_ = np.unique(np.concatenate([np.linspace(0.0, path.times[-1], 40 + int(10 * scene.tabor)), path.times]))
    depth = path.indentation_at(time_)
    # The largest force is the last one, the smallest at the peak indentation.
    force = (1.0 + scene.tabor) * 6.0 * (time_ / time_[-1]) ** 8 - depth * np.exp(-time_ / time_[-1])
    jumps = (Jump(time_[5], depth[5], 0.5, scene.tabor, 0.0, 0.0),) if scene.tabor > 1.0 else ()
    return History(time_, depth, force, jumps=jumps)


def slow(scene, protocol, accuracy="standard"):
    time.sleep(0.01)
    return solve(scene, protocol, accuracy)


def sometimes_fails(scene, protocol, accuracy="standard"):
    if scene.tabor > 3.0:
        raise ArithmeticError("tabor is too large for me")
    history = solve(scene, protocol, accuracy)
    if scene.tabor < 0.25:
        history.status = "no stable equilibrium found"
    return history


def kills_its_worker_once(scene, protocol, accuracy="standard"):
    marker = Path(os.environ["STAND_IN_MARKER"])
    if scene.tabor > 2.0 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return slow(scene, protocol, accuracy)


def kills_its_worker_always(scene, protocol, accuracy="standard"):
    if scene.tabor > 3.0 and protocol.peak_indentation > 90.0:
        os.kill(os.getpid(), signal.SIGKILL)
    return solve(scene, protocol, accuracy)


def fails_until_mended(scene, protocol, accuracy="standard"):
    if scene.tabor > 3.0 and not Path(os.environ["STAND_IN_MARKER"]).exists():
        raise ArithmeticError("not mended yet")
    return solve(scene, protocol, accuracy)


def rough(scene, protocol, accuracy="standard"):
    """Forces too large by the target error of the accuracy."""
    history = solve(scene, protocol, accuracy)
    history.force = history.force * (1.0 + resolve_accuracy(accuracy).target)
    return history


def case(quantities):
    """Scene and protocol of some quantities."""
    rest = {name: float(value) for name, value in quantities.items()}
    return Scene(tabor=rest.pop("tabor")), LoadingProtocol(**rest)


def restart_workers():
    """Workers see a variable of the environment only when they start after it was set."""
    get_reusable_executor().shutdown(wait=True)


def follow(scene, protocol, accuracy="standard"):
    """A whole trajectory along any protocol, with a jump where the Tabor parameter is large."""
    path = history_of(protocol, scene.tabor)
    time_ = np.unique(np.concatenate([np.linspace(path.times[0], path.times[-1], 30 + int(scene.tabor)), path.times]))
    time_ = np.insert(time_, 5, time_[5])
    depth = path.indentation_at(time_)
    force = scene.tabor / 3.0 - depth * np.exp(-time_) * scene.material.modulus_ratio
    jumps = (Jump(float(time_[5]), float(depth[5]), 1.0 / 3.0, 0.1, 0.0, 1.0),) if scene.tabor > 1.0 else ()
    counts = dict.fromkeys((field.name for field in fields(Statistics)), 3)
    stats = Statistics(**counts | {"steps_by_phase": {"loading": 2, "unloading": 1}, "nodes": 1.0 / 7.0})
    return Trajectory(
        time_,
        depth,
        force,
        np.sqrt(np.maximum(depth, 0.0)),
        status="completed",
        jumps=jumps,
        stats=stats,
        accuracy=resolve_accuracy(accuracy).target,
        unloading=np.diff(depth, prepend=depth[0]) < 0.0,
        energy_balance=1.0 / 9.0 if isinstance(scene.material, Elastic) else np.nan,
    )


def stops_early_until_mended(scene, protocol, accuracy="standard"):
    whole = follow(scene, protocol, accuracy)
    if isinstance(scene.material, StandardLinearSolid) or Path(os.environ["STAND_IN_MARKER"]).exists():
        return whole
    if isinstance(scene.material, Elastic):
        raise ArithmeticError("too elastic")
    begin = {name: getattr(whole, name)[:10] for name in ("time", "indentation", "force", "contact_radius")}
    return replace(whole, **begin, unloading=whole.unloading[:10], status="stopped")
