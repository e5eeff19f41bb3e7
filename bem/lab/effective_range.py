"""How much a result depends on the effective range of adhesion, which stands in for one too short to resolve.

Surfaces attract over a few angstroms, so that a soft sphere of micrometres has a Tabor parameter of hundreds, beyond
what a mesh resolves. The gap h0 is then an effective range: the setup chooses it so that the Tabor parameter is
`largest_tabor`. Its meaning depends on the material:

- In an elastic contact it is a numerical choice. The force curve in newtons and metres no longer depends on it once mu
  is large, in the JKR limit.
- In a viscoelastic contact it is a length of the material. The edge of the contact dissipates at the frequency at which
  it crosses the cohesive zone, so that a longer range acts like a shorter retardation time at the edge, though not in
  the bulk. A pull-off force that depends on speed depends on the range too, and a fitted retardation time belongs to
  it.

`range_sensitivity` measures how much the pull-off force depends on it, and `Setup.simulate` warns.
"""

from __future__ import annotations

import numpy as np

from bem.protocol import PiecewiseLinearProtocol, Protocol, history_of
from bem.scene import Scene

SENSITIVE = 0.05
"""Relative change of the pull-off force, for an effective range 1.5 times longer, above which a warning is given."""

LONGER = 1.5
"""How much longer the range is made that is compared with."""


class EffectiveRangeWarning(UserWarning):
    """A result depends on the effective range of adhesion, which stands in for one too short to resolve."""


def range_sensitivity(scene: Scene, longer: Scene, stretch: float, protocol: Protocol) -> float:
    """Relative change of the pull-off force of a scene when its gap h0 is made longer.

    Both are simulated at draft accuracy.

    Args:
        scene: the contact.
        longer: the same contact in units of a longer gap.
        stretch: that gap, over the one of `scene`.
        protocol: in the units of `scene`.
    """
    from bem.solver.simulation import simulate

    history = history_of(protocol, scene.tabor)
    moved = history
    if isinstance(history, PiecewiseLinearProtocol):
        moved = PiecewiseLinearProtocol(history.times, history.indentations / stretch, phases=history.phases)
    found = [simulate(each, path, "draft") for each, path in ((scene, history), (longer, moved))]
    forces = [trajectory.pull_off_force for trajectory in found]
    return abs(forces[1] / forces[0] - 1.0) if all(np.isfinite(forces)) else np.inf
