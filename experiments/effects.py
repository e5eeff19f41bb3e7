"""What each effect costs: scenes from plain Hertz to a ten-term solid with adhesion, each adding one effect.

All scenes belong to one sphere, one work of adhesion and one relaxed modulus, pressed to the same depth at the same
speed: lengths along the axis in units of mu h0 (= R^(1/3) (dgamma/E0*)^(2/3), whatever the range of adhesion), so that
a scene of Tabor parameter mu is given mu times the depth in h0. Per scene: unknowns, memory vectors, steps, seconds,
the difference from a closed form where one exists, and the files whose code runs.

The second part answers when a simpler scene is a safe stand-in: the error of its force history, as `bem.recommend`
measures it, over the rate at which the sphere moves (without a dwell), and what `recommend` says.

Usage: `python -m experiments.effects [--repeats N] [--out FILE]`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from bem import (
    Elastic,
    HardContact,
    LennardJones,
    LoadingProtocol,
    PronySeries,
    Scene,
    StandardLinearSolid,
    Trajectory,
    recommend,
    simulate,
)
from bem.effects import Effects, reduced
from bem.materials import Material
from bem.recommend import difference
from bem.reference_solutions import dmt, hereditary_hertz, hertz, jkr
from experiments.measuring import MEASUREMENTS, plain, spread, timed
from experiments.studies import write_result

OUT = MEASUREMENTS / "effects.json"
TABOR, DMT_TABOR, JKR_TABOR = 1.0, 0.2, 3.2
DEPTH, START, RATE, DWELL = 4.0, -3.0, 20.0, 0.2
MODULUS_RATIO = 0.1
RATES = np.geomspace(1e-2, 1e4, 19)
TOLERANCE = 0.05

SHARED = [
    "scene",
    "protocol",
    "simulate",
    "march",
    "mesh",
    "influence",
    "prediction",
    "transfer",
    "peaks",
    "trajectory",
]
FILES = {"no adhesion": ["hard_contact"], "adhesion": ["tractions", "equilibrium", "folds", "cohesive_zone"]}
MEMORY_FILES = ["materials", "memory"]

SLS = StandardLinearSolid(MODULUS_RATIO)
THREE = PronySeries([0.3, 0.3, 0.3], [0.1, 1.0, 10.0])
TEN = PronySeries(np.full(10, 0.09), np.geomspace(1e-2, 1e2, 10))
SCENES: tuple[tuple[str, float, Material, Any], ...] = (
    ("Hertz", TABOR, Elastic(), HardContact()),
    ("Hertz, one relaxation", TABOR, SLS, HardContact()),
    ("Hertz, ten relaxations", TABOR, TEN, HardContact()),
    ("adhesion", TABOR, Elastic(), LennardJones()),
    ("adhesion, long range (DMT-like)", DMT_TABOR, Elastic(), LennardJones()),
    ("adhesion, short range (JKR-like)", JKR_TABOR, Elastic(), LennardJones()),
    ("adhesion, solid with no relaxation (k = 1)", TABOR, StandardLinearSolid(1.0), LennardJones()),
    ("adhesion, one relaxation", TABOR, SLS, LennardJones()),
    ("adhesion, one relaxation as a series", TABOR, PronySeries([1.0 - MODULUS_RATIO], [1.0]), LennardJones()),
    ("adhesion, three relaxations", TABOR, THREE, LennardJones()),
    ("adhesion, ten relaxations", TABOR, TEN, LennardJones()),
)


def protocol_for(tabor: float, rate: float = RATE, dwell: float = DWELL) -> LoadingProtocol:
    """The common path in h0 of a scene of this Tabor parameter."""
    return LoadingProtocol(
        peak_indentation=tabor * DEPTH,
        loading_rate=tabor * rate,
        dwell_time=dwell,
        unloading_rate=tabor * rate,
        start_indentation=tabor * START,
    )


def files_of(scene: Scene) -> list[str]:
    """Files of `bem` whose code this scene runs beyond what all scenes share."""
    found = list(FILES["no adhesion" if isinstance(scene.adhesion, HardContact) else "adhesion"])
    return found + (MEMORY_FILES if len(scene.material.strengths) else [])


def against_closed_form(scene: Scene, trajectory: Trajectory) -> tuple[str, float | None]:
    """The closed form a scene has or tends to, and the root mean square difference over the range of the force."""
    depth, force = trajectory.indentation, trajectory.force
    if isinstance(scene.adhesion, HardContact) and len(scene.material.strengths) == 0:
        name, exact = "Hertz", hertz.force_from_indentation(depth, scene.tabor)
    elif isinstance(scene.adhesion, HardContact):
        growing = ~trajectory.unloading
        history = protocol_for(scene.tabor).history(scene.tabor)
        depth, force = depth[growing], force[growing]
        name, exact = "Lee and Radok", hereditary_hertz.force(scene, history, trajectory.time[growing])
    elif scene.tabor == JKR_TABOR and len(scene.material.strengths) == 0:
        inside = trajectory.unloading & (depth > 0.9 * jkr.fold_indentation(scene.tabor))
        force, exact = force[inside], jkr.force_from_indentation(depth[inside], scene.tabor)
        name = "JKR (limit)"
    elif scene.tabor == DMT_TABOR:
        inside = trajectory.unloading & (depth > 0.0)
        force, exact, name = force[inside], dmt.force_from_indentation(depth[inside], scene.tabor), "DMT (limit)"
    else:
        return "none", None
    return name, float(np.sqrt(np.mean((force - exact) ** 2)) / np.ptp(trajectory.force))


def row(name: str, scene: Scene, repeats: int) -> dict[str, Any]:
    """One scene of the table, with its force history."""
    protocol = protocol_for(scene.tabor)
    trajectory = simulate(scene, protocol)
    seconds = timed(lambda: simulate(scene, protocol), repeats)
    closed_form, error = against_closed_form(scene, trajectory)
    stats = trajectory.stats
    return {
        "name": name,
        "tabor": scene.tabor,
        "status": trajectory.status,
        "unknowns": stats.unknowns_per_solve,
        "nodes": stats.nodes,
        "memory_vectors": stats.memory_vectors,
        "steps": stats.steps,
        "seconds": spread(seconds),
        "seconds_per_step": float(np.median(seconds)) / stats.steps,
        "closed_form": closed_form,
        "error": error,
        "files": files_of(scene),
        "pull_off_force": trajectory.pull_off_force,
        "hysteresis": trajectory.hysteresis / scene.tabor,
    }


def curve(name: str, scene: Scene) -> dict[str, Any]:
    """Force over depth in units of mu h0."""
    protocol = protocol_for(scene.tabor)
    if name == "glassy":
        simple, protocol = reduced(scene, protocol, Effects(True, 0, 0, 1))
        trajectory = simulate(simple, protocol, "reference")
    else:
        trajectory = simulate(scene, protocol, "reference")
    return {
        "name": name,
        "depth": trajectory.indentation / scene.tabor,
        "force": trajectory.force,
        "time": trajectory.time,
        "pull_off_force": trajectory.pull_off_force,
    }


def stand_ins(rate: float) -> dict[str, Any]:
    """Error of each simpler scene at one rate, and the recommendation."""
    scene, protocol = Scene(TABOR, SLS), protocol_for(TABOR, rate, dwell=0.0)
    history = protocol.history(TABOR)
    full = simulate(scene, protocol, "reference")
    simpler = {
        "Hertz": Effects(False, 1, 1, 1),
        "rubbery": Effects(True, 1, 1, 1),
        "glassy": Effects(True, 0, 0, 1),
        "no adhesion": Effects(False, 0, 1, 1),
    }
    errors = {
        name: difference(simulate(*reduced(scene, protocol, effects), 1e-3), full, history, "force")
        for name, effects in simpler.items()
    }
    found = recommend(scene, protocol, TOLERANCE)
    return {"rate": rate, "errors": errors, "recommended": str(found.effects), "estimate": found.estimate}


def main(
    repeats: Annotated[int, typer.Option(help="Timed runs of each scene.")] = 15,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Measure the table and the curves of effects."""
    rows = [row(name, Scene(tabor, material, law), repeats) for name, tabor, material, law in SCENES]
    six = {
        "Hertz": Scene(TABOR, Elastic(), HardContact()),
        "DMT-like": Scene(DMT_TABOR),
        "JKR-like": Scene(JKR_TABOR),
        "rubbery": Scene(TABOR),
        "glassy": Scene(TABOR, SLS),
        "one relaxation": Scene(TABOR, SLS),
        "ten relaxations": Scene(TABOR, TEN),
    }
    content = {
        "path": {"depth": DEPTH, "start": START, "rate": RATE, "dwell": DWELL, "modulus_ratio": MODULUS_RATIO},
        "shared_files": SHARED,
        "rows": rows,
        "curves": [curve(name, scene) for name, scene in six.items()],
        "tolerance": TOLERANCE,
        "stand_ins": [stand_ins(float(rate)) for rate in RATES],
    }
    write_result(out, f"effects --repeats {repeats}", plain(content))


if __name__ == "__main__":
    typer.run(main)
