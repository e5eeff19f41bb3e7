"""Which effects of a scene to leave out (`bem.problem.effects`): the cheapest choice within a tolerance.

`recommend` leaves out one effect after another. The error of each choice is bracketed by numbers that cost no contact
solution:

- The material: the contact without adhesion obeys the force-indentation law of Hertz with the hereditary integral of
  the material in front of it, exactly so while the contact grows. Its force history with all terms and with some of
  them differ by what the missing terms do.
- Adhesion: at one indentation it changes the force by about 2 pi R dgamma (DMT), by up to 2/k where the crack runs fast
  (k the modulus ratio), to be set against the range of the force.

A spring moves the sphere on a path of its own, for which there is no such bracket: its scenes are simulated. What is
too small to matter, a stiff spring as well, has the bound of `bem.problem.negligible_effects`, as in `bem.simulate`.

Where the tolerance lies inside the bracket, both scenes are simulated, at an accuracy three times better than the
tolerance, and compared.

A simpler scene is not always the faster one: a contact that snaps, or whose edge moves at once with the load, takes
more steps without the memory that slows it down. The cost of a choice is therefore counted in runs of it and of the
full scene, at draft accuracy first. Operations are counted, not seconds, so that the answer is reproducible.

Sources: Lee and Radok, J. Appl. Mech. 27 (1960) 438, for the growing contact; Persson and Brener, Phys. Rev. E 71
(2005) 036123, for the factor 1/k.
"""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from bem._support.validation import FloatArray, finite_number, instance
from bem._support.wording import shown
from bem.methods.closed_forms import hereditary_hertz, hertz
from bem.problem.accuracy import NAMED_TARGETS
from bem.problem.effects import Effects, IndentationProtocol, choices, reduced
from bem.problem.negligible_effects import SHARE, simplified_scene
from bem.problem.protocol import LoadingProtocol, PiecewiseLinearProtocol, history_of
from bem.problem.scene import Scene
from bem.results.trajectory import Trajectory
from bem.simulation import simulate

Quantity = Literal["force", "pull_off_force", "hysteresis"]
Best = Literal["cheapest", "fewest"]
FoundBy = Literal["estimate", "simulation", "nothing is left out"]
_POINTS = {"loading": 50, "dwell": 20, "unloading": 50}
_LEAST_ADHESION, _MOST_ADHESION = 0.15, 3.0  # of the force, in pi R dgamma; the most also times 1/k
_MARGIN = 1.5  # by which an estimate may be wrong either way
_ROOM = 0.7  # share of the tolerance that a simulated difference may use
_WORTH = 0.8  # share of the full scene's operations up to which a simpler scene is sure to be the faster one


@dataclass(frozen=True)
class Recommendation:
    """A simpler scene to simulate instead of the full one, and its error."""

    scene: Scene
    protocol: IndentationProtocol
    effects: Effects
    estimate: float
    """Estimated error of the chosen scene, in the measure asked for; 0 when nothing is left out."""
    found_by: FoundBy
    tolerance: float
    quantity: Quantity
    cost: float
    """Operations of the chosen scene over those of the full one; 1 when nothing is left out."""
    radius_scale: float
    """Multiplies contact radii of the chosen scene, which are in its own beta, to give them in beta of the full one."""

    def __str__(self) -> str:
        if self.found_by == "nothing is left out":
            return f"{self.effects} ({self.found_by})"
        return f"{self.effects} (error about {self.estimate:.2g} of {self.tolerance:g} allowed, by {self.found_by})"


