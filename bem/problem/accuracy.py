"""Discretisation parameters for a target error.

One parameter, the target relative error, sets all others: spacing at the contact edge (between third and fourth order,
without adhesion second), spacing elsewhere by the curvature of the traction, length of a time step (third order),
residual of an equilibrium, extent of the mesh.
The named accuracies are targets too. `make measure-accuracy-cost` measures what the constants give.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from typing import NamedTuple

from bem._support.wording import shown
from bem.problem.indenter import PARABOLOID

NAMED_TARGETS = {"draft": 1.7e-2, "standard": 4e-3, "reference": 1.5e-4}
LOOSEST, TIGHTEST = 5e-2, 2e-5
_UNIT_TARGET = 2.8e-3  # at which the constants below hold
# Edge spacings, in widths of the cohesive zone: above, an edge jumps from node to node, unless viscosity holds it back.
_PINNED_ABOVE, _PINNED_ABOVE_VISCOUS = 0.10, 0.37


class Controls(NamedTuple):
    """Parameters of the discretisation, as the kernels take them."""

    edge_spacing: float  # spacing at the contact edge, in widths of the cohesive zone
    curvature: float  # error of linear interpolation allowed between nodes, as a fraction of the traction scale
    growth: float  # largest ratio of neighbouring spacings
    widest: float  # largest spacing inside the contact, as a fraction of its radius
    far_gap: float  # gap at which the mesh ends, in h0
    prediction: float  # predictor minus corrector allowed in one step
    residual: float  # error of the gap equation allowed in an equilibrium, in h0
    fold_increment: float  # indentation step below which a failing step is taken for a fold, in h0
    longest_step: float  # largest step as a fraction of its protocol segment


class BranchControls(NamedTuple):
    """Parameters by which the branch of elastic equilibria is followed; the first three as in `Controls`."""

    edge_spacing: float
    growth: float
    widest: float
    far_gap: float  # gap at which a mesh ends, beyond that on the axis
    first_gap: float  # on the axis; surfaces farther apart hardly deform
    step: float  # of the contact radius, as a fraction of it
    bend: float  # of the force in a step: its difference from what the mean of its rates gives, over the force
    residual: float  # last relative change of a gap
    ring: tuple[float, float]  # widest spacing on the ring where the traction falls, and how far that reaches, in beta


@dataclass(frozen=True)
class Accuracy:
    """A target relative error of pull-off force, hysteresis and force history, and the controls that meet it."""

    target: float

    @property
    def _ratio(self) -> float:
        """The target over that of the constants; a coarser mesh than a draft's saves nothing and loses its edge."""
        return min(self.target, NAMED_TARGETS["draft"]) / _UNIT_TARGET

    def controls(self, resistance: float = 1.0) -> Controls:
        """Discretisation for this target; spacing and step shrink with their orders of convergence.

        Args:
            resistance: how much viscosity holds a moving contact edge back, from 0 (not at all, it sticks at the nodes
                of a coarse mesh) to 1; see `bem.methods.boundary_elements.meshes.cohesive_zone`.

        Returns:
            The tolerances and spacings that the solver uses.
        """
        ratio = self._ratio
        tight = ratio < 1.0
        if tight:  # the shallowest contacts converge a little more slowly than the others
            ratio **= 1.1
        spacing = (0.11 + 0.10 * resistance) * ratio ** (0.35 if tight else 0.27)
        limit = _PINNED_ABOVE + resistance**2 * (_PINNED_ABOVE_VISCOUS - _PINNED_ABOVE)
        wider = ratio ** (0.3 if tight else 0.2)
        return Controls(
            edge_spacing=min(spacing, limit),
            curvature=0.05 * ratio ** (0.7 if tight else 0.5),
            growth=1.0 + 0.24 * wider,
            widest=0.12 * wider,
            prediction=0.022 * ratio ** (0.75 if tight else 1.0),
            **_shared(ratio),
        )

    def branch_controls(self, tabor: float, fineness: float = 1.0, exponent: float = PARABOLOID) -> BranchControls:
        """The same for the branch of elastic equilibria; `fineness` is that of the traction law."""
        ratio = self.target / NAMED_TARGETS["standard"]
        finer, apart = min(ratio**0.3, 1.15), min(ratio, 1.0) ** -0.18
        power = (2.0 * exponent - 1.0) / (4.0 * exponent - 1.0)
        flat = flatness(exponent)
        first_gap = max(9.0, 4.0 * tabor**power) * apart  # spheres snap on at a gap of 2.64 mu^(3/7)
        return BranchControls(
            edge_spacing=0.11 * finer * fineness**1.25 * flat,
            growth=1.0 + 0.24 * finer,
            widest=0.12 * finer * flat**2,
            far_gap=max(40.0 / finer, 2.0 * first_gap),
            first_gap=first_gap,
            step=0.2 * finer * fineness**0.5 * flat,
            bend=30.0 * self.target,
            residual=1e-3 * min(ratio, 1.0),
            ring=(0.09 * min(fineness, 0.35) / tabor, 8.0 / tabor),
        )

    def line_controls(self) -> Controls:
        """The same, finer: without adhesion, where the traction is interpolated linearly, and on a grid that moves."""
        ratio = self._ratio
        if ratio < 1.0:
            ratio **= 1.1
        capped = min(ratio, 4.0) ** 0.35
        return Controls(
            edge_spacing=min(0.10 * ratio**0.5, 0.12),
            curvature=4e-3 * ratio,
            growth=1.0 + 0.15 * capped,
            widest=0.07 * capped,
            prediction=0.03 * ratio**0.75,
            **_shared(ratio),
        )


def flatness(exponent: float) -> float:
    """Factor of the spacing at the edge of a flat indenter, whose pressure grows towards the edge; 1 for others."""
    return min((PARABOLOID / exponent) ** 0.5, 1.0)


def _shared(ratio: float) -> dict[str, float]:
    """What all controls have in common."""
    return {
        "far_gap": 20.0 * min(max(ratio, 0.02), 2.0) ** -0.3,
        "residual": min(2e-5 * ratio, 1e-4),
        "fold_increment": 3e-4 * min(ratio, 1.0) ** 0.5,
        "longest_step": min(0.1 * ratio**0.3, 0.2),
    }


def resolve_accuracy(accuracy: str | float) -> Accuracy:
    """Return the accuracy of a name or a target relative error.

    Raises:
        ValueError: for an unknown name or a target outside [2e-5, 0.05].
    """
    if isinstance(accuracy, str) and accuracy in NAMED_TARGETS:
        return Accuracy(NAMED_TARGETS[accuracy])
    if isinstance(accuracy, Real) and not isinstance(accuracy, bool) and TIGHTEST <= float(accuracy) <= LOOSEST:
        return Accuracy(float(accuracy))
    names = ", ".join(repr(name) for name in NAMED_TARGETS)
    raise ValueError(
        f"accuracy must be {names} or a target relative error from {TIGHTEST:g} to {LOOSEST:g}; "
        f"received {shown(accuracy)}"
    )
