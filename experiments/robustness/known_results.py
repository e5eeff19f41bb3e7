"""The solver compared with known results: Hertz, elastic folds, Persson and Brener, two independent solvers.

Units as in `bem.trajectory`. The independent values are in `experiments/paper_values/independent_solvers.toml`: elastic
pull-off forces and fold points after Greenwood, Proc. R. Soc. A 453 (1997) 1277, and amplifications and timing
protocols of the paper from two other implementations.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from bem import Elastic, HardContact, LoadingProtocol, PiecewiseLinearProtocol, Scene, simulate
from bem.reference_solutions import hertz
from bem.reference_solutions.jkr import PULL_OFF_FORCE
from bem.reference_solutions.persson_brener import effective_energy
from experiments.common import MODULUS_RATIO, simulated
from experiments.paper_numbers import paper_rows, paper_values

SAMPLES = (1, 4, 12)


def row(quantity: str, found: float, expected: float, source: str) -> dict[str, Any]:
    """One line of the table, with the relative difference between the found and the expected value."""
    return {
        "quantity": quantity,
        "found": float(found),
        "expected": float(expected),
        "difference": float(abs(found / expected - 1.0)),
        "source": source,
    }


def hertz_force(accuracy: str | float) -> Iterable[dict[str, Any]]:
    """Force without adhesion at an indentation of 5."""
    tabor, depth = 1.0, 5.0
    scene = Scene(tabor=tabor, material=Elastic(), adhesion=HardContact())
    trajectory = simulate(scene, PiecewiseLinearProtocol([0.0, 1.0], [0.0, depth]), accuracy)
    expected = float(hertz.force_from_indentation(depth, tabor))
    yield row("Hertz force", trajectory.force[-1], expected, "Hertz")


def elastic(accuracy: str | float, known: dict[str, Any]) -> Iterable[dict[str, Any]]:
    """Largest tension and fold points of an elastic contact under displacement control."""
    for tabor, expected in zip(known["tabor"], known["largest_tension"], strict=True):
        protocol = LoadingProtocol(peak_indentation=2.0, loading_rate=1.0, dwell_time=0.0, unloading_rate=1.0)
        trajectory = simulate(Scene(tabor=tabor, material=Elastic()), protocol, accuracy)
        yield row(f"elastic, largest tension, mu = {tabor:g}", trajectory.pull_off_force, expected, "independent")
        if tabor == known["jump_tabor"]:
            depths = [jump.indentation for jump in trajectory.jumps]
            places = zip(("jump-in", "jump-out"), known["jump_indentations"], strict=True)
            for (name, expected_depth), depth in zip(places, depths, strict=True):
                yield row(f"elastic, {name} indentation, mu = {tabor:g}", depth, expected_depth, "independent")


def persson_brener(accuracy: str | float, known: dict[str, Any]) -> Iterable[dict[str, Any]]:
    """Pull-off amplification of the paper's fourteen protocols."""
    theirs = dict(zip(known["unloading_rate"], known["amplification"], strict=True))
    for protocol in paper_rows("persson_brener_protocols"):
        rate = protocol["unloading_rate"]
        found = simulated(protocol, accuracy=accuracy).pull_off_force / PULL_OFF_FORCE
        theory = float(effective_energy(protocol["crack_velocity"], MODULUS_RATIO))
        yield row(f"pull-off amplification, unloading rate {rate:g}", found, theory, "Persson-Brener")
        if rate in theirs:
            yield row(f"pull-off amplification, unloading rate {rate:g}", found, theirs[rate], "independent")


def timed_protocols(accuracy: str | float, known: dict[str, Any]) -> Iterable[dict[str, Any]]:
    """Pull-off force and hysteresis of protocols of the paper's timing table."""
    for protocol in paper_rows("canonical_protocols"):
        if protocol["sample"] not in SAMPLES:
            continue
        sample, trajectory = f"{protocol['sample']:g}", simulated(protocol, accuracy=accuracy)
        for name, expected in known[sample].items():
            words = name.replace("_", " ").replace("pull off", "pull-off")
            label = f"timing protocol ({sample}), {words}"
            yield row(label, getattr(trajectory, name), expected, "independent")


def known_results(accuracy: str | float = "standard") -> list[dict[str, Any]]:
    """All lines of the table."""
    known = paper_values("independent_solvers")
    return [
        *hertz_force(accuracy),
        *elastic(accuracy, known["elastic"]),
        *persson_brener(accuracy, known["amplification"]),
        *timed_protocols(accuracy, known["timing"]),
    ]


def summary(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Median and largest difference from Persson and Brener."""
    theory = np.array([line["difference"] for line in rows if line["source"] == "Persson-Brener"])
    return {"median": float(np.median(theory)), "largest": float(theory.max())}
