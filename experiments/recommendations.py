"""How often `recommend` keeps its promise, and what it saves.

Three random samples: the paper's box with its solid; a box ten times wider in every direction, with random modulus
ratios; ten-term solids of random spectra in the paper's box. For each protocol, tolerance and quantity the recommended
scene and the full one are simulated at `ACCURACY`, and the difference is set against the tolerance.

Usage: `python -m experiments.recommendations [--count N] [--out FILE]`.
"""

from __future__ import annotations

import time
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.progress import track

from bem import LoadingProtocol, PronySeries, Scene, StandardLinearSolid, recommend, simulate
from bem.designs import PAPER_RANGES, Design
from bem.recommend import difference
from experiments.measuring import MEASUREMENTS, plain, spread
from experiments.studies import write_result

OUT = MEASUREMENTS / "recommendations.json"
ASKED = {"force": (0.1, 0.03, 0.01), "pull_off_force": (0.1,), "hysteresis": (0.1,)}
ACCURACY = 1.5e-3
TERMS = 10


def sample(name: str, count: int, seed: int = 4) -> list[tuple[Scene, LoadingProtocol]]:
    """Scenes and protocols of the sample 'paper', 'wider' or 'ten terms'."""
    generator = np.random.default_rng(seed)
    wider = {key: (low / 10.0, 10.0 * high) for key, (low, high) in PAPER_RANGES.items()}
    wider["tabor"] = (0.05, 5.0)
    drawn = Design("log-uniform", wider if name == "wider" else {}).protocols(count, seed)
    cases = []
    for i in range(count):
        quantities = {key: float(values[i]) for key, values in drawn.items()}
        tabor = quantities.pop("tabor")
        material = StandardLinearSolid(0.1 if name == "paper" else float(10.0 ** generator.uniform(-2.0, -0.1)))
        if name == "ten terms":
            weights = generator.dirichlet(np.ones(TERMS))
            material = PronySeries(0.9 * weights, np.sort(10.0 ** generator.uniform(-3.0, 3.0, TERMS)))
        cases.append((Scene(tabor, material), LoadingProtocol(**quantities)))
    return cases


def checked(scene: Scene, protocol: LoadingProtocol, tolerance: float, quantity: str) -> dict[str, Any]:
    """One recommendation beside the full solution."""
    started = time.perf_counter()
    found = recommend(scene, protocol, tolerance, quantity=quantity)
    seconds = time.perf_counter() - started
    full, simple = simulate(scene, protocol, ACCURACY), simulate(found.scene, found.protocol, ACCURACY)
    error = difference(simple, full, protocol.history(scene.tabor), quantity)
    if found.found_by == "nothing is left out":
        error = 0.0
    return {
        "effects": str(found.effects),
        "count": found.effects.count,
        "found_by": found.found_by,
        "estimate": found.estimate,
        "error": error,
        "kept": bool(error <= tolerance),
        "seconds": seconds,
        "full_seconds": full.stats.seconds,
        "simple_seconds": simple.stats.seconds,
    }


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What a sample says about one tolerance and quantity."""
    return {
        "cases": len(rows),
        "kept": sum(row["kept"] for row in rows),
        "worst_error": max(row["error"] for row in rows),
        "simplified": sum(row["found_by"] != "nothing is left out" for row in rows),
        "by_estimate": sum(row["found_by"] == "estimate" for row in rows),
        "effects": dict(Counter(row["effects"] for row in rows).most_common(6)),
        "seconds": spread([row["seconds"] for row in rows]),
        "full_seconds": spread([row["full_seconds"] for row in rows]),
        "simple_seconds": spread([row["simple_seconds"] for row in rows]),
    }


def main(
    count: Annotated[int, typer.Option(help="Protocols of each sample.")] = 100,
    out: Annotated[Path, typer.Option(help="Result file to write.")] = OUT,
) -> None:
    """Check `recommend` against the full solution."""
    results = []
    for name in ("paper", "wider", "ten terms"):
        cases = sample(name, count)
        for quantity, tolerances in ASKED.items():
            for tolerance in tolerances:
                label = f"{name}, {quantity} within {tolerance:g}"
                rows = [checked(*case, tolerance, quantity) for case in track(cases, label)]
                results.append({"sample": name, "quantity": quantity, "tolerance": tolerance, **summary(rows)})
                print(f"{label}: kept in {results[-1]['kept']} of {len(rows)}", flush=True)
    content = {"accuracy": ACCURACY, "results": results}
    write_result(out, f"recommendations --count {count}", plain(content))


if __name__ == "__main__":
    typer.run(main)
