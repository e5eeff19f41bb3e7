"""The trajectory of an elastic contact with adhesion, read off the curve of its equilibria.

Any loading device reads the same curve (`bem.methods.elastic_curve.branch`) by another quantity: the indentation where
it is rigid, the displacement of the stage behind a spring, the compression where the force is prescribed. The contact
is stable where that quantity grows along the curve and moves along it as the protocol does; where it turns, the contact
jumps to the next place of equal value. The energy lost there is the integral of P d(delta) between the two places, the
spring's share added.
"""

from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel, uncompiled
from bem.methods.boundary_elements.discrete_problem import LoadingDevice, Path, deepest_indentation, device_of
from bem.methods.elastic_curve.branch import branch_of
from bem.methods.outcomes import COMPLETED, DETACHED, NO_EQUILIBRIUM, OUT_OF_WORK
from bem.methods.records import (
    JUMP,
    NODES,
    RECORD,
    STEPS,
    MarchResult,
    Records,
    is_spent,
    new_records,
    with_jump,
    with_record,
)
from bem.problem.accuracy import Accuracy
from bem.problem.protocol import ForceProtocol
from bem.problem.scene import Scene

_PARTS = 6  # of the curve between two points, each recorded
_ROUNDING = 1e-12
_RIGID = LoadingDevice(0.0, False, 1.0, 1.0)
_GAUSS = np.sqrt(0.6)
_MOST_DOUBLINGS = 8  # of the indentation, until the curve reaches what is prescribed


class Reading(NamedTuple):
    """The curve as a device reads it, at places (n,) between which what is prescribed and the force are monotone."""

    position: np.ndarray  # number of a point, and the part of the way to the next
    control: np.ndarray
    energy: np.ndarray  # of the contact, from the first place on
    state: np.ndarray  # (n, 3): indentation, force and contact radius


@kernel
def _cubic(first: float, first_rate: float, last: float, last_rate: float, share: float) -> float:
    rise = last - first
    second, third = 3.0 * rise - 2.0 * first_rate - last_rate, first_rate + last_rate - 2.0 * rise
    return first + share * (first_rate + share * (second + share * third))


@kernel
def _slope(first: float, first_rate: float, last: float, last_rate: float, share: float) -> float:
    rise = last - first
    second, third = 3.0 * rise - 2.0 * first_rate - last_rate, first_rate + last_rate - 2.0 * rise
    return first_rate + share * (2.0 * second + share * 3.0 * third)


@kernel
def _span(p: np.void, q: np.void) -> float:
    """Way between two points; none where one point is there twice, because the mesh begins to grow with the contact."""
    return q["along"] - p["along"] if q["contact_radius"] != p["contact_radius"] or q["contact_radius"] == 0.0 else 0.0


@kernel
def state_at(points: np.ndarray, position: float) -> tuple[float, float, float]:
    """Indentation, force and contact radius at a place of the curve `points` (m,) of `POINT`."""
    i = min(int(position), points.size - 2)
    p, q, share = points[i], points[i + 1], position - i
    span = _span(p, q)
    depth = _cubic(
        p["indentation"], span * p["indentation_rate"], q["indentation"], span * q["indentation_rate"], share
    )
    force = _cubic(p["force"], span * p["force_rate"], q["force"], span * q["force_rate"], share)
    return depth, force, p["contact_radius"] + share * (q["contact_radius"] - p["contact_radius"])


@kernel
def _control_of(device: LoadingDevice, depth: float, force: float) -> float:
    """What the device prescribes: the compression, or the displacement of the stage."""
    return -force if device.by_force else depth - device.compliance * force


@kernel
def _control_at(points: np.ndarray, device: LoadingDevice, position: float) -> float:
    depth, force, _ = state_at(points, position)
    return _control_of(device, depth, force)


