"""Effects of a scene that are too small to matter, with a bound of the error that leaving them out makes.

What is left out saves a memory vector, a finer grid, or a search for jumps; all bounds together stay below a tenth of
the wanted error. They are of the force, relative to the pull-off force or to the largest, whichever errs more. With c
the strength of a term, tau its time, k the modulus ratio and S the largest stiffness of the contact, that of a glassy
Hertz contact and the steepest attraction:

- A small term changes the instantaneous modulus, and so the force that a fast crack may take, by c/k.
- A fast term, treated as relaxed, lags behind the indentation by d = c tau rate / k. At a fold, where a branch of
  equilibria turns as a parabola, the jump is late by d^(2/3); elsewhere the force errs by S d.
- A slow term, treated as frozen, creeps by c T / (tau k) in a history of length T. The attraction before contact, at
  the gap g, has deformed it at a relaxed start by (16 sqrt(2)/3) c mu^(1/2) g^(-5/2) at most: the largest traction of
  the undeformed sphere on a disc of the radius over which it acts.
- A stiff spring moves the sphere by P over its stiffness, which changes the force by S over that stiffness.

Hysteresis errs by the bound times the turnover. Units as in `bem.problem.scene`. Sources: Johnson, Contact Mechanics
(1985), section 3.4 and 4.2; Strogatz, Nonlinear Dynamics and Chaos (2015), section 4.3, for the delay at a fold.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bem.problem.materials import Elastic, PronySeries, StandardLinearSolid
from bem.problem.protocol import ForceProtocol, PiecewiseLinearProtocol
from bem.problem.scene import SMALLEST_TABOR, Scene
from bem.problem.tractions import HardContact

SHARE = 0.1  # of the wanted error
_STEEPEST = 12.0  # fall of the force of rigid surfaces with the gap, in pi R dgamma / h0, up to their contact


class SimplifiedScene(NamedTuple):
    """A scene without what is too small to matter."""

    scene: Scene
    left_out: tuple[str, ...]
    error: float  # bound, relative


def without_terms(scene: Scene, relaxed: np.ndarray, frozen: np.ndarray) -> Scene:
    """The scene whose `relaxed` terms (m,) have relaxed before anything moves, and whose `frozen` ones (m,) never do.

    What is left without the frozen terms is stiffer; force and indentation keep their units, and the Tabor parameter
    follows the relaxed modulus.
    """
    strengths, times = scene.material.strengths, scene.material.times
    kept = ~(relaxed | frozen)
    if np.all(kept):
        return scene
    left = 1.0 - float(strengths[frozen].sum())
    material: Elastic | StandardLinearSolid | PronySeries = Elastic()
    if np.any(kept):
        material = PronySeries(strengths[kept] / left, times[kept])
        if times[kept].tolist() == [1.0]:
            material = StandardLinearSolid(material.modulus_ratio)
    return replace(scene, tabor=scene.tabor * left ** (2.0 / 3.0), material=material)


def simplified_scene(
    scene: Scene, path: PiecewiseLinearProtocol | ForceProtocol, target: float, glassy: bool = False
) -> SimplifiedScene:
    """The scene without the effects whose bounds add up to less than a tenth of the `target`, smallest first.

    Without adhesion nothing is left out: closed forms take what there is; and nothing beside an indenter other than the
    paraboloid, of which the bounds are. `glassy` is whether the surfaces have met just before the start.
    """
    material, allowed = scene.material, SHARE * target
    irreducible = isinstance(scene.adhesion, HardContact) or scene.indenter is not None
    if irreducible or (material.strengths.size == 0 and scene.spring is None):
        return SimplifiedScene(scene, (), 0.0)
    strengths, times, k = material.strengths, material.times, material.modulus_ratio
    if isinstance(path, ForceProtocol):
        radius, fastest, gap = math.inf, math.inf, 0.0
    else:
        radius = math.sqrt(max(float(path.indentations.max()), 0.0) / scene.tabor) + 2.0  # JKR adds less
        fastest, gap = float(np.abs(path.rates).max()), 1.0 - float(path.indentations[0])
    stiffness = _STEEPEST + 2.0 * radius / (math.pi * scene.tabor * k)
    lag = strengths * times * fastest / k
    small, fast = strengths / k, lag ** (2.0 / 3.0) + stiffness * lag
    creep = strengths / k * path.duration / times
    dent = strengths * 7.6 * math.sqrt(scene.tabor) * gap**-2.5 if gap > 1.0 else math.inf
    slow = creep if glassy else creep + dent
    bounds = np.minimum(np.minimum(small, fast), slow)
    relaxed, frozen = np.zeros(strengths.size, bool), np.zeros(strengths.size, bool)
    left_out, error, spring = [], 0.0, scene.spring
    if spring is not None and stiffness / spring < allowed and not isinstance(path, ForceProtocol):
        error, spring = stiffness / spring, None
        left_out.append(f"spring of {scene.spring:g}")
    for i in np.argsort(bounds):
        if error + bounds[i] >= allowed or scene.tabor * (1.0 - strengths[frozen].sum()) < 2.0 * SMALLEST_TABOR:
            break
        error += float(bounds[i])
        frozen[i] = creep[i] < fast[i] and bounds[i] < fast[i]
        relaxed[i] = not frozen[i]
        reason = "small" if bounds[i] == small[i] else "slow" if frozen[i] else "fast"
        left_out.append(f"{reason} term of strength {strengths[i]:g} and time {times[i]:g}")
    if not left_out:
        return SimplifiedScene(scene, (), 0.0)
    return SimplifiedScene(without_terms(replace(scene, spring=spring), relaxed, frozen), tuple(left_out), error)
