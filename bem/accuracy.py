"""Discretisation parameters for a target error.

One parameter, the target relative error, sets all others: spacing at the contact edge (between third and fourth order,
without adhesion second), spacing elsewhere by the curvature of the traction, length of a time step (third order),
residual of an equilibrium, extent of the mesh.
The named accuracies are targets too. The constants were chosen by `make bench-solver`, which measures what they give.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from typing import NamedTuple

from bem._support.wording import shown

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


@dataclass(frozen=True)
class Accuracy:
    """A target relative error of pull-off force, hysteresis and force history, and the controls that meet it."""

    name: str
    target: float

    def controls(self, resistance: float = 1.0, adhesive: bool = True) -> Controls:
        """Discretisation for this target; spacing and step shrink with their orders of convergence.

        Args:
            resistance: how much viscosity holds a moving contact edge back, from 0 (not at all, it sticks at the nodes
                of a coarse mesh) to 1; see `bem.solver.discretisation.cohesive_zone`.
            adhesive: whether there is adhesion; without it the traction has a kink at the edge, and is interpolated
                linearly.

        Returns:
            The tolerances and spacings that the solver uses.
        """
        ratio = self.target / _UNIT_TARGET
        tight = ratio < 1.0
        if tight:  # the shallowest contacts converge a little more slowly than the others
            ratio **= 1.1
        if not adhesive:
            return self.line_controls()
        spacing = (0.11 + 0.10 * resistance) * ratio ** (0.35 if tight else 0.27)
        limit = _PINNED_ABOVE + resistance**2 * (_PINNED_ABOVE_VISCOUS - _PINNED_ABOVE)
        wider = ratio ** (0.3 if tight else 0.2)
        return Controls(
            edge_spacing=min(spacing, limit),
            curvature=0.05 * ratio ** (0.7 if tight else 0.5),
            growth=1.0 + 0.24 * wider,
            widest=0.12 * wider,
            far_gap=_far_gap(ratio),
            prediction=0.022 * ratio ** (0.75 if tight else 1.0),
            residual=min(2e-5 * ratio, 1e-4),
            fold_increment=_fold_increment(ratio),
            longest_step=_longest_step(ratio),
        )

    def line_controls(self, elastic: bool = False) -> Controls:
        """The same where the traction is interpolated linearly: without adhesion, and on a grid that moves.

        Args:
            elastic: whether the material has no memory; its loop loses little energy and needs a smaller error.

        Returns:
            The tolerances and spacings that the solver uses.
        """
        ratio = self.target / _UNIT_TARGET
        if ratio < 1.0:
            ratio **= 1.1
        capped = min(ratio, 4.0)
        return Controls(
            edge_spacing=min(0.10 * ratio**0.5, 0.10 if elastic else 0.12),
            curvature=4e-3 * ratio,
            growth=1.0 + (0.12 * capped**0.15 if elastic else 0.15 * capped**0.35),
            widest=0.05 * capped**0.15 if elastic else 0.07 * capped**0.35,
            far_gap=_far_gap(ratio),
            prediction=0.03 * ratio**0.75,
            residual=min(2e-5 * ratio, 1e-4),
            fold_increment=_fold_increment(ratio),
            longest_step=_longest_step(ratio),
        )


def _far_gap(ratio: float) -> float:
    return 20.0 * min(max(ratio, 0.02), 2.0) ** -0.3


def _fold_increment(ratio: float) -> float:
    return 3e-4 * min(ratio, 1.0) ** 0.5


def _longest_step(ratio: float) -> float:
    return min(0.1 * ratio**0.3, 0.2)


def resolve_accuracy(accuracy: str | float) -> Accuracy:
    """Return the accuracy of a name or a target relative error.

    Raises:
        ValueError: for an unknown name or a target outside [2e-5, 0.05].
    """
    if isinstance(accuracy, str) and accuracy in NAMED_TARGETS:
        return Accuracy(accuracy, NAMED_TARGETS[accuracy])
    if isinstance(accuracy, Real) and not isinstance(accuracy, bool) and TIGHTEST <= float(accuracy) <= LOOSEST:
        return Accuracy(f"{float(accuracy):g}", float(accuracy))
    names = ", ".join(repr(name) for name in NAMED_TARGETS)
    raise ValueError(
        f"accuracy must be {names} or a target relative error from {TIGHTEST:g} to {LOOSEST:g}; "
        f"received {shown(accuracy)}"
    )
