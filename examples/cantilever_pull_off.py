"""What the cantilever of an atomic force microscope does to the measured pull-off.

A tip on a polymer is approached and retracted by cantilevers of several stiffnesses. A soft one jumps into and out of
contact, because no position of the tip is stable where adhesion falls faster with distance than the cantilever pulls;
the part of the curve between is never measured. The elastic pull-off force does not depend on the cantilever. That of a
viscoelastic solid does: a stretched cantilever keeps pulling while the edge of the contact retreats slowly.

Run: `python examples/cantilever_pull_off.py [PICTURE]`. It draws force against displacement of the stage into
`cantilever_pull_off.png`, or the file named.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bem import Elastic, StandardLinearSolid
from bem.lab import ForceCurve, Setup
from bem.lab.units import readable
from bem.plots import COLOURS

TIP = Setup(
    radius=20e-9,
    work_of_adhesion=0.05,
    relaxed_modulus=1e9,
    poisson_ratio=0.35,
    retardation_time=0.01,
    material=StandardLinearSolid(modulus_ratio=0.3),
)
CANTILEVERS = (0.5, 3.0, 40.0, None)  # N/m; the last is a rigid one
COLORS = [COLOURS[name] for name in ("M1", "M5", "M3", "M2")]  # which readers of all eyes tell apart
DEPTH, SPEED = 3e-9, 2e-7  # m, m/s, of the stage
AWAY = 25e-9  # m, from where the softest is sure to let go


@dataclass(frozen=True)
class Pull:
    """What one cantilever measures."""

    stiffness: float | None
    elastic: ForceCurve
    viscoelastic: ForceCurve

    @property
    def travel(self) -> float:
        """How far the tip jumps off the viscoelastic solid, in m: its largest move at one instant while retracting."""
        curve = self.viscoelastic
        at_once = np.diff(curve.time) == 0.0
        return float(np.max(-np.diff(curve.indentation)[at_once], initial=0.0))


def pull(stiffness: float | None, accuracy: str | float = "standard") -> Pull:
    """Approach and retract with a cantilever, of a rubbery elastic solid and of the viscoelastic one."""
    curves = []
    for material in (Elastic(), TIP.material):
        setup = TIP.replaced(material=material, stiffness=stiffness)
        protocol = setup.protocol(
            peak_indentation=DEPTH, loading_rate=SPEED, unloading_rate=SPEED, start_indentation=-AWAY
        )
        curves.append(setup.simulate(protocol, accuracy))
    return Pull(stiffness, *curves)


def name_of(stiffness: float | None) -> str:
    """A cantilever in words."""
    return "rigid" if stiffness is None else readable(stiffness, "N/m")


def draw(pulls: list[Pull], path: str | Path) -> None:
    """Force on the viscoelastic solid against the displacement of the stage, and against the indentation of the tip."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    measured, contact = figure.subplots(1, 2, sharey=True)
    for each, color in zip(pulls, COLORS, strict=True):
        curve = each.viscoelastic
        stage = curve.indentation if curve.stage is None else curve.stage
        for axes, where in ((measured, stage), (contact, curve.indentation)):
            axes.plot(where * 1e9, curve.tension * 1e9, color=color, linewidth=1.2, label=name_of(each.stiffness))
    for axes in (measured, contact):
        axes.axhline(0.0, color="0.8", linewidth=0.8, zorder=0)
        axes.spines[["top", "right"]].set_visible(False)
    measured.set(
        xticks=range(-15, 5, 5), xlabel="displacement of the stage (nm)", xlim=(-18.0, 4.0), ylim=(-13.0, 13.0)
    )
    measured.set_ylabel("force (nN), tension positive")
    contact.set(xlabel="indentation of the tip (nm)", xlim=(-6.0, 3.0))
    measured.legend(title="cantilever", frameon=False)
    figure.savefig(path, dpi=150)


def main(path: str | Path = "cantilever_pull_off.png") -> None:
    """Print what each cantilever measures, and draw it."""
    pulls = [pull(stiffness) for stiffness in CANTILEVERS]
    print("cantilever   pull-off, elastic   pull-off, viscoelastic   jump off by")
    for each in pulls:
        forces = [readable(curve.pull_off_force, "N") for curve in (each.elastic, each.viscoelastic)]
        jump = readable(each.travel, "m") if each.travel > 0.0 else "no jump"
        print(f"{name_of(each.stiffness):12} {forces[0]:19} {forces[1]:24} {jump}")
    draw(pulls, path)


if __name__ == "__main__":
    main(*sys.argv[1:2])
