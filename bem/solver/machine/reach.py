"""The machine of a scene in numbers, and how deep its sphere can go.

Units: indentation in h0, force in pi R dgamma.
"""

import math

from bem.protocol import ForceProtocol, PiecewiseLinearProtocol
from bem.scene import Scene
from bem.solver.machine.compliance import Machine
from bem.tractions import HardContact

_NUMERICAL = 1e3  # compliance of the numerical spring, over that of a contact at the scale of its force
_MOST_TENSION = 2.0  # of an elastic contact: without deformation (DMT); short-range adhesion (JKR) gives less


def machine_of(scene: Scene, by_force: bool, force_scale: float) -> Machine:
    """The machine of a scene; `force_scale` is the force below which one counts as small."""
    depth_scale = scene.tabor * (0.75 * math.pi * force_scale) ** (2.0 / 3.0)  # Hertz
    if by_force:
        travel = depth_scale / force_scale
        return Machine(_NUMERICAL * travel, True, travel, depth_scale)
    return Machine(0.0 if scene.spring is None else 1.0 / scene.spring, False, 1.0, depth_scale)


def deepest_indentation(scene: Scene, path: PiecewiseLinearProtocol | ForceProtocol) -> float:
    """Upper bound of the sphere's indentation: that of the relaxed solid, with the tension of a rigid sphere (DMT).

    With deformation the sphere goes less deep at the same force.
    """
    tension = 0.0 if isinstance(scene.adhesion, HardContact) else _MOST_TENSION
    if isinstance(path, ForceProtocol):
        return float(scene.tabor * (0.75 * math.pi * max(tension - path.forces.min(), 0.0)) ** (2.0 / 3.0))
    top = float(path.indentations.max())
    if scene.spring is None:
        return top
    # Newton's method for delta = top + (tension - F_Hertz(delta)) / k, which is convex, from an upper bound.
    depth = top + tension / scene.spring
    for _ in range(100):
        hertz = 4.0 / (3.0 * math.pi) * (max(depth, 0.0) / scene.tabor) ** 1.5
        excess = depth - top - (tension - hertz) / scene.spring
        change = excess / (1.0 + 1.5 * hertz / max(depth, 1e-300) / scene.spring)
        depth -= change
        if abs(change) <= 1e-12 * abs(depth):
            break
    return depth
