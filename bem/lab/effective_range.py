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

`range_sensitivity` measures how much the pull-off force depends on it, and `simulate` warns.
"""

from __future__ import annotations

import dataclasses
import warnings
from typing import TYPE_CHECKING

import numpy as np

from bem.lab.units import readable
from bem.protocol import PiecewiseLinearProtocol, Protocol, history_of

if TYPE_CHECKING:
    from bem.lab.setup import Setup

SENSITIVE = 0.05
"""Relative change of the pull-off force, for an effective range 1.5 times longer, above which a warning is given."""

_RANGE_TEST = 1.5


class EffectiveRangeWarning(UserWarning):
    """A result depends on the effective range of adhesion, which stands in for one too short to resolve."""


def range_sensitivity(setup: Setup, protocol: Protocol) -> float:
    """Relative change of the pull-off force when the effective range is made 1.5 times longer.

    Both are simulated at draft accuracy. It is zero for a range that is the equilibrium gap itself.
    """
    from bem.solver.simulation import simulate

    if not setup.range_is_effective:
        return 0.0
    longer = dataclasses.replace(setup, largest_tabor=max(setup.tabor / _RANGE_TEST, 0.05))
    history = history_of(protocol, setup.tabor)
    moved = history
    if isinstance(history, PiecewiseLinearProtocol):
        depths = history.indentations * (setup.gap / longer.gap)
        moved = PiecewiseLinearProtocol(history.times, depths, phases=history.phases)
    found = [simulate(each.scene(), path, "draft") for each, path in ((setup, history), (longer, moved))]
    forces = [trajectory.pull_off_force for trajectory in found]
    return abs(forces[1] / forces[0] - 1.0) if all(np.isfinite(forces)) else np.inf


def warn_of_range(setup: Setup, protocol: Protocol) -> None:
    """Warn, at the caller's caller, where the pull-off force under a protocol depends on the range."""
    change = range_sensitivity(setup, protocol)
    if change > SENSITIVE:
        warnings.warn(
            f"the pull-off force depends on the effective range of adhesion, {readable(setup.gap, 'm')} in place of "
            f"{readable(setup.equilibrium_gap, 'm')}: it changes by {100 * change:.0f} % when the range is "
            f"{_RANGE_TEST:g} times longer; a largest_tabor above {setup.largest_tabor:g} brings the range nearer",
            EffectiveRangeWarning,
            stacklevel=3,
        )
