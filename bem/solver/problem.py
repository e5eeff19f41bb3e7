"""A scene in the terms of the kernels: numbers and arrays only, with the weights by which errors are judged."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bem._numerics.jit import in_python
from bem.accuracy import Controls
from bem.reference_solutions import hertz
from bem.scene import Scene
from bem.solver.discretisation.cohesive_zone import largest_contact_radius
from bem.solver.discretisation.hat_influence import kernel_series
from bem.solver.discretisation.influence import require_mesh
from bem.solver.discretisation.master_grid import Grid, master_grid, moves
from bem.solver.discretisation.mesh import Mesh, fixed_mesh
from bem.solver.machine.compliance import Machine
from bem.solver.machine.reach import machine_of
from bem.solver.stepping.extrapolation import Scales
from bem.tractions import HardContact, Law, law_of

_NOISE = 0.04
_LOCAL_WEIGHT_ELASTIC = 0.1  # the next step depends on what happens at the edge only where it is remembered


class Problem(NamedTuple):
    """One scene, discretised."""

    tabor: float
    law: Law
    nonadhesive: bool
    strengths: np.ndarray  # (m,) of the material
    times: np.ndarray  # (m,)
    controls: Controls
    grid: Grid  # the first, if it moves
    series: np.ndarray  # of the kernel, for the next; (0, 0) where the grid stays
    fixed_mesh: bool
    scales: Scales
    force_error: float  # allowed in an equilibrium, relative; far below what the prediction is judged by
    least_force: float  # no history can be more compressive
    audit: bool  # whether the stability of each accepted state is checked again
    machine: Machine


def discretise(
    scene: Scene,
    deepest: float,
    controls: Controls,
    mesh: ArrayLike | None,
    audit: bool = False,
    by_force: bool = False,
    moving: bool = False,
) -> tuple[Problem, Mesh]:
    """The problem of a scene, and the user's own mesh, empty where there is none.

    Args:
        scene: Tabor parameter, material, adhesion and spring.
        deepest: largest indentation of the sphere, in h0.
        controls: of the accuracy.
        mesh: radii (n,) of a fixed mesh, or None.
        audit: whether the stability of each accepted state is checked again.
        by_force: whether the protocol prescribes the force.
        moving: whether the grid has to move, also where one that stays is small enough.

    Raises:
        ValueError: for a mesh that ends inside the contact, or is none.
        MemoryError: for a contact that needs more grid nodes than are allowed.
    """
    nonadhesive = isinstance(scene.adhesion, HardContact)
    tabor, material = scene.tabor, scene.material
    strengths, times = np.array(material.strengths), np.array(material.times)
    glassy_hertz = float(hertz.force_from_indentation(max(deepest, 0.0), tabor)) / material.modulus_ratio
    force_scale = max(3e-2 * abs(glassy_hertz) * material.modulus_ratio, 1e-12) if nonadhesive else 1.0
    # The stiffer the glass, the fewer steps the gaps alone would give to a fast pull-off.
    force_weight = min(max(2.0, 0.2 / material.modulus_ratio), 20.0)
    radii = np.zeros(0)
    if mesh is not None:
        radii = require_mesh(mesh)
        contact = largest_contact_radius(deepest, tabor, nonadhesive)
        if radii[-1] <= contact:
            raise ValueError(
                f"mesh must reach beyond the contact, whose radius can be {contact:.4g}; received one that ends at "
                f"{radii[-1]:.4g}"
            )
    own_mesh = fixed_mesh(tabor, radii, strengths.size > 0)
    remembers = strengths.size > 0
    grid = own_mesh.grid if radii.size else master_grid(tabor, deepest, nonadhesive, controls, remembers, moving)
    problem = Problem(
        tabor=tabor,
        law=law_of(scene.adhesion),
        nonadhesive=nonadhesive,
        strengths=strengths,
        times=times,
        controls=controls,
        grid=grid,
        series=kernel_series() if in_python(moves)(grid) else np.empty((0, 0)),
        fixed_mesh=mesh is not None,
        scales=Scales(force_scale, force_weight, 1.0 if strengths.size else _LOCAL_WEIGHT_ELASTIC),
        # Extrapolation adds the errors of three states up to sevenfold; the step must not be chosen by them.
        force_error=_NOISE * controls.prediction / force_weight,
        least_force=1.05 * glassy_hertz - 4.0 / material.modulus_ratio,
        audit=audit,
        machine=machine_of(scene, by_force, force_scale),
    )
    return problem, own_mesh
