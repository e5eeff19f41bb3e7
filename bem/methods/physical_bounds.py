"""Bounds that no contact breaks, which a trajectory is held against before it is called completed.

- All numbers are finite.
- Rigid surfaces that touch bear the largest tension of an elastic paraboloid, 2 for every law of unit work of adhesion
  (Bradley, DMT), and rigid ones that of a flatter tip. A sharper one, or one in a dent that a viscoelastic solid
  remembers, bears less than the rigid one and JKR's together. Without adhesion there is no tension.
- A crack in a solid of the modulus ratio k takes up to 1/k of the work of adhesion. By JKR the tension grows with the
  work to the power (n + 1) / (2 n - 1), 1 for the paraboloid. Nothing but the glassy solid of Hertz presses more.
- What is put into an elastic contact is stored in it or lost in its jumps, which gain nothing.

Units: as in `bem.results.trajectory`. Sources: Bradley, Phil. Mag. 13 (1932) 853; Maugis, Contact, Adhesion and Rupture
of Elastic Solids (2000), chapter 4; Persson and Brener, Phys. Rev. E 71 (2005) 036123, for the factor 1/k.
"""

import functools
from collections.abc import Hashable

import numpy as np

from bem._support.jit import uncompiled
from bem._support.validation import FloatArray
from bem.methods.closed_forms import dmt, jkr
from bem.methods.outcomes import COMPLETED, DETACHED, NOT_BALANCED, NOT_FINITE, TOO_MUCH_TENSION, UNPHYSICAL
from bem.methods.records import MarchResult
from bem.problem.indenter import PARABOLOID
from bem.problem.scene import Scene
from bem.problem.tractions import GAP_AT_PEAK, HardContact, LennardJones, TractionLaw, traction

_BALANCED = 0.5  # error of the work by the trapezoidal rule, over that of both ways; steps go with the third root
_ROUNDING = 1e-9  # of forces, over the largest
_LEAST_EXCESS = 1e-3  # share by which the tension may exceed its bound, which itself is computed to a tenth of that
_FAR = 1e4  # gap beyond which rigid surfaces hardly attract each other


def most_tension(scene: Scene) -> float:
    """Upper bound of the tension in any history of a scene."""
    if isinstance(scene.adhesion, HardContact):
        return 0.0
    n, k = scene.exponent, scene.material.modulus_ratio
    if n == PARABOLOID:
        return dmt.PULL_OFF_FORCE / k
    law = scene.adhesion
    rigid = (rigid_tension if isinstance(law, Hashable) else rigid_tension.__wrapped__)(scene.tabor, n, law)
    if n > PARABOLOID and k == 1.0:
        return rigid
    return (rigid + jkr.pull_off_force(n)) / k ** max((n + 1.0) / (2.0 * n - 1.0), 1.0)


@functools.lru_cache(maxsize=64)
def rigid_tension(tabor: float, exponent: float, adhesion: LennardJones | TractionLaw) -> float:
    """Largest tension of a rigid indenter over all gaps g on its axis, 2 int sigma(g + mu r^n / n) r dr."""
    unit, peak, end = 1.0, GAP_AT_PEAK, _FAR
    if isinstance(adhesion, TractionLaw):
        unit, peak, end = adhesion.repulsion[1], adhesion.peak_gap, adhesion.breaks[-1]
    nearest = np.linspace(1.0 - 0.3 * unit, peak, 40)[:, None]
    root = np.geomspace(1e-9, 1.0, 2000) * end ** (1.0 / exponent)
    parts = _traction(adhesion, nearest + root**exponent) * root
    integrals = (parts[:, 1:] + parts[:, :-1]) @ np.diff(root)
    return float(exponent * (exponent / tabor) ** (2.0 / exponent - 1.0) * integrals.max())


def _traction(adhesion: LennardJones | TractionLaw, gap: FloatArray) -> FloatArray:
    if not isinstance(adhesion, TractionLaw):
        return np.asarray(uncompiled(traction)(gap))
    first, last, (scale, unit) = adhesion.breaks[0], adhesion.breaks[-1], adhesion.repulsion
    pressed = scale * uncompiled(traction)(1.0 + (np.minimum(gap, first) - 1.0) / unit)
    inside = adhesion.traction(np.clip(gap, first, last).ravel()).reshape(gap.shape)
    return np.where(gap < first, pressed, np.where(gap < last, inside, 0.0))


def within_bounds(result: MarchResult, scene: Scene, least_force: float, target: float) -> MarchResult:
    """The result, with the outcome that says which bound it breaks where it was completed and breaks one.

    Args:
        result: of any method.
        scene: what was simulated.
        least_force: no history can be more compressive.
        target: relative error that is allowed.
    """
    if result.outcome not in (COMPLETED, DETACHED):
        return result
    records, jumps = result.records, result.jumps
    depth, force, lost = records["indentation"], records["force"], jumps["energy_lost"]
    columns = [records[name] for name in records.dtype.names or ()] + [jumps["force_before"], jumps["force_after"]]
    if not all(np.isfinite(column).all() for column in columns):
        return result._replace(outcome=NOT_FINITE)
    if not force.size:
        return result
    rounding = _ROUNDING * max(float(-force.min()), 1.0)
    if force.max() > most_tension(scene) * (1.0 + max(target, _LEAST_EXCESS)) + rounding:
        return result._replace(outcome=TOO_MUCH_TENSION)
    if force.min() < least_force - rounding:
        return result._replace(outcome=UNPHYSICAL)
    known = np.isfinite(result.energies).all()  # a sharp crack states none
    if scene.material.strengths.size == 0 and result.outcome == COMPLETED and known:
        mean, change = 0.5 * (force[1:] + force[:-1]), np.diff(depth)
        allowed = _BALANCED * target ** (2.0 / 3.0) * (1.0 + float(np.abs(mean * change).sum()))
        stored = float(result.energies[1] - result.energies[0])
        gained = lost.size > 0 and lost.min() < -allowed
        if gained or not abs(stored + lost.sum() + (mean * change).sum()) <= allowed:
            return result._replace(outcome=NOT_BALANCED)
    return result
