"""How much a result depends on the effective range of adhesion, which stands in for one too short to resolve.

The docstring of `bem.lab.setup` explains this range.
"""

from __future__ import annotations

import dataclasses
import warnings
from typing import TYPE_CHECKING

import numpy as np

from bem.lab.units import readable
from bem.protocol import LoadingProtocol, PiecewiseLinearProtocol

if TYPE_CHECKING:
    from bem.lab.setup import Setup

SENSITIVE = 0.05
"""Relative change of the pull-off force, for an effective range 1.5 times longer, above which a warning is given."""

_RANGE_TEST = 1.5


class EffectiveRangeWarning(UserWarning):
    """A result depends on the effective range of adhesion, which stands in for one too short to resolve."""


def range_sensitivity(setup: Setup, protocol: LoadingProtocol | PiecewiseLinearProtocol) -> float:
    """Relative change of the pull-off force when the effective range is made 1.5 times longer.

    Both are simulated at draft accuracy. It is zero for a range that is the equilibrium gap itself.
    """
    from bem.solver.simulation import simulate

    if not setup.range_is_effective:
        return 0.0
    longer = dataclasses.replace(setup, largest_tabor=max(setup.tabor / _RANGE_TEST, 0.05))
    history = protocol.history(setup.tabor) if isinstance(protocol, LoadingProtocol) else protocol
    moved = PiecewiseLinearProtocol(
        history.times, history.indentations * (setup.gap / longer.gap), phases=history.phases
    )
    found = [simulate(each.scene(), path, "draft") for each, path in ((setup, history), (longer, moved))]
    forces = [trajectory.pull_off_force for trajectory in found]
    return abs(forces[1] / forces[0] - 1.0) if all(np.isfinite(forces)) else np.inf


def warn_of_range(setup: Setup, protocol: LoadingProtocol | PiecewiseLinearProtocol) -> None:
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
