"""Which effects a scene and protocol call for: the fewest whose answer stays inside a tolerance.

Effects are left out one after another (`bem.effects`), and the error of each choice is bracketed by numbers that cost
no contact solution:

- The material: the contact without adhesion obeys the force-indentation law of Hertz with the hereditary integral of
  the material in front of it, exactly so while the contact grows. Its force history with all terms and with some of
  them differ by what the missing terms do; the Deborah numbers, retardation times over the durations of the phases,
  decide.
- Adhesion: at one indentation it changes the force by about 2 pi R dgamma (DMT), by up to 2/k where the crack runs fast
  (k the modulus ratio), to be set against the range of the force.

Where the bracket holds the tolerance inside, both scenes are simulated, at an accuracy three times better than the
tolerance, and compared. Source: Lee and Radok, J. Appl. Mech. 27 (1960) 438, for the growing contact; Persson and
Brener, Phys. Rev. E 71 (2005) 036123, for the factor 1/k.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from bem._checks import FloatArray, finite_number, instance
from bem.effects import Effects, Protocol, choices, reduced
from bem.protocol import LoadingProtocol, PiecewiseLinearProtocol
from bem.reference_solutions import hereditary_hertz, hertz
from bem.scene import Scene
from bem.simulate import simulate
from bem.trajectory import Trajectory

Quantity = Literal["force", "pull_off_force", "hysteresis"]
QUANTITIES = ("force", "pull_off_force", "hysteresis")
_POINTS = {"loading": 50, "dwell": 20, "unloading": 50}
_LEAST_ADHESION, _MOST_ADHESION = 0.15, 3.0  # of the force, in pi R dgamma; the most also times 1/k
_MARGIN = 1.5  # by which an estimate may be wrong either way
_ROOM = 0.7  # share of the tolerance that a simulated difference may use


@dataclass(frozen=True)
class Recommendation:
    """What to simulate instead of the full scene, and how wrong that is."""

    scene: Scene
    protocol: Protocol
    effects: Effects
    estimate: float
    """Estimated error of the chosen scene, in the measure asked for; 0 when nothing is left out."""
    found_by: Literal["estimate", "simulation", "nothing is left out"]
    tolerance: float
    quantity: Quantity
    deborah: dict[str, tuple[float, ...]]
    """Retardation times over the duration of each phase."""
    adhesion_over_hertz: float
    """Adhesion force of a rubbery contact, 2 pi R dgamma, over the largest force without adhesion."""

    def __str__(self) -> str:
        return f"{self.effects} (error about {self.estimate:.2g} of {self.tolerance:g} allowed, by {self.found_by})"


def recommend(
    scene: Scene, protocol: Protocol, tolerance: float = 0.01, *, quantity: Quantity = "force"
) -> Recommendation:
    """Find the cheapest set of effects whose answer stays inside a tolerance.

    Args:
        scene, protocol: the full problem, as for `bem.simulate`.
        tolerance: error allowed, 1e-3 to 1.
        quantity: what must be right. 'force': root mean square difference at 120 measurement steps over the range of
            the full force; 'pull_off_force' and 'hysteresis': relative difference, always decided by simulation.

    Returns:
        the recommendation, whose `scene` and `protocol` go to `bem.simulate`.

    Raises:
        ValueError: naming what is allowed and what was received.

    Example:
        >>> from bem import LoadingProtocol, Scene, StandardLinearSolid, recommend
        >>> deep = LoadingProtocol(peak_indentation=900.0, loading_rate=1e6, dwell_time=0.0, unloading_rate=1e6)
        >>> str(recommend(Scene(1.0, StandardLinearSolid(0.1)), deep, 0.05).effects)
        'elastic glassy, without adhesion'
    """
    instance("scene", scene, (Scene,))
    instance("protocol", protocol, (LoadingProtocol, PiecewiseLinearProtocol))
    tolerance = finite_number("tolerance", tolerance, low=1e-3, high=1.0)
    if quantity not in QUANTITIES:
        raise ValueError(f"quantity must be one of {', '.join(QUANTITIES)}; received {quantity!r}")
    history = protocol.history(scene.tabor) if isinstance(protocol, LoadingProtocol) else protocol
    every = choices(scene)
    full = every[-1]
    brackets = _brackets(scene, history, every)
    numbers = {
        "tolerance": tolerance,
        "quantity": quantity,
        "deborah": _deborah(scene, history),
        "adhesion_over_hertz": _adhesion_over_hertz(scene, history),
    }
    truth = None
    for effects in _best_of_each_count(every, brackets):
        simple, path = reduced(scene, protocol, effects)
        if effects == full:
            return Recommendation(simple, path, effects, 0.0, "nothing is left out", **numbers)
        low, high = brackets[effects]
        if quantity == "force" and low > _MARGIN * tolerance:
            continue
        if quantity == "force" and _MARGIN * high < tolerance:
            return Recommendation(simple, path, effects, high, "estimate", **numbers)
        if quantity == "pull_off_force" and full.adhesion and not effects.adhesion:
            continue
        accuracy = min(max(tolerance / 3.0, 2e-4), 1.7e-2)
        if truth is None:
            truth = simulate(scene, protocol, accuracy)
        error = difference(simulate(simple, path, accuracy), truth, history, quantity)
        if error < _ROOM * tolerance:
            return Recommendation(simple, path, effects, error, "simulation", **numbers)
    raise AssertionError("the full set of effects is always a choice")


def difference(found: Trajectory, truth: Trajectory, history: PiecewiseLinearProtocol, quantity: Quantity) -> float:
    """Error of one trajectory against another under the same history; infinite where one did not complete."""
    if not (found.completed and truth.completed):
        return np.inf
    if quantity != "force":
        exact = getattr(truth, quantity)
        return abs(getattr(found, quantity) - exact) / max(abs(exact), 1e-300)
    times = np.minimum(instants(history), min(found.time[-1], truth.time[-1]))
    force = truth.at(times)
    return float(np.sqrt(np.mean((found.at(times) - force) ** 2)) / np.ptp(force))


def instants(history: PiecewiseLinearProtocol) -> FloatArray:
    """Where forces are compared: 50 points in each ramp, 20 in each dwell, equally spaced."""
    pieces = [
        begin + (end - begin) * np.arange(1, _POINTS[phase] + 1) / _POINTS[phase]
        for begin, end, phase in zip(history.times[:-1], history.times[1:], history.phases, strict=True)
    ]
    return np.concatenate([history.times[:1], *pieces])


def _best_of_each_count(every: list[Effects], brackets: dict[Effects, tuple[float, float]]) -> list[Effects]:
    """For each number of effects, with and without adhesion, the choice of terms with the smallest estimate."""
    best: dict[tuple[int, bool], Effects] = {}
    for effects in every:
        group = (effects.terms, effects.adhesion)
        if group not in best or brackets[effects][1] < brackets[best[group]][1]:
            best[group] = effects
    return sorted(best.values(), key=lambda effects: (effects.count, effects.terms))


def _brackets(
    scene: Scene, history: PiecewiseLinearProtocol, every: list[Effects]
) -> dict[Effects, tuple[float, float]]:
    """Lower and upper estimate of the error in the force for every choice of effects."""
    full = every[-1]
    times = hereditary_hertz.dense_instants(history)
    compared = instants(history)
    rubbery = -hertz.force_from_indentation(history.indentation_at(times), scene.tabor)
    depth = -hertz.force_from_indentation(history.indentation_at(compared), scene.tabor)

    def force(effects: Effects) -> FloatArray:
        simple, _ = reduced(scene, history, effects)
        left = (simple.tabor / scene.tabor) ** 1.5
        values = hereditary_hertz.hereditary(
            times, rubbery / left, np.array(simple.material.strengths), np.array(simple.material.times)
        )
        return np.where(depth > 0.0, np.maximum(np.interp(compared, times, values), 0.0), 0.0)

    exact = force(full)
    weakest = 2.0 if full.adhesion else 0.0
    scale = float(np.ptp(exact)) + weakest
    found = {}
    for effects in every:
        material = float(np.sqrt(np.mean((force(effects) - exact) ** 2))) / max(scale, 1e-300)
        certain = _LEAST_ADHESION / scale if full.adhesion and not effects.adhesion else 0.0
        # A simpler material changes the adhesive part of the force too, unless the elastic answer is exact anyway.
        touched = full.adhesion and (not effects.adhesion or not effects.everything)
        doubt = _MOST_ADHESION / scene.material.modulus_ratio / scale if touched else 0.0
        found[effects] = (max(material - doubt, certain), material + doubt)
    return found


def _deborah(scene: Scene, history: PiecewiseLinearProtocol) -> dict[str, tuple[float, ...]]:
    durations: dict[str, float] = {}
    for phase, duration in zip(history.phases, np.diff(history.times), strict=True):
        durations[phase] = durations.get(phase, 0.0) + float(duration)
    return {phase: tuple(float(t) / d for t in scene.material.times) for phase, d in durations.items()}


def _adhesion_over_hertz(scene: Scene, history: PiecewiseLinearProtocol) -> float:
    largest = -float(hertz.force_from_indentation(float(np.max(history.indentations)), scene.tabor))
    return 2.0 / largest if largest > 0.0 else np.inf
