"""A scene in the terms of the kernels: numbers and arrays only, with the weights by which errors are judged.

Units: indentation in h0, force in pi R dgamma, compliance in h0 per pi R dgamma.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bem._support.jit import uncompiled
from bem.methods.boundary_elements.extrapolation import Scales
from bem.methods.boundary_elements.following import Discretisation
from bem.methods.boundary_elements.influence.on_any_nodes import kernel_series
from bem.methods.boundary_elements.influence.triangles import require_mesh
from bem.methods.boundary_elements.meshes.cohesive_zone import edge_resistance, largest_contact_radius
from bem.methods.boundary_elements.meshes.master_grid import master_grid, moves, widened
from bem.methods.boundary_elements.meshes.mesh import fixed_mesh, no_mesh
from bem.methods.closed_forms import hertz, jkr
from bem.problem.accuracy import Accuracy, Controls, flatness
from bem.problem.indenter import PARABOLOID, depth_factor, tension_without_deformation
from bem.problem.protocol import ForceProtocol, PiecewiseLinearProtocol, default_start_indentation
from bem.problem.scene import Scene
from bem.problem.tractions import HardContact, Interface, TractionLaw, interface_of

Path = PiecewiseLinearProtocol | ForceProtocol
_NUMERICAL = 1e3  # compliance of the numerical spring, over that of a contact at the scale of its force
_MOST_TENSION = 2.0  # of an elastic contact: without deformation (DMT); short-range adhesion (JKR) gives less
_HARD_EDGE = 0.12  # share of the contact radius that the spacing of nodes is judged by without adhesion
_NOISE = 0.04
_FASTER, _DENT = 10.0, 0.1  # how much faster a reload is, from which steps are chosen by so much of the allowed error
_RETURN = 1.0  # in h0, both of the way back and of the way away from contact
_LONG_DWELL, _CREPT = 10.0, 1.0  # in the longest retardation time; and in h0, by which a slow edge moves in it
_LOCAL_WEIGHT_ELASTIC = 0.1  # the next step depends on what happens at the edge only where it is remembered


class LoadingDevice(NamedTuple):
    """What moves the sphere: rigid, a spring between stage and sphere, or a prescribed force."""

    compliance: float  # of the spring, 0 for a rigid device; of the numerical one where the force is prescribed
    by_force: bool  # the protocol prescribes the force instead of the stage
    travel: float  # indentation per unit of what is prescribed, for the length of time steps
    depth_scale: float  # below this the indentation counts as small, in h0


class Problem(NamedTuple):
    """One scene, discretised."""

    interface: Interface
    controls: Controls
    strengths: np.ndarray  # (m,) of the material
    times: np.ndarray  # (m,)
    device: LoadingDevice
    scheme: Discretisation
    scales: Scales
    force_error: float  # allowed in an equilibrium, relative; far below what the prediction is judged by
    least_force: float  # no history can be more compressive
    audit: bool  # whether the stability of each accepted state is checked again


def problem_of(
    scene: Scene,
    path: Path,
    accuracy: Accuracy,
    mesh: ArrayLike | None = None,
    *,
    audit: bool = False,
) -> Problem:
    """The problem of a scene under a protocol.

    Args:
        scene: Tabor parameter, material, adhesion and spring.
        path: history of indentation or force.
        accuracy: the target.
        mesh: radii (n,) of a fixed mesh, or None.
        audit: whether the stability of each accepted state is checked again.

    Raises:
        ValueError: for a mesh that ends inside the contact, or is none.
        MemoryError: for a contact that needs more grid nodes than are allowed.
    """
    interface, material = interface_of(scene.tabor, scene.adhesion, scene.exponent), scene.material
    tabor, shape, k = scene.tabor, scene.exponent, material.modulus_ratio
    strengths, deepest = np.array(material.strengths), deepest_indentation(scene, path)
    hard = interface.nonadhesive
    resistances = _edge_resistances(scene, path, deepest)
    controls = accuracy.line_controls() if hard else accuracy.controls(float(resistances.min()))
    controls = _for_scene(controls, scene)
    pressed = max(float(hertz.contact_radius_from_indentation(deepest, tabor, shape)), 1e-9)
    if hard and mesh is None:
        mesh = np.linspace(0.0, 1.15 * pressed, math.ceil(1.15 / (_HARD_EDGE * controls.edge_spacing)) + 2)
    radii = np.zeros(0)
    if mesh is not None:
        radii = _beyond(pressed if hard else largest_contact_radius(deepest, tabor, shape), mesh)
    own_mesh = no_mesh() if mesh is None else fixed_mesh(tabor, radii, strengths.size > 0)
    grid = own_mesh.grid
    if mesh is None:
        grid = master_grid(tabor, deepest, controls, strengths.size > 0, shape)
        if uncompiled(moves)(grid):  # a fast crack feels smaller errors than the edges of small Tabor parameters
            controls = _for_scene(accuracy.line_controls(), scene)
            grid = master_grid(tabor, deepest, controls, strengths.size > 0, shape)
    wide, wide_segments = grid, 0
    if grid.smooth and not uncompiled(moves)(grid) and resistances[0] > resistances.min():
        finest = accuracy.controls(float(resistances.min())).edge_spacing
        while accuracy.controls(float(resistances[wide_segments])).edge_spacing >= 2.0 * finest:
            wide_segments += 1
        if wide_segments:
            grid, wide = widened(grid)
    reach = float(radii[-1]) if mesh is not None else grid.spacing * float(grid.places[-1])
    if strengths.size > 0 and _presses_again(path):
        controls = controls._replace(prediction=_DENT * controls.prediction)
    series = kernel_series() if uncompiled(moves)(grid) else np.empty((0, 0))
    glassy_hertz = float(hertz.force_from_indentation(deepest, tabor, shape)) / k
    force_scale = max(3e-2 * abs(glassy_hertz) * k, 1e-12) if hard else 1.0
    # The stiffer the glass, the fewer steps the gaps alone would give to a fast pull-off.
    force_weight = min(max(2.0, 0.2 / k), 20.0)
    return Problem(
        interface=interface._replace(reach=reach),
        controls=controls,
        strengths=strengths,
        times=np.array(material.times),
        device=device_of(scene, isinstance(path, ForceProtocol), force_scale),
        scheme=Discretisation(grid, wide, wide_segments, series, strengths.size > 0, own_mesh, mesh is not None),
        scales=Scales(force_scale, force_weight, 1.0 if strengths.size else _LOCAL_WEIGHT_ELASTIC),
        # Extrapolation adds the errors of three states up to sevenfold; the step must not be chosen by them.
        force_error=_NOISE * controls.prediction / force_weight,
        least_force=least_force(scene, deepest),
        audit=audit,
    )


def _beyond(contact: float, mesh: ArrayLike) -> np.ndarray:
    """The radii (n,) of a mesh that reaches beyond a contact radius."""
    radii = require_mesh(mesh)
    if radii[-1] <= contact:
        raise ValueError(
            f"mesh must reach beyond the contact, whose radius can be {contact:.4g}; received one that ends at "
            f"{radii[-1]:.4g}"
        )
    return radii


def least_force(scene: Scene, deepest: float) -> float:
    """Lower bound of the force in any history up to the indentation `deepest`: that of the glassy solid."""
    pressed = float(hertz.force_from_indentation(deepest, scene.tabor, scene.exponent))
    return (1.05 * pressed - 2.0 * _most_tension(scene)) / scene.material.modulus_ratio


def deepest_indentation(scene: Scene, path: Path) -> float:
    """Upper bound of the sphere's indentation: that of the relaxed solid, with the tension of a rigid sphere (DMT).

    With deformation the sphere goes less deep at the same force.
    """
    tension, shape = 0.0 if isinstance(scene.adhesion, HardContact) else _most_tension(scene), scene.exponent
    if isinstance(path, ForceProtocol):
        return hertz.indentation_from_force(float(max(tension - path.forces.min(), 0.0)), scene.tabor, shape)
    top = float(path.indentations.max())
    if scene.spring is None:
        return top
    # Newton's method for delta = top + (tension - F_Hertz(delta)) / k, which is convex, from an upper bound.
    depth, rise, load = top + tension / scene.spring, 1.0 + 1.0 / shape, hertz.load_factor(shape)
    softness = uncompiled(depth_factor)(shape)
    for _ in range(100):
        force = load * (max(depth, 0.0) / scene.tabor / softness) ** rise
        excess = depth - top - (tension - force) / scene.spring
        change = excess / (1.0 + rise * force / max(depth, 1e-300) / scene.spring)
        depth -= change
        if abs(change) <= 1e-12 * abs(depth):
            break
    return depth


def _most_tension(scene: Scene) -> float:
    """Upper bound of the tension of an elastic contact, both that of rigid surfaces that just touch (DMT) and JKR's."""
    if scene.exponent == PARABOLOID:
        return _MOST_TENSION
    return tension_without_deformation(scene.tabor, scene.exponent) + jkr.pull_off_force(scene.exponent)


