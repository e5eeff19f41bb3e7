"""What each effect costs: scenes from plain Hertz to a ten-term solid with adhesion, each adding one effect.

All scenes have the same sphere, work of adhesion and relaxed modulus, and are pressed to the same depth at the same
speed. Lengths along the axis are therefore in units of mu h0 (= R^(1/3) (dgamma/E0*)^(2/3), independent of the range of
adhesion): a scene of Tabor parameter mu gets mu times the depth in units of h0. Per scene, the study reports unknowns,
memory vectors, steps, seconds, and the difference from a closed form if one exists.

The second part shows when a simpler scene may replace the full one. It reports the error of the force history, as
`bem.recommend` measures it, and the choice of `recommend`, over the rate at which the sphere moves (without a dwell);
the error of a short or a long range of adhesion, over the true Tabor parameter; and the error of one relaxation process
in place of ten, over the decades that the ten span.
"""

from __future__ import annotations

from itertools import takewhile
from typing import Any

import numpy as np

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
from bem.effects.recommendation import difference
from bem.effects.scene_effects import Effects, reduced
from bem.materials import Material
from bem.reference_solutions import dmt, hereditary_hertz, hertz, jkr
from experiments.measurements.harness import Repeats, progress, timed
from experiments.measurements.statistics import spread

TABOR, DMT_TABOR, JKR_TABOR = 1.0, 0.2, 3.2
DEPTH, START, RATE, DWELL = 4.0, -3.0, 20.0, 0.2
MODULUS_RATIO = 0.1
RATES = np.geomspace(1e-2, 1e4, 19)
TOLERANCE = 0.05
TABORS = np.geomspace(0.05, 5.0, 33)
DECADES = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0)
SLOW_AND_FAST = (0.2, RATE, 2000.0)

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
    """The common path, in units of h0, for a scene of the given Tabor parameter."""
    return LoadingProtocol(
        peak_indentation=tabor * DEPTH,
        loading_rate=tabor * rate,
        dwell_time=dwell,
        unloading_rate=tabor * rate,
        start_indentation=tabor * START,
    )


def against_closed_form(scene: Scene, trajectory: Trajectory) -> tuple[str, float | None]:
    """Closed form of a scene or of its limit, and the root mean square difference over the range of the force."""
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
    """One row of the table: size, seconds, results and difference from the closed form."""
    protocol = protocol_for(scene.tabor)
    trajectory = simulate(scene, protocol)
    seconds = timed(lambda: simulate(scene, protocol), repeats)
    closed_form, error = against_closed_form(scene, trajectory)
    stats = trajectory.stats
    return {
        "name": name,
        "tabor": scene.tabor,
        "unknowns": stats.unknowns_per_solve,
        "memory_vectors": stats.memory_vectors,
        "steps": stats.steps,
        "seconds": spread(seconds),
        "seconds_per_step": float(np.median(seconds)) / stats.steps,
        "closed_form": closed_form,
        "error": error,
    }


def curve(name: str, scene: Scene) -> dict[str, Any]:
    """Force over depth, with the depth in units of mu h0."""
    protocol = protocol_for(scene.tabor)
    if name == "glassy":
        simple, protocol = reduced(scene, protocol, Effects(True, 0, 0, 1))
    else:
        simple = scene
    trajectory = simulate(simple, protocol, "reference")
    return {"name": name, "depth": trajectory.indentation / scene.tabor, "force": trajectory.force}


def stand_ins(rate: float) -> dict[str, Any]:
    """Error of each simpler scene at one rate, and the recommendation there."""
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
    fewest = recommend(scene, protocol, TOLERANCE, best="fewest")
    return {"rate": rate, "errors": errors, "recommended": str(fewest.effects)}