@kernel
def _energy_between(points: np.ndarray, begin: float, end: float) -> float:
    """What is put into the contact between two places of one part of the curve; exact for its cubics."""
    i = min(int(min(begin, end)), points.size - 2)
    p, q = points[i], points[i + 1]
    span, total = _span(p, q), 0.0
    for k in range(3):
        share = 0.5 * (begin + end) - i + 0.5 * (end - begin) * (k - 1) * _GAUSS
        rates = span * p["indentation_rate"], span * q["indentation_rate"]
        change = _slope(p["indentation"], rates[0], q["indentation"], rates[1], share)
        force = _cubic(p["force"], span * p["force_rate"], q["force"], span * q["force_rate"], share)
        total += (8.0 if k == 1 else 5.0) / 18.0 * force * change
    return -(end - begin) * total


@kernel
def _turns(first: float, first_rate: float, last: float, last_rate: float) -> tuple[float, float]:
    """Parts of the way at which a cubic turns; NaN where it does not."""
    rise = last - first
    half, third = 3.0 * rise - 2.0 * first_rate - last_rate, 3.0 * (first_rate + last_rate - 2.0 * rise)
    discriminant = half * half - third * first_rate
    if discriminant < 0.0:
        return np.nan, np.nan
    sum_ = -(half + (1.0 if half > 0.0 else -1.0) * np.sqrt(discriminant))  # does not cancel
    return (sum_ / third if third != 0.0 else np.nan), (first_rate / sum_ if sum_ != 0.0 else np.nan)


@kernel
def read(points: np.ndarray, device: LoadingDevice) -> Reading:
    """The curve `points` (m,) of `POINT`, as a device reads it."""
    size = (points.size - 1) * (_PARTS + 4) + 1
    position, control, energy, state = np.empty(size), np.empty(size), np.zeros(size), np.empty((size, 3))
    shares = np.empty(_PARTS + 4)
    count = 0
    for i in range(points.size - 1):
        p, q = points[i], points[i + 1]
        span = _span(p, q)
        force = p["force"], span * p["force_rate"], q["force"], span * q["force_rate"]
        depth = p["indentation"], span * p["indentation_rate"], q["indentation"], span * q["indentation_rate"]
        c = 0.0 if device.by_force else device.compliance
        stage = depth[0] - c * force[0], depth[1] - c * force[1], depth[2] - c * force[2], depth[3] - c * force[3]
        used = _PARTS if span != 0.0 else 1
        for k in range(used):
            shares[k] = k / _PARTS
        tops, folds = _turns(force[0], force[1], force[2], force[3]), _turns(stage[0], stage[1], stage[2], stage[3])
        for turn in (tops[0], tops[1], folds[0], folds[1]):
            if 0.0 < turn < 1.0:
                shares[used] = turn
                used += 1
        for share in np.sort(shares[:used]):
            position[count] = i + share
            count += 1
    position[count] = points.size - 1.0
    count += 1
    for k in range(count):
        state[k, 0], state[k, 1], state[k, 2] = state_at(points, position[k])
        control[k] = _control_of(device, state[k, 0], state[k, 1])
        if k > 0:
            energy[k] = energy[k - 1] + _energy_between(points, position[k - 1], position[k])
    return Reading(position[:count], control[:count], energy[:count], state[:count])


@kernel
def _next(reading: Reading, position: float, upwards: bool) -> int:
    if upwards:
        return np.searchsorted(reading.position, position, side="right")
    return np.searchsorted(reading.position, position, side="left") - 1


@kernel
def _crossing(points: np.ndarray, device: LoadingDevice, begin: float, end: float, target: float) -> float:
    """Place between two, between which the control is monotone, where it is `target`; by false position (Illinois)."""
    miss, end_miss = _control_at(points, device, begin) - target, _control_at(points, device, end) - target
    if miss == 0.0 or miss * end_miss > 0.0:
        return begin if abs(miss) <= abs(end_miss) else end
    for _ in range(60):
        middle = end - end_miss * (end - begin) / (end_miss - miss)
        middle_miss = _control_at(points, device, middle) - target
        if middle_miss * end_miss < 0.0:
            begin, miss = end, end_miss
        else:
            miss *= 0.5
        end, end_miss = middle, middle_miss
        if middle_miss == 0.0 or abs(end - begin) <= 1e-15 * (1.0 + end):
            break
    return end


