"""The numbers of docs/limits.md that no other measurement has: the starts of the command, and single scenes.

Scenes are named by what they show. Errors are against the same simulation at a finer accuracy.
"""

import tempfile
from typing import Any

import numpy as np

from bem import ForceProtocol, LoadingProtocol, Scene, StandardLinearSolid, simulate
from experiments.harness import CLOCK, Repeats, Seed, of_command

SOLID = StandardLinearSolid(0.1)
LOSING_LITTLE = (0.8, 0.9)
"""Tabor parameters of elastic loops just above that at which branches begin to fold."""
PROTOCOL = ("--tabor=1", "--peak-indentation=20", "--loading-rate=10", "--unloading-rate=100")
SLOW = 0.1
"""Rate of a cycle that may end in contact."""


def cycle(peak: float, rate: float) -> LoadingProtocol:
    """Loading and unloading at one rate."""
    return LoadingProtocol(peak_indentation=peak, loading_rate=rate, dwell_time=0.0, unloading_rate=rate)


def elastic() -> dict[str, Any]:
    """Processor seconds of an elastic contact at the finest accuracy, and how it ended."""
    with CLOCK:
        trajectory = simulate(Scene(3.0), cycle(30.0, 1.0), "reference")
    return {"seconds": CLOCK.seconds, "status": trajectory.status}


def force_error(seed: int, count: int = 20) -> float:
    """Largest distance from a prescribed force, which presses and then pulls, over the largest, in random scenes."""
    generator, worst = np.random.default_rng(seed), 0.0
    for _ in range(count):
        pressed = -float(generator.uniform(2.0, 20.0))
        protocol = ForceProtocol([0.0, 1.0, 2.0, 3.0], [-1.0, pressed, pressed, 1.0])
        trajectory = simulate(Scene(float(generator.uniform(0.3, 3.0)), SOLID), protocol)
        prescribed = np.interp(trajectory.time, protocol.times, protocol.forces)
        worst = max(worst, float(np.max(np.abs(trajectory.force - prescribed))) / abs(pressed))
    return worst


def largest_in_contact() -> float:
    """Largest Tabor parameter, in steps of 0.01, at which a slow cycle from the default start does not detach."""
    for tabor in np.arange(0.5, 0.0, -0.01):
        if not simulate(Scene(float(tabor), SOLID), cycle(10.0, SLOW)).detached:
            return float(tabor)
    return 0.0


def study(*, repeats: Repeats = 5, seed: Seed = 1) -> dict[str, Any]:
    """Measure what a row of the page states."""
    with tempfile.TemporaryDirectory() as folder:
        _, compiled = of_command("compile", NUMBA_CACHE_DIR=folder)
    return {
        "compile_seconds": compiled,
        "command_seconds": min(of_command("simulate", *PROTOCOL)[1] for _ in range(repeats)),
        "loops": {tabor: simulate(Scene(tabor), cycle(30.0, 1.0)).hysteresis_accuracy for tabor in LOSING_LITTLE},
        "elastic": [elastic() for _ in range(2)],
        "force_error": force_error(seed),
        "in_contact": largest_in_contact(),
    }


def compile_text(limits: Any) -> str:
    """What the first run on a machine takes."""
    return f"{limits['compile_seconds']:.0f} s of processor time; the aim was 35 s"


def command_text(limits: Any) -> str:
    """What a warm command takes."""
    return f"{limits['command_seconds']:.1f} s of processor time; the aim was 1 s"


def loops_text(limits: Any) -> str:
    """The stated error of elastic loops that lose little."""
    errors = (f"{100.0 * error:.0f} % at $\\mu = {float(tabor):g}$" for tabor, error in limits["loops"].items())
    return "at standard accuracy this is " + " and ".join(errors)


def elastic_text(limits: Any) -> str:
    """What an elastic contact costs the first time, and again."""
    first, again = (run["seconds"] for run in limits["elastic"])
    return f"{1e3 * first:.0f} ms of processor time the first time, {1e3 * again:.1g} ms afterwards in the same process"


def contact_text(limits: Any) -> str:
    """Below which Tabor parameter a slow cycle ends in contact."""
    return f"at a rate of {SLOW:g} this is so up to $\\mu = {limits['in_contact']:.2f}$"


def force_text(limits: Any) -> str:
    """How closely a prescribed force is met."""
    return f"within {limits['force_error']:.1g} of the largest force at standard accuracy"
