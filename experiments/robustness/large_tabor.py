"""Large Tabor parameters: pull-off against JKR, a viscoelastic edge against Persson and Brener, and the cost of both.

Elastic: loading and unloading to an indentation of mu at unit rates; the pull-off force tends to JKR's 3/2.
Viscoelastic: a standard linear solid of modulus ratio 0.1 in the same geometry, within one retardation time. Crack: the
relaxed contact at an indentation of 6 mu, unloaded to zero at 9 / mu h0 per retardation time, so that the edge passes
its cohesive zone at about the same speed for every mu. JKR's relation gives the apparent work of adhesion from force
and contact radius, Gamma = pi (P + 4 a^3 / (3 pi))^2 / (8 a^3); it is compared with the theory at the speed of the
edge. Times are processor seconds.

Usage: `python -m experiments large_tabor [--tabor MU ...] [--accuracy A] [--out FILE]`.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem import Elastic, LoadingProtocol, PiecewiseLinearProtocol, Scene, StandardLinearSolid, Trajectory, simulate
from bem.reference_solutions import jkr, persson_brener
from bem.solver.simulation import load_kernels
from experiments.common import write_result
from experiments.paper.persson_brener import beta_over_length_scale
from experiments.timing import MEASUREMENTS, plain

OUT = MEASUREMENTS / "large_tabor.json"
TABORS = (3.24, 10.0, 30.0, 50.0, 100.0)
RATIO = 0.1
SPEED = 9.0  # unloading rate times mu
MARGINS = (1.04, 0.95)  # compared contact radii: from 1.04 times the last to 0.95 times the first
POINTS = 20
HEADER = f"{'mu':>6} {'solid':>12} {'force':>8} {'expected':>8} {'CPU s':>8} {'nodes':>6} {'unknowns':>8} {'steps':>6}"


def timed(scene: Scene, protocol: Any, accuracy: str | float) -> tuple[Trajectory, dict[str, Any]]:
    """A trajectory, and its cost."""
    begin = time.process_time()
    trajectory = simulate(scene, protocol, accuracy)
    seconds = time.process_time() - begin
    stats = trajectory.stats
    return trajectory, {
        "tabor": scene.tabor,
        "status": trajectory.status,
        "cpu_seconds": seconds,
        "nodes": stats.nodes,
        "unknowns": stats.unknowns_per_solve,
        "grid_nodes": stats.grid_nodes,
        "steps": stats.steps,
        "jumps": len(trajectory.jumps),
    }


def cycle(tabor: float, material: Elastic | StandardLinearSolid, accuracy: str | float) -> dict[str, Any]:
    """Pull-off after loading to an indentation of mu."""
    rate = tabor if material.strengths.size else 1.0
    protocol = LoadingProtocol(peak_indentation=tabor, loading_rate=rate, dwell_time=1.0, unloading_rate=rate)
    trajectory, row = timed(Scene(tabor, material), protocol, accuracy)
    row |= {"pull_off_force": trajectory.pull_off_force}
    if not material.strengths.size:
        row |= {"expected": jkr.PULL_OFF_FORCE}
    return row


def apparent_work(force: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Apparent over thermodynamic work of adhesion, by JKR, from forces and contact radii of shape (n,)."""
    return np.pi * (force + 4.0 * radius**3 / (3.0 * np.pi)) ** 2 / (8.0 * radius**3)


def crack(tabor: float, accuracy: str | float) -> dict[str, Any]:
    """Apparent work of adhesion of a retreating edge, and the theory at its speed."""
    deep = 6.0 * tabor
    path = PiecewiseLinearProtocol([0.0, deep * tabor / SPEED], [deep, 0.0])
    trajectory, row = timed(Scene(tabor, StandardLinearSolid(RATIO)), path, accuracy)
    radius = trajectory.contact_radius
    chosen = np.linspace(MARGINS[0] * radius[-1], MARGINS[1] * radius[0], POINTS)
    instants = np.interp(-chosen, -radius, trajectory.time)
    near = np.interp(np.stack([0.97, 1.03])[:, None] * chosen, radius[::-1], trajectory.time[::-1])
    velocity = 0.06 * chosen / (near[0] - near[1]) * beta_over_length_scale(tabor)
    theory = persson_brener.effective_energy(velocity, RATIO)
    found = apparent_work(trajectory.at(instants), chosen)
    row |= {"crack_velocity": velocity.tolist(), "apparent_work": found.tolist(), "theory": theory.tolist()}
    return row | {"largest_deviation": float(np.max(np.abs(found / theory - 1.0)))}


def main(
    tabor: Annotated[list[float] | None, typer.Option(help="Tabor parameter; repeatable.")] = None,
    accuracy: Annotated[str, typer.Option(help="Accuracy of the solver.")] = "standard",
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Compute pull-off forces and a viscoelastic crack at large Tabor parameters."""
    load_kernels()
    tabors = tuple(tabor or TABORS)
    elastic, solid, cracks = [], [], []
    print(HEADER)
    for mu in tabors:
        elastic.append(cycle(mu, Elastic(), accuracy))
        solid.append(cycle(mu, StandardLinearSolid(RATIO), accuracy))
        cracks.append(crack(mu, accuracy))
        for name, row in (("elastic", elastic[-1]), ("viscoelastic", solid[-1])):
            expected = f"{row['expected']:8.4f}" if "expected" in row else f"{'':8}"
            print(
                f"{mu:6g} {name:>12} {row['pull_off_force']:8.4f} {expected} {row['cpu_seconds']:8.2f} "
                f"{row['nodes']:6.0f} {row['unknowns']:8.0f} {row['steps']:6d}"
            )
        print(f"{mu:6g} {'crack':>12} off the theory by at most {100.0 * cracks[-1]['largest_deviation']:.1f} %")
    content = {"accuracy": accuracy, "elastic": elastic, "viscoelastic": solid, "crack": cracks}
    options = "".join(f" --tabor {mu:g}" for mu in tabors)
    write_result(out, f"large_tabor{options} --accuracy {accuracy}", plain(content))
