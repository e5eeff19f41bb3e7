"""How often `recommend` meets its tolerance, and what it saves.

The random samples are the paper's box with its solid; a box ten times wider in every direction, with random modulus
ratios; ten-term solids of random spectra in the paper's box; the paper's box without adhesion and with random modulus
ratios; and protocols of two loads with a partial unloading between them. For each protocol, tolerance and quantity, the
recommended scene and the full scene are simulated at `ACCURACY`, and their difference is compared with the tolerance.
The saving is the ratio of their seconds at standard accuracy, over the scenes that were simplified.
"""

from typing import Any

import numpy as np

import bem
from bem import LoadingProtocol, PiecewiseLinearProtocol, Scene, recommend, simulate
from bem.dataset.designs import PAPER_RANGES, Design
from bem.problem.effects import IndentationProtocol
from bem.problem.protocol import history_of
from bem.recommendation import difference
from experiments.cases import rows_of
from experiments.harness import CLOCK, Count, progress, timed
from experiments.measurements.statistics import spread

ASKED = {"force": (0.1, 0.03, 0.01), "pull_off_force": (0.1,), "hysteresis": (0.1,)}
ACCURACY = 1.5e-3
TERMS = 10
SAMPLES = ("paper", "wider", "ten terms", "no adhesion", "two loads")
TIMED = 3


def sample(name: str, count: int, seed: int = 4) -> list[tuple[Scene, IndentationProtocol]]:
    """Scenes and protocols of one of `SAMPLES`."""
    generator = np.random.default_rng(seed)
    wider = {key: (low / 10.0, 10.0 * high) for key, (low, high) in PAPER_RANGES.items()}
    wider["tabor"] = (0.05, 5.0)
    drawn = Design("log-uniform", wider if name == "wider" else {}).protocols(count, seed)
    cases: list[tuple[Scene, IndentationProtocol]] = []
    for quantities in rows_of(drawn):
        tabor = quantities.pop("tabor")
        ratio = 0.1 if name in ("paper", "two loads") else float(10.0 ** generator.uniform(-2.0, -0.1))
        material: bem.StandardLinearSolid | bem.PronySeries = bem.StandardLinearSolid(ratio)
        if name == "ten terms":
            weights = generator.dirichlet(np.ones(TERMS))
            material = bem.PronySeries(0.9 * weights, np.sort(10.0 ** generator.uniform(-3.0, 3.0, TERMS)))
        law = bem.HardContact() if name == "no adhesion" else bem.LennardJones()
        once = LoadingProtocol(**quantities)
        twice = name == "two loads" and two_loads(once, tabor, float(generator.uniform(0.0, 0.9)))
        cases.append((Scene(tabor, material, law), twice or once))
    return cases


def two_loads(protocol: LoadingProtocol, tabor: float, share: float) -> PiecewiseLinearProtocol:
    """Load, unload to a share of the peak, load again, and unload, at the rates of a protocol."""
    start, peak = protocol.start(tabor), protocol.peak_indentation
    depths = np.array([start, peak, share * peak, peak, start])
    rates = np.array([protocol.loading_rate, protocol.unloading_rate, protocol.loading_rate, protocol.unloading_rate])
    return PiecewiseLinearProtocol(np.append(0.0, np.cumsum(np.abs(np.diff(depths)) / rates)), depths)


def checked(scene: Scene, protocol: IndentationProtocol, tolerance: float, quantity: str) -> dict[str, Any]:
    """One recommendation, compared with the full scene."""
    with CLOCK:
        advice = recommend(scene, protocol, tolerance, quantity=quantity)
    seconds = CLOCK.seconds
    simplified = advice.found_by != "nothing is left out"
    row = {"found_by": advice.found_by, "simplified": simplified, "seconds": seconds}
    row |= dict.fromkeys(("error", "kept", "ratio"))
    if simplified:
        history = history_of(protocol, scene.tabor)
        full, simple = simulate(scene, protocol, ACCURACY), simulate(advice.scene, advice.protocol, ACCURACY)
        row["error"] = difference(simple, full, history, quantity)
        row["kept"] = bool(row["error"] <= tolerance)
        full_seconds = min(timed(lambda: simulate(scene, protocol), TIMED))
        row["ratio"] = min(timed(lambda: simulate(advice.scene, advice.protocol), TIMED)) / full_seconds
        row["full_seconds"] = full_seconds
    return row


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Summary of a sample at one tolerance and quantity; errors and ratios are those of the simplified scenes."""
    simplified = [row for row in rows if row["simplified"]]
    ratios = [row["ratio"] for row in simplified]
    return {
        "cases": len(rows),
        "simplified": len(simplified),
        "kept": sum(row["kept"] for row in simplified),
        "worst_error": max((row["error"] for row in simplified), default=None),
        "by_estimate": sum(row["found_by"] == "estimate" for row in rows),
        "seconds": spread([row["seconds"] for row in rows]),
        "full_seconds": spread([row["full_seconds"] for row in simplified]),
        "ratio": spread(ratios),
        "slower": sum(ratio > 1.0 for ratio in ratios),
    }


def study(*, count: Count = 100) -> dict[str, Any]:
    """Compare the recommendations with the full scenes; the cases are the protocols of each sample."""
    results = []
    for name in SAMPLES:
        cases = sample(name, count)
        for quantity, tolerance in ((quantity, limit) for quantity, several in ASKED.items() for limit in several):
            if quantity == "pull_off_force" and name == "no adhesion":
                continue
            label = f"{name}, {quantity} within {tolerance:g}"
            statistics = summary([checked(*case, tolerance, quantity) for case in progress(cases, label)])
            results.append({"sample": name, "quantity": quantity, "tolerance": tolerance, **statistics})
    return {"accuracy": ACCURACY, "results": results}