@kernel
def _energy_at(points: np.ndarray, reading: Reading, position: float) -> float:
    k = max(np.searchsorted(reading.position, position, side="right") - 1, 0)
    return reading.energy[k] + _energy_between(points, reading.position[k], position)


@kernel
def _recorded(points: np.ndarray, records: Records, time: float, position: float) -> Records:
    depth, force, edge = state_at(points, position)
    return with_record(records, time, depth, force, edge)


@kernel
def _moved(
    points: np.ndarray,
    reading: Reading,
    device: LoadingDevice,
    position: float,
    times: tuple[float, float],
    controls: tuple[float, float],
    records: Records,
) -> tuple[float, Records, int]:
    """The contact moved from a place along one segment of a protocol: the new place, the records, the outcome.

    The eigenvalue after a jump is not known here; the place after it stands there instead.
    """
    upwards = controls[1] > controls[0]
    sign = 1 if upwards else -1
    last, k = controls[0], _next(reading, position, upwards)
    while controls[1] != controls[0]:
        if k < 0 or k == reading.position.size:
            return position, records, NO_EQUILIBRIUM
        control = reading.control[k]
        if sign * (control - last) < -_ROUNDING * (1.0 + abs(last)):
            instant = times[0] + (last - controls[0]) / (controls[1] - controls[0]) * (times[1] - times[0])
            # It lands on the next place beyond that has the same control; on none where it flies off.
            after, target, j = np.nan, _control_at(points, device, position), k
            while 0 <= j < reading.position.size and sign * (reading.control[j] - target) < 0.0:
                j += sign
            if 0 <= j < reading.position.size:
                after = _crossing(points, device, reading.position[j - sign], reading.position[j], target)
            depth, force, _ = state_at(points, position)
            if np.isnan(after) and not device.by_force:
                return position, records, NO_EQUILIBRIUM  # the curve is not complete
            if np.isnan(after):
                records = with_jump(records, instant, depth, (force, 0.0), (0.0, np.nan), np.nan, np.nan)
                return position, records, DETACHED
            new_depth, new_force, _ = state_at(points, after)
            lost = _energy_at(points, reading, position) - _energy_at(points, reading, after)
            if device.by_force:
                lost -= force * (new_depth - depth)
            else:
                lost += 0.5 * device.compliance * (force**2 - new_force**2)
            records = with_jump(records, instant, depth, (force, new_force), (0.0, after), lost, new_depth)
            records = _recorded(points, records, instant, after)
            position, k = after, _next(reading, after, upwards)
            continue
        if sign * (control - controls[1]) >= 0.0:
            position = _crossing(points, device, position, reading.position[k], controls[1])
            break
        if abs(control - last) > _ROUNDING * (1.0 + abs(last)):  # not so where a point is there twice
            instant = times[0] + (control - controls[0]) / (controls[1] - controls[0]) * (times[1] - times[0])
            state, last = reading.state[k], control
            records = with_record(records, instant, state[0], state[1], state[2])
        position, k = reading.position[k], k + sign
    return position, _recorded(points, records, times[1], position), COMPLETED


@kernel
def _start(points: np.ndarray, reading: Reading, device: LoadingDevice, control: float) -> tuple[float, bool]:
    """The place from which a protocol starts: the surfaces have come together, or are in contact under a force."""
    if device.by_force:
        k = reading.position.size - 1
        while k > 0 and control < reading.control[k - 1] <= reading.control[k]:
            k -= 1
        if k == 0 or reading.control[k - 1] > control:
            return 0.0, False
        return _crossing(points, device, reading.position[k - 1], reading.position[k], control), True
    begin = reading.control[0], control
    position, _, outcome = _moved(points, reading, device, 0.0, (0.0, 1.0), begin, new_records())
    return position, outcome == COMPLETED


