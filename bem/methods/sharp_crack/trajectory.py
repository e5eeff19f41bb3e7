"""The trajectory of a soft contact by its edge, a crack with a process zone.

Units outside: as in `bem.results.trajectory`; inside: as in `bem.methods.sharp_crack.far_field`, depths in mu h0.
"""

import math
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem._support.validation import FloatArray
from bem.methods.boundary_elements.discrete_problem import deepest_indentation, least_force
from bem.methods.outcomes import COMPLETED, DETACHED
from bem.methods.physical_bounds import within_bounds
from bem.methods.records import MOST_WORK, MarchResult, new_records, new_work, next_slice
from bem.methods.sharp_crack.edge import Contact, State, new_state
from bem.methods.sharp_crack.edge_law import edge_law
from bem.methods.sharp_crack.edge_tables import EdgeLaw, finite_zone
from bem.methods.sharp_crack.far_field import new_step, relaxation_of, surface
from bem.methods.sharp_crack.march import Device, Progress, follow
from bem.methods.sharp_crack.tail import ZONE_LENGTH, tail_of
from bem.methods.sharp_crack.zone import press, zone_nodes
from bem.problem.materials import PronySeries
from bem.problem.protocol import ForceProtocol, PiecewiseLinearProtocol
from bem.problem.scene import Scene
from bem.problem.tractions import LENNARD_JONES, HardContact, law_of

_NODES = 1000
_STEPS = 600
_FIRST = np.geomspace(1e-7, 1.0, 26)[:-1]  # steps after a corner, over the steps that follow
_HELD = 200  # steps of a dwell, fewer where there are fewer of a ramp
_ELASTIC = PronySeries([1e-12], [1.0])  # a term that does nothing, so that one set of steps is for all solids
_RADII, _SMALLEST = 4000, 1e-3  # of contacts at the start, and the smallest of them
ZONE_ERROR, STEP_ERROR = 0.25, 1.5e-3
"""Relative error by the finite zone, over the root of its length over the radius, and that by steps and nodes."""


class SharpCrack(NamedTuple):
    """A history, as of any method, and how exact it is."""

    result: MarchResult
    error: float


def is_sharp(scene: Scene) -> bool:
    """Whether the method is for a scene: one with adhesion and a paraboloid."""
    return not isinstance(scene.adhesion, HardContact) and scene.indenter is None


def march_crack(
    scene: Scene,
    path: PiecewiseLinearProtocol | ForceProtocol,
    *,
    glassy: bool = False,
    most_work: float = MOST_WORK,
    fineness: float = 1,
) -> SharpCrack:
    """Follow a scene with adhesion.

    Args:
        scene: of any Tabor parameter, though the method is exact at large ones; see `expected_error`.
        path: of indentation, that of the stage behind a spring, or of force.
        glassy: whether the sphere has just arrived at the start.
        most_work: budget in multiply-adds.
        fineness: factor of the numbers of nodes and steps; their error falls with it.

    Returns:
        the history, whose outcome says where it breaks a physical bound, and its expected relative error.

    Raises:
        ValueError: for a scene without adhesion or with another indenter.
        ZoneError: where no process zone is found.
    """
    adhesion = scene.adhesion
    if isinstance(adhesion, HardContact) or not is_sharp(scene):
        raise ValueError(f"a sharp crack needs adhesion and a paraboloid; received {scene}")
    deepest, material = deepest_indentation(scene, path), scene.material
    if not material.strengths.size:
        material = _ELASTIC
    contact = _contact_of(scene.tabor, edge_law(adhesion, material), deepest / scene.tabor, round(_NODES * fineness))
    times, law = np.array(path.times), law_of(adhesion)
    if isinstance(path, ForceProtocol):
        device, values = Device(0.0, True), -path.forces
    else:
        compliance = 0.0 if scene.spring is None else 1.0 / (scene.spring * scene.tabor)
        device, values = Device(compliance, False), path.indentations / scene.tabor
    terms, work = material.strengths.size, uncompiled(new_work)(most_work)
    begin = float(times[0]), float(values[0])
    first, spare = (uncompiled(new_state)(contact.radii.size, terms, *begin) for _ in range(2))
    first, balanced = _start(contact, device, first, glassy)
    outcome, records, zone = DETACHED, uncompiled(new_records)(), 0.0
    instants = _instants(times, values, round(_STEPS * fineness))
    if balanced:
        progress = Progress(records, first, spare, 0, first.time, 1.0, 0.0, -math.inf, 0.0, COMPLETED)
        while progress.instant < instants.size and progress.outcome == COMPLETED:
            progress = follow(contact, law, device, progress, instants, times, values, next_slice(work))
        outcome, records, zone = progress.outcome, progress.records, progress.zone
    states, jumps = records.states[: records.filled[0]].copy(), records.jumps[: records.filled[1]].copy()
    steps = np.histogram(np.unique(states["time"])[1:], np.nextafter(times, np.inf))[0]
    energies, error = np.full(2, np.nan), expected_error(zone, fineness)
    result = MarchResult(states, jumps, work, steps, energies, outcome)
    return SharpCrack(within_bounds(result, scene, least_force(scene, deepest), np.nan_to_num(error)), error)


def expected_error(zone: float, fineness: float = 1) -> float:
    """Relative error of pull-off force and hysteresis, from the length of the process zone over the radius there.

    NaN where nothing touched.
    """
    return ZONE_ERROR * math.sqrt(zone) + STEP_ERROR / fineness if zone > 0.0 else math.nan