def recommend(
    scene: Scene,
    protocol: IndentationProtocol,
    tolerance: float = 0.01,
    *,
    quantity: Quantity = "force",
    best: Best = "cheapest",
) -> Recommendation:
    """Find the cheapest set of effects whose result stays within a tolerance.

    Args:
        scene, protocol: the full problem, as for `bem.simulate`.
        tolerance: error allowed, 1e-3 to 1.
        quantity: what must be right. 'force': root mean square difference at the measurement steps over the range of
            the full force; 'pull_off_force' and 'hysteresis': relative difference, always decided by simulation.
        best: 'cheapest' never returns a scene that costs more than the full one, and leaves nothing out where that
            saves nothing; 'fewest' returns the fewest effects, whatever they cost: the question which physics matters.

    Returns:
        the recommendation, whose `scene` and `protocol` go to `bem.simulate`.

    Raises:
        ValueError: naming what is allowed and what was received.

    Examples:
        >>> from bem import LoadingProtocol, Scene, StandardLinearSolid, recommend
        >>> deep = LoadingProtocol(peak_indentation=900.0, loading_rate=1e6, dwell_time=0.0, unloading_rate=1e6)
        >>> str(recommend(Scene(1.0, StandardLinearSolid(0.1)), deep, 0.05, best="fewest").effects)
        'elastic glassy, without adhesion'
    """
    instance("scene", scene, (Scene,))
    if scene.indenter is not None:
        raise ValueError(f"recommend knows the paraboloid only: indenter must be None; received {scene.indenter}")
    instance("protocol", protocol, (LoadingProtocol, PiecewiseLinearProtocol))
    tolerance = finite_number("tolerance", tolerance, low=1e-3, high=1.0)
    for name, value, allowed in (("quantity", quantity, get_args(Quantity)), ("best", best, get_args(Best))):
        if value not in allowed:
            raise ValueError(f"{name} must be one of {', '.join(allowed)}; received {shown(value)}")
    history = history_of(protocol, scene.tabor)
    every = choices(scene)
    full = every[-1]
    brackets = _brackets(scene, history, every)
    accuracy = min(max(tolerance / 3.0, 2e-4), NAMED_TARGETS["standard"])

    @functools.cache
    def solved(effects: Effects, target: float) -> Trajectory:
        return simulate(*reduced(scene, protocol, effects), target)

    def cost(effects: Effects, target: float) -> float:
        ours = operations(solved(effects, target))
        return ours / operations(solved(full, target)) if math.isfinite(ours) else math.inf

    def answer(effects: Effects, estimate: float, found_by: FoundBy) -> Recommendation:
        simple, path = reduced(scene, protocol, effects)
        share = 1.0 if effects == full else cost(effects, accuracy)
        scale = math.sqrt(simple.tabor / scene.tabor)
        return Recommendation(simple, path, effects, estimate, found_by, tolerance, quantity, share, scale)

    if scene.spring is not None:
        brackets = dict.fromkeys(every, (0.0, math.inf))
    simplified = simplified_scene(scene, history, tolerance / SHARE)
    for effects in every:
        if simplified.left_out and reduced(scene, history, effects)[0] == simplified.scene:
            brackets[effects] = (0.0, min(brackets[effects][1], simplified.error))
    left = _candidates(every, brackets, tolerance, quantity)
    if best == "cheapest" and left:
        draft = NAMED_TARGETS["draft"]
        left = sorted((effects for effects in left if cost(effects, draft) < 1.0), key=lambda e: cost(e, draft))
    for effects in left:
        if best == "cheapest" and not cost(effects, accuracy) < _WORTH:
            continue
        high = brackets[effects][1]
        if quantity == "force" and _MARGIN * high < tolerance:
            return answer(effects, high, "estimate")
        error = difference(solved(effects, accuracy), solved(full, accuracy), history, quantity)
        if error < _ROOM * tolerance:
            return answer(effects, error, "simulation")
    return answer(full, 0.0, "nothing is left out")


def _candidates(
    every: list[Effects], brackets: dict[Effects, tuple[float, float]], tolerance: float, quantity: Quantity
) -> list[Effects]:
    """The choices that leave something out and may stay within the tolerance, in their order."""
    # With as many terms, with and without adhesion and spring, the terms with the smallest estimate.
    groups = itertools.groupby(every, lambda effects: (effects.terms, effects.adhesion, effects.spring))
    best_terms = [min(group, key=lambda effects: brackets[effects][1]) for _, group in groups]
    simpler = [effects for effects in best_terms if effects != every[-1]]
    if quantity == "force":
        return [effects for effects in simpler if brackets[effects][0] <= _MARGIN * tolerance]
    if quantity == "pull_off_force" and every[-1].adhesion:
        return [effects for effects in simpler if effects.adhesion]
    return simpler


def operations(trajectory: Trajectory) -> float:
    """What a simulation costs, counted in entries of an iteration's matrix; infinite where it did not complete.

    The weights of a step, an elimination and a memory vector were fitted to seconds on random scenes with and without
    adhesion and memory; counted operations follow those to about a quarter.
    """
    if not trajectory.completed:
        return math.inf
    stats = trajectory.stats
    tried = stats.steps + stats.rejections
    if stats.method == "sharp crack":
        return (5500.0 + 1.7 * (stats.memory_vectors + 1) * stats.nodes) * max(tried, stats.iterations)
    return (
        5500.0 * tried
        + stats.iterations * stats.nodes**2
        + 0.4 * stats.factorisations * stats.unknowns_per_solve**3
        + 1.7 * tried * (stats.memory_vectors + 1) * stats.grid_nodes
    )


def difference(trial: Trajectory, truth: Trajectory, history: PiecewiseLinearProtocol, quantity: Quantity) -> float:
    """Error of one trial against another under the same history; infinite where one did not complete."""
    if not (trial.completed and truth.completed):
        return np.inf
    if quantity != "force":
        exact = getattr(truth, quantity)
        return abs(getattr(trial, quantity) - exact) / max(abs(exact), 1e-300)
    times = np.minimum(instants(history), min(trial.time[-1], truth.time[-1]))
    force = truth.at(times)
    return float(np.sqrt(np.mean((trial.at(times) - force) ** 2)) / max(float(np.ptp(force)), 1e-300))


def instants(history: PiecewiseLinearProtocol) -> FloatArray:
    """Where forces are compared: 50 points in each ramp, 20 in each dwell, equally spaced."""
    pieces = [
        begin + (end - begin) * np.arange(1, _POINTS[phase] + 1) / _POINTS[phase]
        for begin, end, phase in zip(history.times[:-1], history.times[1:], history.phases, strict=True)
    ]
    return np.concatenate([history.times[:1], *pieces])


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
    brackets = {}
    for effects in every:
        material = float(np.sqrt(np.mean((force(effects) - exact) ** 2))) / max(scale, 1e-300)
        certain = _LEAST_ADHESION / scale if full.adhesion and not effects.adhesion else 0.0
        # A simpler material changes the adhesive part of the force too, unless the elastic answer is exact anyway.
        touched = full.adhesion and (not effects.adhesion or not effects.everything)
        doubt = _MOST_ADHESION / scene.material.modulus_ratio / scale if touched else 0.0
        brackets[effects] = (max(material - doubt, certain), material + doubt)
    return brackets
