"""Pull-off from broad-band solids: amplification against unloading rate for the modified power law.

The creep compliance is C(t) = (1/E0) [1 + (k - 1) (1 + t)^(-n)]. Since

    (1 + t)^(-n) = 1/Gamma(n) integral over s > 0 of s^(n-1) exp(-s) exp(-s t) ds,

every such solid has a continuous, positive retardation spectrum. It is discretised at equally spaced log s and fitted
by non-negative least squares, with an exact sum of strengths. Unloading starts from the fully relaxed contact at a deep
preload, so that the contact is long enough for the crack to reach its speed. The amplification is the largest force
over JKR's 3/2, and over the largest force of the elastic solid of the same Tabor parameter, which is slightly larger
than 3/2 because the range of adhesion is finite. The last curve is a standard linear solid of the same modulus ratio.
The result can be compared with published boundary-element data for the same solids. mu = 3.24, k = 0.1; rates are in h0
per retardation time.
"""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import typer
from scipy.optimize import nnls

from bem import Elastic, PiecewiseLinearProtocol, PronySeries, Scene, StandardLinearSolid, simulate
from bem.materials import Material
from bem.reference_solutions.jkr import PULL_OFF_FORCE
from experiments.measurements.harness import Jobs, in_parallel

TABOR, RATIO = 3.24, 0.1
EXPONENTS = (0.2, 0.4, 0.6, 1.6)
PRELOADS = (10.0, 30.0, 100.0, 300.0)
END = -40.0
RATES = (1e-6, 1e6)
TERMS_PER_DECADE = 2
SLOWEST = 1e9  # retardation times; slower terms do not move within these protocols


def power_law(n: float, times: np.ndarray) -> np.ndarray:
    """Creep compliance E0 C(t) of the modified power law, of the shape of `times`."""
    return 1.0 + (RATIO - 1.0) * (1.0 + times) ** -n


def prony_fit(n: float) -> tuple[PronySeries, float]:
    """Prony series of the modified power law, and the largest error of its compliance, which runs from k to 1."""
    slowest = min(SLOWEST, 1e3 ** (1.0 / n) * 10.0)
    decades = np.log10(slowest / 0.05)
    taus = np.geomspace(0.05, slowest, int(np.ceil(TERMS_PER_DECADE * decades)) + 1)
    times = np.concatenate([[0.0], np.geomspace(1e-3, 0.1 * slowest, 400)])
    matrix = np.exp(-times[:, None] / taus)
    heavy = 1e4  # weight that makes the sum of strengths, and so the instantaneous compliance, exact
    weights, _ = nnls(np.vstack([matrix, heavy * np.ones(taus.size)]), np.append((1.0 + times) ** -n, heavy))
    weights /= weights.sum()
    material = PronySeries((1.0 - RATIO) * weights, taus)
    return material, float(np.max(np.abs(material.creep_compliance(times) - power_law(n, times))))


def pulled(material: Material, preload: float, rate: float, accuracy: str) -> dict[str, Any]:
    """Amplification for unloading from the relaxed contact at a preload."""
    protocol = PiecewiseLinearProtocol([0.0, (preload - END) / rate], [preload, END])
    trajectory = simulate(Scene(TABOR, material), protocol, accuracy, initial_state="relaxed")
    return {
        "unloading_rate": rate,
        "amplification": trajectory.pull_off_force / PULL_OFF_FORCE,
        "status": trajectory.status,
        "seconds": trajectory.stats.seconds,
    }


def study(
    *,
    rates: Annotated[int, typer.Option(help="Unloading rates of each curve.")] = 49,
    accuracy: Annotated[str, typer.Option(help="Accuracy of the solver.")] = "standard",
    jobs: Jobs = 2,
) -> dict[str, Any]:
    """Compute all curves."""
    speeds = np.geomspace(*RATES, rates).tolist()
    solids: list[tuple[str, float | None, Material, float]] = [(f"n = {n:g}", n, *prony_fit(n)) for n in EXPONENTS]
    solids.append(("standard linear solid", None, StandardLinearSolid(RATIO), 0.0))
    drawn = [(solid, preload) for solid in solids for preload in PRELOADS]
    arguments = [(solid[2], preload, rate, accuracy) for solid, preload in drawn for rate in speeds]
    points = in_parallel(pulled, arguments, jobs=jobs, label="broad band")
    elastic = pulled(Elastic(), PRELOADS[0], 1.0, accuracy)["amplification"] * PULL_OFF_FORCE
    for point in points:
        point["own_amplification"] = point["amplification"] * PULL_OFF_FORCE / elastic
    curves = [
        {
            "name": name,
            "n": n,
            "preload": preload,
            "terms": len(material.strengths),
            "compliances": material.strengths,
            "times": material.times,
            "fit_error": error,
            "points": points[place * rates : (place + 1) * rates],
        }
        for place, ((name, n, material, error), preload) in enumerate(drawn)
    ]
    content = {"tabor": TABOR, "modulus_ratio": RATIO, "accuracy": accuracy, "elastic_pull_off": elastic}
    return content | {"curves": curves}
