"""Trajectories that guard the results of the solver: one for each part that a change can affect.

`make golden-trajectories` writes them again after a change that was meant to change results, once
`bem.methods.version.SOLVER_VERSION` has been raised.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import bem
from bem import Elastic, HardContact, LoadingProtocol, PiecewiseLinearProtocol, PronySeries, Scene
from bem._support.outputs import whole_file
from bem.methods.version import SOLVER_VERSION

GOLDEN = Path(__file__).with_suffix(".json")
QUANTITIES = ("pull_off_force", "pull_off_time", "max_compression", "end_force")


def cases() -> dict[str, tuple[Scene, Any, str]]:
    """Scene, protocol and accuracy by name."""
    names = ("peak_indentation", "loading_rate", "dwell_time", "unloading_rate")

    def ramps(*values: float) -> LoadingProtocol:
        return LoadingProtocol(**dict(zip(names, values, strict=True)))

    cycle, slow, fast = ramps(5.0, 10.0, 0.1, 10.0), ramps(3.0, 0.2, 1.0, 0.2), ramps(30.0, 500.0, 0.01, 500.0)
    twice = PiecewiseLinearProtocol([0.0, 1.0, 2.0, 3.0, 4.0], [-2.0, 3.0, -2.0, 3.0, -2.0])
    return {
        "standard linear solid": (Scene(1.0, bem.StandardLinearSolid(0.1)), cycle, "standard"),
        "draft": (Scene(1.0, bem.StandardLinearSolid(0.1)), cycle, "draft"),
        "fast and deep": (Scene(2.0, bem.StandardLinearSolid(0.1)), fast, "standard"),
        "slow, with jumps": (Scene(3.0, bem.StandardLinearSolid(0.1)), slow, "standard"),
        "long range": (Scene(0.2, bem.StandardLinearSolid(0.1)), cycle, "standard"),
        "elastic": (Scene(2.0, Elastic()), cycle, "standard"),
        "elastic, short range": (Scene(6.0, Elastic()), cycle, "standard"),
        "two relaxation times, two cycles": (Scene(1.0, PronySeries([0.5, 0.3], [0.1, 2.0])), twice, "standard"),
        "without adhesion": (Scene(1.0, bem.StandardLinearSolid(0.1), HardContact()), cycle, "standard"),
        "stiff": (Scene(0.05, bem.StandardLinearSolid(0.01)), slow, "standard"),
    }


def computed() -> dict[str, dict[str, float]]:
    """The guarded quantities of each case, computed by the present solver."""
    quantities = {}
    for name, (scene, protocol, accuracy) in cases().items():
        trajectory = bem.simulate(scene, protocol, accuracy)
        quantities[name] = {quantity: getattr(trajectory, quantity) for quantity in QUANTITIES}
        quantities[name]["work"] = trajectory.work()
    return quantities


def main() -> None:
    """Write the quantities of the present solver."""
    with whole_file(GOLDEN) as temporary:
        golden = {"solver_version": SOLVER_VERSION, "trajectories": computed()}
        temporary.write_text(json.dumps(golden, indent=1) + "\n", encoding="utf-8")
    print(f"{GOLDEN.name}: {len(cases())} trajectories of solver version {SOLVER_VERSION}")


if __name__ == "__main__":
    main()
