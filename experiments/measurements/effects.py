"""What each effect changes: scenes from plain Hertz to a ten-term solid, and where a simpler one suffices.

All scenes have the same sphere, work of adhesion and relaxed modulus, and are pressed to the same depth at the same
speed. Lengths along the axis are therefore in units of mu h0 (= R^(1/3) (dgamma/E0*)^(2/3), independent of the range of
adhesion): a scene of Tabor parameter mu gets mu times the depth in units of h0.

A simpler scene stands in for the full one with an error of the force history, as `bem.recommend` measures it: over the
rate at which the sphere moves (without a dwell), with the choice of `recommend`; for a short or a long range of
adhesion, over the true Tabor parameter; and for one relaxation process in place of ten, over the decades that the ten
span. What the scenes cost is measured by `experiments.measurements.effect_pairs`.
"""

from itertools import takewhile
from typing import Any

import numpy as np

from bem import Elastic, HardContact, LoadingProtocol, PronySeries, Scene, StandardLinearSolid, recommend, simulate
from bem.problem.effects import Effects, reduced
from bem.recommendation import difference
from experiments.common import MODULUS_RATIO
from experiments.harness import progress

TABOR, DMT_TABOR, JKR_TABOR = 1.0, 0.2, 3.2
DEPTH, START, RATE, DWELL = 4.0, -3.0, 20.0, 0.2
RATES = np.geomspace(1e-2, 1e4, 19)
TOLERANCE = 0.05
TABORS = np.geomspace(0.05, 500.0, 41)
DECADES = (0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0)
SLOW_AND_FAST = (0.2, RATE, 2000.0)

SLS = StandardLinearSolid(MODULUS_RATIO)
THREE = PronySeries([0.3, 0.3, 0.3], [0.1, 1.0, 10.0])
TEN = PronySeries(np.full(10, 0.09), np.geomspace(1e-2, 1e2, 10))


def protocol_for(tabor: float, rate: float = RATE, dwell: float = DWELL) -> LoadingProtocol:
    """The common path, in units of h0, for a scene of the given Tabor parameter."""
    return LoadingProtocol(
        peak_indentation=tabor * DEPTH,
        loading_rate=tabor * rate,
        dwell_time=dwell,
        unloading_rate=tabor * rate,
        start_indentation=tabor * START,
    )


def curve(name: str, scene: Scene) -> dict[str, Any]:
    """Force over depth, with the depth in units of mu h0."""
    full = scene, protocol_for(scene.tabor)
    trajectory = simulate(*(reduced(*full, Effects(True, 0, 0, 1)) if name == "glassy" else full), "reference")
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
    recommended = recommend(scene, protocol, TOLERANCE, best="fewest").effects
    return {"rate": rate, "errors": errors, "recommended": str(recommended)}


def range_errors(tabor: float) -> dict[str, Any]:
    """Error of the force history if the range of adhesion is changed, with and without viscoelasticity."""
    errors: dict[str, Any] = {"tabor": tabor}
    history = protocol_for(tabor).history(tabor)
    for solid, material in (("elastic", Elastic()), ("one relaxation", SLS)):
        truth = simulate(Scene(tabor, material), protocol_for(tabor))
        for name, range_tabor in (("DMT-like", DMT_TABOR), ("JKR-like", JKR_TABOR)):
            # In units of mu h0 and of time, the path is the same for all scenes.
            stand_in = simulate(Scene(range_tabor, material), protocol_for(range_tabor))
            errors[f"{name}, {solid}"] = difference(stand_in, truth, history, "force")
    return errors


def one_process_error(decades: float, rate: float) -> dict[str, Any]:
    """Error of the force history if one relaxation process replaces ten that span `decades` around it."""
    protocol = protocol_for(TABOR, rate)
    spectrum = np.geomspace(10.0 ** (-0.5 * decades), 10.0 ** (0.5 * decades), 10)
    truth = simulate(Scene(TABOR, PronySeries(np.full(10, 0.1 * (1.0 - MODULUS_RATIO)), spectrum)), protocol, 1e-3)
    error = difference(simulate(Scene(TABOR, SLS), protocol, 1e-3), truth, protocol.history(TABOR), "force")
    return {"decades": decades, "rate": rate, "error": error}


def safe(ranges: list[dict[str, Any]], bands: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Ranges of the Tabor parameter, and of the decades, in which the error of a stand-in is at most `TOLERANCE`."""
    limits: list[dict[str, Any]] = []

    def farthest(points: list[dict[str, Any]], over: str, error: str, start: float, side: float = 1.0) -> float:
        """The last point away from `start` with all errors up to it within the tolerance."""
        away = sorted((p for p in points if side * (p[over] - start) >= 0.0), key=lambda point: side * point[over])
        return [start, *(point[over] for point in takewhile(lambda point: point[error] <= TOLERANCE, away))][-1]

    for name, own in (("DMT-like", DMT_TABOR), ("JKR-like", JKR_TABOR)):
        for solid in ("elastic", "one relaxation"):
            low, high = (farthest(ranges, "tabor", f"{name}, {solid}", own, side) for side in (-1.0, 1.0))
            labels = {"stand_in": f"{name}, mu = {own:g}", "instead_of": f"another range, {solid}", "over": "tabor"}
            limits.append({**labels, "low": low, "high": high})
    for rate in SLOW_AND_FAST:
        high = farthest([p for p in bands if p["rate"] == rate], "decades", "error", 0.0)
        labels = {"stand_in": "one relaxation", "instead_of": f"ten relaxations, rate {rate:g}", "over": "decades"}
        limits.append({**labels, "low": 0.0, "high": high})
    return limits


def study() -> dict[str, Any]:
    """Compute the curves, the errors of simpler scenes, and where these are safe."""
    seven = {
        "Hertz": Scene(TABOR, Elastic(), HardContact()),
        "DMT-like": Scene(DMT_TABOR),
        "JKR-like": Scene(JKR_TABOR),
        "rubbery": Scene(TABOR),
        "glassy": Scene(TABOR, SLS),
        "one relaxation": Scene(TABOR, SLS),
        "ten relaxations": Scene(TABOR, TEN),
    }
    ranges = [range_errors(float(tabor)) for tabor in progress(TABORS, "ranges of adhesion")]
    bands = [one_process_error(decades, rate) for decades in progress(DECADES, "spectra") for rate in SLOW_AND_FAST]
    return {
        "path": {"depth": DEPTH, "start": START, "rate": RATE, "dwell": DWELL, "modulus_ratio": MODULUS_RATIO},
        "curves": [curve(name, scene) for name, scene in seven.items()],
        "tolerance": TOLERANCE,
        "stand_ins": [stand_ins(float(rate)) for rate in progress(RATES, "rates")],
        "ranges": ranges,
        "bands": bands,
        "safe": safe(ranges, bands),
    }
