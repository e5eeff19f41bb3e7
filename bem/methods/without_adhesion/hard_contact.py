"""Contact without adhesion: a formula for an elastic half-space, a row of elements for a viscoelastic one.

The formula is Hertz's, or that of Galin and Sneddon where the indenter is no paraboloid.
No mesh is needed. A prescribed indentation, a spring and a prescribed force are one equation in the contact radius, or
in the indentation. The boundary element solver answers the same scene on a mesh of one's own.
"""

import math

import numpy as np

from bem._support.jit import uncompiled
from bem.methods.boundary_elements.discrete_problem import Path, deepest_indentation
from bem.methods.closed_forms.hertz import contact_radius_from_indentation, load_factor
from bem.methods.outcomes import COMPLETED, DETACHED
from bem.methods.records import JUMP, RECORD, MarchResult, new_work
from bem.methods.without_adhesion.elastic_history import Device, Shape, follow_hertz, radius_under
from bem.methods.without_adhesion.elements import places_of, solid_of
from bem.methods.without_adhesion.viscoelastic_history import Rules, follow_elements
from bem.problem.accuracy import Accuracy
from bem.problem.indenter import depth_factor
from bem.problem.protocol import ForceProtocol
from bem.problem.scene import Scene

_RECORDS = 4.0  # along the largest contact radius, at a target of 1
_ELEMENTS = 4.0  # along it, at a target of 1
_FIRST_REACH = 0.5  # of the row of elements, below which it is made anew for the contact that was found


def follow_hard_contact(
    scene: Scene, path: Path, accuracy: Accuracy, glassy: bool, most_work: float
) -> tuple[MarchResult, str]:
    """Follow a history without adhesion.

    Args:
        scene: with `HardContact`.
        path: history of indentation or force.
        accuracy: the target.
        glassy: whether the surfaces met just before the start.
        most_work: budget in multiply-adds.

    Returns:
        What `bem.methods.boundary_elements.history.march` returns, and the name of the method that answered.
    """
    by_force = isinstance(path, ForceProtocol)
    times, controls = np.array(path.times), np.array(-path.forces if by_force else path.indentations)
    compliance = 1.0 if by_force else 0.0 if scene.spring is None else 1.0 / scene.spring
    device = Device(0.0 if by_force else 1.0, compliance)
    parted = by_force and bool(controls.min() < 0.0)
    if parted:  # the contact ends where its force does
        first = int(np.argmax(controls < 0.0))
        share = controls[first - 1] / (controls[first - 1] - controls[first]) if first else 0.0
        end = times[first - 1] + share * (times[first] - times[first - 1]) if first else times[0]
        more = int(first > 0 and end > times[first - 1])
        times, controls = np.append(times[:first], [end] * more), np.append(controls[:first], [0.0] * more)
    method = "Hertz"
    if times.size < 2:
        touch = np.zeros(times.size, RECORD)
        touch["time"] = times
        result = MarchResult(touch, np.empty(0, JUMP), new_work(), np.zeros(0, np.int64), np.zeros(2), COMPLETED)
    elif scene.material.strengths.size == 0:
        result = follow_hertz(_shape_of(scene), device, times, controls, _RECORDS / accuracy.target**0.33)
    else:
        method, solid = "elements", solid_of(scene.material)
        deepest, n = deepest_indentation(scene, path), scene.exponent
        shape = _shape_of(scene, solid.glassy if glassy else 1.0)
        radius = uncompiled(radius_under)(shape, device, float(controls[0]))
        depth = shape.depth * radius**n if radius > 0.0 or not device.inward else float(controls[0])
        # Forces are exact where the indentation is known, and only the curve between them must be resolved.
        allowed = 0.5 * accuracy.target**0.9 if device.inward else 0.6 * accuracy.target**1.08
        count, followed = math.ceil(_ELEMENTS / math.sqrt(accuracy.target)), False
        while not followed:  # by a row that reaches as far as the contact does
            reach = float(contact_radius_from_indentation(max(deepest, 1e-12), scene.tabor, n))
            rules = Rules(allowed, load_factor(n) * reach ** (n + 1.0), deepest, 0.2)
            places = places_of(scene.tabor, reach, count, n)
            result = follow_elements(rules, solid, device, places, times, controls, depth, glassy, most_work)
            reached = float(result.records["contact_radius"].max())
            followed = device.compliance == 0.0 or reached > _FIRST_REACH * reach or reached == 0.0
            followed = followed or result.outcome != COMPLETED
            deepest *= (1.2 * reached / reach) ** n
    if parted and result.outcome == COMPLETED:
        result = result._replace(outcome=DETACHED)
    steps = np.zeros(path.times.size - 1, dtype=np.int64)
    steps[: result.segment_steps.size] = result.segment_steps
    return result._replace(segment_steps=steps), method


def _shape_of(scene: Scene, stiffness: float = 1.0) -> Shape:
    factor = uncompiled(depth_factor)(scene.exponent)
    return Shape(scene.exponent, scene.tabor * factor, stiffness * load_factor(scene.exponent))