def of_another_range(tabor: float) -> dict[str, Any]:
    """Error of the force history if the range of adhesion is changed, with and without viscoelasticity."""
    found: dict[str, Any] = {"tabor": tabor}
    for kind, material in (("elastic", Elastic()), ("one relaxation", SLS)):
        truth = simulate(Scene(tabor, material), protocol_for(tabor), 1e-3)
        history = protocol_for(tabor).history(tabor)
        for name, other in (("DMT-like", DMT_TABOR), ("JKR-like", JKR_TABOR)):
            # In units of mu h0 and of time, the path is the same for all scenes.
            stand_in = simulate(Scene(other, material), protocol_for(other), 1e-3)
            found[f"{name}, {kind}"] = difference(stand_in, truth, history, "force")
    return found


def of_one_process(decades: float, rate: float) -> dict[str, Any]:
    """Error of the force history if one relaxation process replaces ten that span `decades` around it."""
    protocol = protocol_for(TABOR, rate)
    spectrum = np.geomspace(10.0 ** (-0.5 * decades), 10.0 ** (0.5 * decades), 10)
    truth = simulate(Scene(TABOR, PronySeries(np.full(10, 0.1 * (1.0 - MODULUS_RATIO)), spectrum)), protocol, 1e-3)
    error = difference(simulate(Scene(TABOR, SLS), protocol, 1e-3), truth, protocol.history(TABOR), "force")
    return {"decades": decades, "rate": rate, "error": error}


def safe(ranges: list[dict[str, Any]], bands: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Ranges of the Tabor parameter, and of the decades, in which the error of a stand-in is at most `TOLERANCE`."""
    found: list[dict[str, Any]] = []
    for name, own in (("DMT-like", DMT_TABOR), ("JKR-like", JKR_TABOR)):
        for kind in ("elastic", "one relaxation"):
            below = sorted((p for p in ranges if p["tabor"] <= own), key=lambda point: -point["tabor"])
            above = sorted((p for p in ranges if p["tabor"] >= own), key=lambda point: point["tabor"])
            low, high = (_last_within(points, "tabor", f"{name}, {kind}") for points in (below, above))
            words = {"stand_in": f"{name}, mu = {own:g}", "instead_of": f"another range, {kind}", "over": "tabor"}
            found.append({**words, "low": own if low is None else low, "high": own if high is None else high})
    for rate in SLOW_AND_FAST:
        points = sorted((p for p in bands if p["rate"] == rate), key=lambda point: point["decades"])
        limit = _last_within(points, "decades", "error")
        words = {"stand_in": "one relaxation", "instead_of": f"ten relaxations, rate {rate:g}", "over": "decades"}
        found.append({**words, "low": 0.0, "high": limit or 0.0})
    return found


def _last_within(points: list[dict[str, Any]], place: str, error: str) -> float | None:
    within = [point[place] for point in takewhile(lambda point: point[error] <= TOLERANCE, points)]
    return within[-1] if within else None


def study(*, repeats: Repeats = 15) -> dict[str, Any]:
    """Measure the table and the curves of effects."""
    scenes = {name: Scene(tabor, material, law) for name, tabor, material, law in SCENES}
    rows = [row(name, scene, repeats) for name, scene in progress(scenes.items(), "scenes")]
    seven = {
        "Hertz": Scene(TABOR, Elastic(), HardContact()),
        "DMT-like": Scene(DMT_TABOR),
        "JKR-like": Scene(JKR_TABOR),
        "rubbery": Scene(TABOR),
        "glassy": Scene(TABOR, SLS),
        "one relaxation": Scene(TABOR, SLS),
        "ten relaxations": Scene(TABOR, TEN),
    }
    ranges = [of_another_range(float(tabor)) for tabor in progress(TABORS, "ranges of adhesion")]
    bands = [of_one_process(decades, rate) for decades in progress(DECADES, "spectra") for rate in SLOW_AND_FAST]
    return {
        "path": {"depth": DEPTH, "start": START, "rate": RATE, "dwell": DWELL, "modulus_ratio": MODULUS_RATIO},
        "rows": rows,
        "curves": [curve(name, scene) for name, scene in seven.items()],
        "tolerance": TOLERANCE,
        "stand_ins": [stand_ins(float(rate)) for rate in progress(RATES, "rates")],
        "ranges": ranges,
        "bands": bands,
        "safe": safe(ranges, bands),
    }