def _presses_again(path: Path) -> bool:
    """Whether the sphere comes back much faster than it was pulled off; noise of a measured path is no return.

    The force then is that of a stiff glass on the dent that is left, which the instant of detachment decides.
    """
    if isinstance(path, ForceProtocol):
        return False
    if not np.any(path.rates[1:] > 0.0):
        return False
    depths = path.indentations
    fallen = np.maximum.accumulate(depths) - depths
    ahead = np.maximum.accumulate(depths[::-1])[::-1] - depths
    away = (depths < 0.0) & (fallen > _RETURN) & (ahead > _RETURN)
    slowest = np.minimum.accumulate(np.where(path.rates < 0.0, -path.rates, np.inf))
    return bool(np.any(away[1:-1] & (path.rates[1:] > _FASTER * slowest[:-1])))


def device_of(scene: Scene, by_force: bool, force_scale: float) -> LoadingDevice:
    """The loading device of a scene; `force_scale` is the force below which one counts as small."""
    depth_scale = hertz.indentation_from_force(force_scale, scene.tabor, scene.exponent)
    if by_force:
        travel = depth_scale / force_scale
        return LoadingDevice(_NUMERICAL * travel, True, travel, depth_scale)
    return LoadingDevice(0.0 if scene.spring is None else 1.0 / scene.spring, False, 1.0, depth_scale)


