"""The trajectory of a soft viscoelastic contact by its edge, a crack with a process zone.

Units outside: as in `bem.results.trajectory`; inside: as in `bem.methods.sharp_crack.far_field`, depths in mu h0.
"""

import math
from typing import NamedTuple

import numpy as np

from bem._support.validation import FloatArray
from bem.methods.boundary_elements.discrete_problem import deepest_indentation, least_force
from bem.methods.physical_bounds import within_bounds
from bem.methods.records import COMPLETED, STEPS, MarchResult, new_work
from bem.methods.sharp_crack.edge import Contact, State, new_state
from bem.methods.sharp_crack.edge_law import EdgeLaw, edge_law, finite_zone
from bem.methods.sharp_crack.far_field import new_step, relaxation_of, surface
from bem.methods.sharp_crack.march import follow
from bem.problem.protocol import ForceProtocol, Protocol, history_of
from bem.problem.scene import Scene
from bem.problem.tractions import HardContact, law_of

_NODES = 500
_STEPS = 400  # of a ramp as long as the history's range of depths
_FIRST = np.geomspace(1e-7, 1.0, 26)[:-1]  # steps after a corner, over the steps that follow
_HELD = np.geomspace(1e-6, 1.0, 200)  # of a dwell
_ERROR = 0.25


class SharpCrack(NamedTuple):
    """A history, as of any method, and how exact it is."""

    result: MarchResult
    error: float


def march(scene: Scene, protocol: Protocol, *, glassy: bool = False) -> SharpCrack:
    """Follow a viscoelastic scene with adhesion.

    Args:
        scene: of any Tabor parameter, though the method is exact at large ones; see `expected_error`.
        protocol: of the depth.
        glassy: whether the sphere has just arrived at the start.

    Returns:
        the history, whose outcome says where it breaks a physical bound, and its expected relative error.

    Raises:
        ValueError: for an elastic scene, one without adhesion, a spring, another indenter or a prescribed force.
        ZoneError: where no process zone is found.
    """
    path = history_of(protocol, scene.tabor)
    adhesion = scene.adhesion
    if isinstance(adhesion, HardContact) or scene.material.strengths.size == 0:
        raise ValueError(f"a sharp crack needs a viscoelastic solid and adhesion; received {scene}")
    if scene.spring is not None or scene.indenter is not None or isinstance(path, ForceProtocol):
        raise ValueError(f"a sharp crack needs a paraboloid whose depth is prescribed; received {scene}")
    times, depths = np.array(path.times), np.array(path.indentations) / scene.tabor
    contact = _contact_of(scene, edge_law(adhesion, scene.material), float(depths.max()))
    terms = scene.material.strengths.size
    first, spare = (new_state(_NODES, terms, float(times[0]), float(depths[0])) for _ in range(2))
    first = _start(contact, first, glassy)
    instants, counts = _instants(times, depths)
    records, zone, steps = follow(contact, law_of(adhesion), first, spare, instants, times, depths)
    work = new_work()
    work[STEPS] = steps
    states, jumps = records.states[: records.filled[0]].copy(), records.jumps[: records.filled[1]].copy()
    result, error = MarchResult(states, jumps, work, counts, np.zeros(2), COMPLETED), expected_error(zone)
    deepest = deepest_indentation(scene, path)
    return SharpCrack(within_bounds(result, scene, least_force(scene, deepest), np.nan_to_num(error)), error)


def expected_error(zone: float) -> float:
    """Relative error of the pull-off force, from the length of the process zone over the radius there.

    Provisional: two numbers of the method were fitted to histories of Tabor parameters of 10 and 15 by boundary
    elements, and no other histories have judged it. At 5 some errors exceed it. NaN where no contact was pulled.
    """
    return _ERROR * math.sqrt(zone) if zone > 0.0 else math.nan


def _contact_of(scene: Scene, law: EdgeLaw, deepest: float) -> Contact:
    radius = 2.0
    for _ in range(60):
        radius = math.sqrt(max(deepest, 0.0) + math.sqrt(2.0 * math.pi * radius))
    strengths, times = np.array(scene.material.strengths), np.array(scene.material.times)
    terms = strengths.size
    return Contact(
        scene.tabor,
        law,
        relaxation_of(strengths, times),
        np.linspace(0.0, 1.02 * radius, _NODES),
        np.zeros(_NODES),
        new_step(terms),
        new_step(terms),
        np.zeros((3, terms)),
    )


def _start(contact: Contact, state: State, glassy: bool) -> State:
    """The state at the start: relaxed, as if it had been for ever, or glassy; in contact where surfaces do not part."""
    law, depth, k = contact.law, state.depth, contact.law.ratio
    toughness, compliance = (k, k) if glassy else (1.0, 1.0)
    softness = math.log(compliance * contact.tabor**1.5)
    if depth * contact.tabor < 1.0 - math.exp(np.interp(softness, law.log_softness, law.log_snap)):
        return state
    radii = np.linspace(1e-3, contact.radii[-1], 100_001)
    far = 0.5 * (radii**2 - depth)
    far_values = zip(radii[::100].tolist(), far[::100].tolist(), strict=True)
    factors = [
        finite_zone(law, toughness / compliance**2, radius, contact.tabor, radius**2 / max(value, 1e-9), 1.0)[0]
        for radius, value in far_values
    ]
    held = (far < 0.0) | (2.0 * far**2 <= np.pi * radii * toughness * np.interp(radii, radii[::100], factors))
    if not held.any():
        return state
    radius = float(radii[np.flatnonzero(held)[-1]])
    share = np.zeros(law.times.size) if glassy else law.strengths
    inside = contact.radii < radius
    state.strains[inside] = surface(contact.radii[inside], depth)[:, None] * share
    state.inner[:] = surface(radius, depth) * share
    state.births[:] = -1e9
    force = 4.0 / np.pi * (radius**3 / 6.0 - depth * radius / 2.0) / (k if glassy else 1.0)
    mark = (radius, state.time)
    return state._replace(force=force, radius=radius, rest_radius=radius, bonded=-1e9, mark=mark, next_mark=mark)


def _instants(times: FloatArray, depths: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Instants (s,) at which steps end, and how many there are in each segment (p - 1,)."""
    span = max(float(np.ptp(depths)), 1e-300)
    parts = []
    for begin, end, change in zip(times[:-1], times[1:], np.abs(np.diff(depths)), strict=True):
        if change == 0.0:
            shares = _HELD
        else:
            even = np.linspace(0.0, 1.0, max(math.ceil(_STEPS * change / span), 8) + 1)[1:]
            shares = np.concatenate([_FIRST * even[0], even])
        parts.append(np.append(begin + (end - begin) * shares[:-1], end))
    return np.concatenate(parts), np.array([part.size for part in parts])