@kernel
def walk(
    points: np.ndarray, device: LoadingDevice, times: np.ndarray, controls: np.ndarray
) -> tuple[Records, np.ndarray, np.ndarray, int]:
    """Follow the history (`times`, `controls`), linear between its s instants, along the curve `points`.

    Returns:
        the records, in which the place on the curve stands for the eigenvalue after a jump, the steps of each segment
        (s - 1,), the energies (2,) stored at both ends, and the outcome.
    """
    reading, records = read(points, device), new_records()
    steps, energies = np.zeros(times.size - 1, dtype=np.int64), np.zeros(2)
    position, started = _start(points, reading, device, controls[0])
    if not started:
        return records, steps, energies, DETACHED if device.by_force else NO_EQUILIBRIUM
    records, outcome = _recorded(points, records, times[0], position), COMPLETED
    energies[0] = _energy_at(points, reading, position)
    for s in range(steps.size):
        before = records.filled[0]
        span, ends = (times[s], times[s + 1]), (controls[s], controls[s + 1])
        position, records, outcome = _moved(points, reading, device, position, span, ends, records)
        steps[s] = records.filled[0] - before
        if outcome != COMPLETED:
            break
    energies[1] = _energy_at(points, reading, position)
    return records, steps, energies, outcome


def _covers(points: np.ndarray, device: LoadingDevice, control: float) -> bool:
    """Whether the curve reaches what a device is to prescribe; it ends early where no equilibrium was found."""
    if not points.size:
        return False
    last = points[-1]
    return bool(uncompiled(_control_of)(device, last["indentation"], last["force"]) >= control)


def march_elastic(
    scene: Scene, path: Path, accuracy: Accuracy, times: np.ndarray, controls: np.ndarray, most_work: float
) -> MarchResult:
    """Follow a protocol of an elastic contact with adhesion, as `bem.methods.boundary_elements.history.march` does.

    Args:
        scene: without memory, with adhesion.
        path: the protocol.
        accuracy: the target.
        times, controls: (s,) instants, and what the path prescribes at them.
        most_work: budget in multiply-adds.

    Returns:
        the records. The outcome is NO_EQUILIBRIUM where the curve could not be followed far enough.

    Raises:
        MemoryError: where the contact edge is too narrow for its radius.
    """
    kept = branch_of if scene.adhesion.__hash__ else branch_of.__wrapped__  # a law of your own may have no hash
    branch = kept(scene.tabor, scene.adhesion, accuracy, scene.exponent)
    device = device_of(scene, isinstance(path, ForceProtocol), 1.0)
    if device.by_force:
        controls = -controls
    deepest = deepest_indentation(scene, path)
    points, work = branch.reaching(deepest, most_work)
    for _ in range(_MOST_DOUBLINGS):
        if _covers(points, device, controls.max()) or not _covers(points, _RIGID, deepest):
            break
        deepest += 1.0 + abs(deepest)
        points, work = branch.reaching(deepest, most_work)
    nothing = np.empty(0, RECORD), np.empty(0, JUMP), work, np.zeros(times.size - 1, np.int64), np.zeros(2)
    if is_spent(work):
        return MarchResult(*nothing, OUT_OF_WORK)
    if not _covers(points, device, controls.max()):
        return MarchResult(*nothing, NO_EQUILIBRIUM)
    records, steps, energies, outcome = walk(points, device, times, controls)
    states, jumps = records.states[: records.filled[0]], records.jumps[: records.filled[1]]
    for k, after in enumerate(jumps["eigenvalue_after"].tolist()):
        if after == after:  # the sphere has not flown off
            jumps["eigenvalue_after"][k] = branch.smallest_eigenvalue(after, device)
    work[STEPS] = states.size
    work[NODES] = round(states.size * np.mean(points["nodes"]))
    return MarchResult(states, jumps, work, steps, energies, outcome)