def least_error(scene: Scene, path: PiecewiseLinearProtocol | ForceProtocol, fineness: float = 1) -> float:
    """The expected error of the largest contact and shortest zone that a scene can have: known before any tables."""
    radius = _largest_radius(deepest_indentation(scene, path) / scene.tabor)
    return expected_error(ZONE_LENGTH / (scene.tabor**2 * radius), fineness)


def _largest_radius(deepest: float) -> float:
    """Radius of a relaxed contact of a depth in mu h0, by Johnson, Kendall and Roberts."""
    radius = 2.0
    for _ in range(60):
        radius = math.sqrt(max(deepest, 0.0) + math.sqrt(2.0 * math.pi * radius))
    return radius


def _contact_of(tabor: float, law: EdgeLaw, deepest: float, nodes: int) -> Contact:
    terms, radii = law.times.size, np.linspace(0.0, 1.02 * _largest_radius(deepest), nodes)
    step, part = (uncompiled(new_step)(terms) for _ in range(2))
    relaxation = relaxation_of(law.strengths, law.times)
    return Contact(tabor, law, relaxation, radii, np.zeros(nodes), step, part, np.zeros((3, terms)))


def load_steps() -> None:
    """Compile what a history takes, or load it from the cache, without one."""
    unit, row, table = np.ones(1), np.ones((1, 1)), np.ones((1, 1, 1))
    tables = (unit, unit, unit, unit, unit, row, unit, unit, unit, row, table, unit, unit)
    law = EdgeLaw(0.5, 0.5 * unit, unit, tail_of(0.0), *tables)
    contact, work = _contact_of(1.0, law, 0.0, 8), uncompiled(new_work)()
    first, spare = (uncompiled(new_state)(8, 1, 0.0, 0.0) for _ in range(2))
    progress = Progress(uncompiled(new_records)(), first, spare, 0, 0.0, 1.0, 0.0, 0.0, 0.0, COMPLETED)
    follow(contact, LENNARD_JONES, Device(0.0, False), progress, np.empty(0), np.zeros(2), np.zeros(2), work)
    _rest_depths(contact, unit, 1.0, 1.0)
    zone_nodes(LENNARD_JONES)
    press(LENNARD_JONES, np.ones(1, bool), -unit, unit, unit)


@kernel
def _rest_depths(contact: Contact, radii: np.ndarray, toughness: float, compliance: float) -> np.ndarray:
    """Depths (n,) at which contacts of `radii` (n,) are in balance."""
    depths = np.empty(radii.size)
    for i in range(radii.size):
        radius, factor, far = radii[i], 1.0, 0.0
        for _ in range(6):
            far = np.sqrt(0.5 * np.pi * radius * toughness * factor)
            growth = radius * radius / far
            factor = finite_zone(contact.law, toughness / compliance**2, radius, contact.tabor, growth, 1.0)[0]
        depths[i] = radius * radius - 2.0 * far
    return depths


def _start(contact: Contact, device: Device, state: State, glassy: bool) -> tuple[State, bool]:
    """The state at the start, relaxed, as if it had been for ever, or glassy, and whether it is in balance.

    In contact where surfaces do not part.
    """
    law, value, k = contact.law, state.depth, contact.law.ratio
    toughness, compliance = (k, k) if glassy else (1.0, 1.0)
    softness = math.log(compliance * contact.tabor**1.5)
    gap = math.exp(np.interp(softness, law.log_softness, law.log_snap))
    if not device.by_force and value * contact.tabor < 1.0 - gap:
        return state, True
    radii = np.linspace(_SMALLEST, contact.radii[-1], _RADII)
    depths = _rest_depths(contact, radii, toughness, compliance)
    forces = 4.0 / np.pi * (radii**3 / 6.0 - depths * radii / 2.0) / compliance
    prescribed = -forces if device.by_force else depths - device.compliance * forces
    borne = np.flatnonzero(prescribed <= value)
    if not borne.size:
        return state, not device.by_force
    place = slice(borne[-1], borne[-1] + 2)
    radius, depth, force = (
        float(np.interp(value, prescribed[place], quantity[place])) for quantity in (radii, depths, forces)
    )
    share = np.zeros(law.times.size) if glassy else law.strengths
    inside = contact.radii < radius
    state.strains[inside] = surface(contact.radii[inside], depth)[:, None] * share
    state.inner[:] = surface(radius, depth) * share
    state.births[:] = -1e9
    mark = (radius, state.time)
    state = state._replace(depth=depth, force=force, radius=radius, rest_radius=radius, bonded=-1e9)
    return state._replace(mark=mark, next_mark=mark), True


def _instants(times: FloatArray, values: FloatArray, steps: int) -> FloatArray:
    """Instants (s,) at which steps end; there are `steps` in a ramp as long as the range of what is prescribed."""
    span = max(float(np.ptp(values)), 1e-300)
    parts = []
    for begin, end, change in zip(times[:-1], times[1:], np.abs(np.diff(values)), strict=True):
        if change == 0.0:
            shares = np.geomspace(1e-6, 1.0, min(_HELD, steps // 3))
        else:
            even = np.linspace(0.0, 1.0, max(math.ceil(steps * change / span), 8) + 1)[1:]
            shares = np.concatenate([_FIRST * even[0], even])
        parts.append(np.append(begin + (end - begin) * shares[:-1], end))
    return np.concatenate(parts)
