"""The elastic sphere in other software: Adhesion with its Lennard-Jones law, tamaas without adhesion.

Both use a square grid on a half-space that is not periodic. The sphere's radius, the equilibrium gap h0 and the work of
adhesion are 1. The contact modulus is therefore tabor^(-3/2), and lengths along the surface are sqrt(tabor) times those
of `bem`. Indentation and forces are those of `bem.trajectory`. Neither package is needed to import this module.

Sources: `Adhesion.Interactions.Lj82` is the law of `bem.tractions`; for tamaas, Polonsky and Keer, Wear 231 (1999) 206.
"""

import math
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from bem._support.jit import in_python
from bem.discretisation.cohesive_zone import largest_contact_radius
from bem.reference_solutions import hertz
from bem.tractions import tail_force

PACKAGES = ("Adhesion", "tamaas")
INSTALL = ".venv/bin/python -m pip install --no-build-isolation --editable '.[peers]'"
"""The command that installs them beside this project."""
STEP, FINER = 0.25, 4
"""Indentation between two states while unloading, and the factor by which it is finer near the largest force.

A parabola through the three highest states gives the largest tension.
"""
EDGE_GAP = 5.0
"""Gap at the edge of the grid, in h0; the attraction outside the grid is added in closed form, as in the solver."""
ENOUGH = 0.8  # on a coarse grid the edge retreats node by node; the force then falls and rises, but by less than this
CHANGE = 1e-5  # of the displacement, at which a minimisation ends
LEAST_GAP = 0.6  # of a first guess; the law overflows at smaller gaps
TOLERANCE = 1e-6
MARGIN = 1.1  # half the width of the grid over the contact radius, for a contact without adhesion


def installed() -> dict[str, str]:
    """Versions of the packages.

    Raises:
        RuntimeError: One of them is not installed.
    """
    try:
        return {name: version(name) for name in PACKAGES}
    except PackageNotFoundError as error:
        raise RuntimeError(f"{' and '.join(PACKAGES)} must be installed: {INSTALL}") from error


def sphere(width: float, grid: int) -> np.ndarray:
    """Heights of a paraboloid of radius 1, highest at the node in the middle, (grid, grid)."""
    along = (np.arange(grid) - grid // 2) * width / grid
    return -0.5 * np.add.outer(along**2, along**2)


def force_beyond(half_width: float, indentation: float) -> float:
    """Tension that acts outside a square grid on an undeformed sphere, from the tail of the law."""
    reach = half_width / np.cos(np.linspace(0.0, 0.25 * np.pi, 201))
    return float(np.mean(in_python(tail_force)(1.0 + 0.5 * reach**2 - indentation)))


def adhesion_largest_tension(tabor: float, grid: int, start: float) -> float:
    """Largest tension while an elastic sphere is unloaded, by Adhesion with `grid` points a side.

    Every state minimises the energy from the last one, by Newton's method with the package's product of the Hessian
    (`Newton-CG` of SciPy), which takes fewer seconds than its default, L-BFGS. Unloading ends where the force has
    fallen to `ENOUGH` of the largest.

    Raises:
        RuntimeError: A minimisation failed.
    """
    from Adhesion.Interactions import Lj82
    from Adhesion.System import SmoothContactSystem
    from ContactMechanics import FreeFFTElasticHalfSpace
    from SurfaceTopography import Topography

    half_width = math.sqrt(tabor * largest_contact_radius(start, tabor) ** 2 + 2.0 * EDGE_GAP)
    size = (2.0 * half_width, 2.0 * half_width)
    heights = sphere(size[0], grid)
    half_space = FreeFFTElasticHalfSpace((grid, grid), tabor**-1.5, size)
    system = SmoothContactSystem(half_space, Lj82(1.0, 1.0), Topography(heights, physical_sizes=size, periodic=False))

    def state(depth: float, guess: np.ndarray) -> tuple[float, np.ndarray]:
        offset, first = depth - 1.0, guess.copy()
        np.maximum(first[:grid, :grid], heights + offset + LEAST_GAP, out=first[:grid, :grid])
        found = system.minimize_proxy(
            offset=offset,
            initial_displacements=first,
            method="Newton-CG",
            hessp=system.hessian_product_function(offset),
            options={"xtol": CHANGE},
        )
        if not found.success:
            raise RuntimeError(f"Adhesion found no state at indentation {depth:g}, tabor {tabor:g}: {found.message}")
        force = -system.compute_normal_force() / math.pi + force_beyond(half_width, depth)
        return force, found.x.reshape(first.shape)

    forces, displacements = list[float](), [np.zeros(half_space.nb_subdomain_grid_pts)]
    while not forces or max(forces) <= 0.0 or forces[-1] > ENOUGH * max(forces):
        force, displacement = state(start - STEP * len(forces), displacements[-1])
        forces.append(force)
        displacements.append(displacement)
    before = max(int(np.argmax(forces)) - 1, 0)
    fine, displacement = [forces[before]], displacements[before + 1]
    for part in range(1, 2 * FINER + 1):
        force, displacement = state(start - STEP * (before + part / FINER), displacement)
        fine.append(force)
    return highest(np.array(fine))


def highest(values: np.ndarray) -> float:
    """Height of the parabola through the largest of equally spaced values (n,) and its neighbours."""
    place = int(np.argmax(values))
    if not 0 < place < len(values) - 1:
        return float(values[place])
    left, top, right = values[place - 1 : place + 2]
    bend = left - 2.0 * top + right
    return float(top - 0.125 * (right - left) ** 2 / bend) if bend < 0.0 else float(top)


def tamaas_hertz(tabor: float, grid: int, indentation: float) -> float:
    """Compression of an elastic sphere without adhesion over Hertz's at the same indentation, by one state of tamaas.

    tamaas finds the pressures for a given force, here Hertz's force at `indentation`. Its indentation is the
    displacement in the middle of the contact, and the forces are compared at that indentation.
    """
    import tamaas

    tamaas.initialize(1)
    tamaas.set_log_level(tamaas.LogLevel.warning)
    modulus, radius = tabor**-1.5, math.sqrt(indentation)
    width = 2.0 * MARGIN * radius
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [width, width], [grid, grid])
    model.E, model.nu = modulus, 0.0
    tamaas.ModelFactory.registerNonPeriodic(model, "half-space")
    solver = tamaas.PolonskyKeerRey(model, sphere(width, grid), TOLERANCE)
    solver.setIntegralOperator("half-space")
    solver.solve(4.0 / 3.0 * modulus * radius**3 / width**2)
    displacement = np.zeros_like(model.displacement)
    model.operators["half-space"](model.traction, displacement)
    force = -float(model.traction.sum()) * (width / grid) ** 2 / math.pi
    return force / float(hertz.force_from_indentation(float(displacement[grid // 2, grid // 2]), tabor))
