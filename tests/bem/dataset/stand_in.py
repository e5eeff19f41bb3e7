"""Stand-ins for the solver, importable by worker processes: closed forms, no contact mechanics."""

import os
import signal
import time
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
from loky import get_reusable_executor

from bem.accuracy import resolve_accuracy
from bem.materials import Elastic, StandardLinearSolid
from bem.protocol import LoadingProtocol, history_of
from bem.scene import Scene
from bem.trajectory import Jump, Statistics, Trajectory


def whole(path, instants, force, jump, accuracy, **more):
    """A completed trajectory along a history, of `force(times, depths)`, with a jump where one is given."""
    time_ = np.unique(np.concatenate([np.linspace(path.times[0], path.times[-1], instants), path.times]))
    time_ = np.insert(time_, 5, time_[5])
    depth = path.indentation_at(time_)
    counts = dict.fromkeys((field.name for field in fields(Statistics)), 3)
    return Trajectory(
        time_,
        depth,
        force(time_, depth),
        np.sqrt(np.maximum(depth, 0.0)),
        status="completed",
        jumps=(Jump(float(time_[5]), float(depth[5]), *jump),) if jump else (),
        stats=Statistics(
            **counts | {"seconds": 1e-3, "steps_by_phase": {"loading": 2, "unloading": 1}, "nodes": 1.0 / 7.0}
        ),
        accuracy=resolve_accuracy(accuracy).target,
        unloading=np.diff(depth, prepend=depth[0]) < 0.0,
        **more,
    )


def solve(scene, protocol, accuracy="standard"):
    path = protocol.history(scene.tabor)

    def force(times, depths):
        """The largest is the last one, the smallest that at the peak indentation."""
        part = times / times[-1]
        return (1.0 + scene.tabor) * 6.0 * part**8 - depths * np.exp(-part)

    jump = (0.5, scene.tabor, 0.0, 0.0) if scene.tabor > 1.0 else None
    return whole(path, 40 + int(10 * scene.tabor), force, jump, accuracy)


def slow(scene, protocol, accuracy="standard"):
    time.sleep(0.01)
    return solve(scene, protocol, accuracy)


def sometimes_fails(scene, protocol, accuracy="standard"):
    if scene.tabor > 3.0:
        raise ArithmeticError("tabor is too large for me")
    status = "no stable equilibrium found" if scene.tabor < 0.25 else "completed"
    return replace(solve(scene, protocol, accuracy), status=status)


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
    return replace(history, force=history.force * (1.0 + history.accuracy))


def case(quantities):
    """Scene and protocol of some quantities."""
    rest = {name: float(value) for name, value in quantities.items()}
    return Scene(tabor=rest.pop("tabor")), LoadingProtocol(**rest)


def restart_workers():
    """Workers see a variable of the environment only when they start after it was set."""
    get_reusable_executor().shutdown(wait=True)


def follow(scene, protocol, accuracy="standard"):
    """A whole trajectory along any protocol, with a jump where the Tabor parameter is large."""
    return whole(
        history_of(protocol, scene.tabor),
        30 + int(scene.tabor),
        lambda times, depths: scene.tabor / 3.0 - depths * np.exp(-times) * scene.material.modulus_ratio,
        (1.0 / 3.0, 0.1, 0.0, 1.0) if scene.tabor > 1.0 else None,
        accuracy,
        energy_balance=1.0 / 9.0 if isinstance(scene.material, Elastic) else np.nan,
    )


def stops_early_until_mended(scene, protocol, accuracy="standard"):
    complete = follow(scene, protocol, accuracy)
    if isinstance(scene.material, StandardLinearSolid) or Path(os.environ["STAND_IN_MARKER"]).exists():
        return complete
    if isinstance(scene.material, Elastic):
        raise ArithmeticError("too elastic")
    begin = {name: getattr(complete, name)[:10] for name in ("time", "indentation", "force", "contact_radius")}
    return replace(complete, **begin, unloading=complete.unloading[:10], status="stopped")