def _for_scene(controls: Controls, scene: Scene) -> Controls:
    """Controls with the spacings that the traction law and the shape of the indenter take."""
    fineness = scene.adhesion.fineness if isinstance(scene.adhesion, TractionLaw) else 1.0
    flat = flatness(scene.exponent)
    return controls._replace(edge_spacing=fineness * flat * controls.edge_spacing, widest=flat**2 * controls.widest)


def _edge_resistances(scene: Scene, path: Path, deepest: float) -> np.ndarray:
    """How much viscosity holds the edge back where it is slowest in the cycle of each segment, (s - 1,).

    Nothing does under a force, where the sphere may stop.
    """
    if isinstance(path, ForceProtocol):
        return np.zeros(path.times.size - 1)
    radius, shape = largest_contact_radius(deepest, scene.tabor, scene.exponent), scene.exponent
    slowest = _slowest_of_cycles(path.rates, _creep(scene, path))
    if scene.spring is not None:  # it takes up part of the stage's motion
        depth = max(deepest, 1.0)
        stiffness = (1.0 + 1.0 / shape) * float(hertz.force_from_indentation(depth, scene.tabor, shape)) / depth
        slowest = slowest / (1.0 - stiffness / scene.spring)
    return edge_resistance(scene.tabor, radius, slowest, scene.material.strengths, scene.material.times, shape)


def _creep(scene: Scene, path: PiecewiseLinearProtocol) -> np.ndarray:
    """Speed of indentation that moves the edge as slowly as it creeps in each long dwell, infinite elsewhere, (s - 1,).

    An edge that creeps for long comes to rest, and would stick before where a mesh were too coarse.
    """
    durations, near = np.diff(path.times), path.indentations[:-1] > default_start_indentation(scene.tabor)
    long = (path.rates == 0.0) & near & (durations > _LONG_DWELL * max(scene.material.times, default=np.inf))
    return np.where(long, _CREPT / durations, np.inf)


def _slowest_of_cycles(rates: np.ndarray, creep: np.ndarray) -> np.ndarray:
    """Smallest speed in the cycle of each segment (s - 1,), a rise and the fall that follows; 0 where nothing moves."""
    moving = np.flatnonzero(rates)
    if not moving.size:
        return np.zeros(rates.size)
    rises = rates[moving] > 0.0
    first = np.flatnonzero(np.concatenate([[True], ~rises[:-1] | rises[1:]]))  # of each cycle, among those that move
    # A dwell belongs to the motion before it.
    held = np.minimum.reduceat(creep, np.concatenate([[0], moving[1:]]))
    slowest = np.minimum.reduceat(np.minimum(np.abs(rates[moving]), held), first)
    return np.repeat(slowest, np.diff([0, *moving[first[1:]], rates.size]))
