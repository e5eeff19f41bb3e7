"""The process zone of an edge that moves steadily, of any traction law and Prony series.

Abel transforms make the memory local: with the traction s(z') outside a point z, and the gap h,

    g(z) = int_z^inf s(h) / sqrt(z' - z) dz',        h(z) = 1 + (2 / pi) int_-inf^z D / sqrt(z - z') dz',   s = law(h).

The edge, where the traction is largest, lies at z = 0, the contact at z < 0. The opening D follows from the history:

    opening, towards -z:   D = G - g - sum_i c_i Q_i,   Q_i(z) = int_-inf^z exp(-(z - z') / (V tau_i)) (-g') dz',
    closing, towards +z:   D = G - g + sum_i c_i Q_i,   Q_i(z) = int_z^inf exp(-(z' - z) / (V tau_i)) (-g') dz',
    glassy, after a run from rest:   D = k (G - g) + strain q(z - run).

The far value G is unknown; the toughness is G^2 / pi, from 1 to 1/k at an opening edge and from 1 to k at a closing
one. The equations are solved for the gaps by Newton's method on some 150 nodes.

Units: length z in beta / mu^2, gap in h0, traction in dgamma / h0, speed V in beta / mu^2 per retardation time, g and G
so that the contact radius drops out: they are those of the contact over sqrt(a / 2), see `far_field`.

Sources: Greenwood and Johnson, Phil. Mag. A 43 (1981) 697, the opening edge; Schapery, Int. J. Fracture 11 (1975) 141,
and Greenwood, J. Phys. D 37 (2004) 2557, both edges; Barthel and Haiat, Langmuir 18 (2002) 9362, and Haiat, Phan Huy
and Barthel, J. Mech. Phys. Solids 51 (2003) 69, the transforms.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bem._support.jit import kernel
from bem._support.validation import FloatArray
from bem.problem.tractions import PEAK_TRACTION, Law, slope_at, traction_at
from bem.problem.tractions.pressed import LARGEST_TENSION, pressed_below, pressed_gap_of

_FINEST, _RATIO, _END = 0.02, 1.18, 600.0  # spacing at the edge, ratio of neighbouring spacings, last node
_PER_FALL, _FALL_ENDS = 0.5, 3.0  # spacing over the range of the steepest fall; where it is over
_MOST_ITERATIONS, _FREE_ITERATIONS = 60, 20
_MOST_MIDDLES = 5  # halvings of the way from a zone to one that is sought
RUN_OFFSET = 0.01
"""Of the logarithmic scale of runs, in beta / mu^2."""


class ZoneError(ArithmeticError):
    """Newton's method found no zone."""


class Zone(NamedTuple):
    """Gaps of a zone and the far value that belongs to them."""

    gaps: FloatArray  # (n,)
    far_value: float


def zone_nodes(law: Law) -> FloatArray:
    """Nodes z (n,), dense at the edge, zero among them; outside as dense as the fall of the traction needs."""
    gaps = np.linspace(law.peak_gap, law.peak_gap + _FALL_ENDS, 2000)
    steepest = -float(tractions_and_slopes(law, gaps)[1].min())
    fall = _PER_FALL * PEAK_TRACTION / steepest
    inside, outside = _half_of_nodes(np.inf), _half_of_nodes(fall)
    return np.concatenate([-inside[:0:-1], outside])


def _half_of_nodes(widest_in_fall: float) -> FloatArray:
    z, spacing = [0.0], _FINEST
    while z[-1] < _END:
        z.append(z[-1] + spacing)
        widest = (_RATIO - 1.0) * 1.5 * z[-1] + _FINEST
        spacing = max(_FINEST, min(spacing * _RATIO, widest)) if z[-1] > 0.15 else _FINEST
        if z[-1] < _FALL_ENDS:
            spacing = min(spacing, widest_in_fall)
    return np.array(z)


class ZoneEquations:
    """The equations of the module docstring on nodes, for one law and one Prony series.

    Args:
        law: traction law in numbers.
        strengths: of the retardation terms, (m,).
        times: their retardation times, (m,).
    """

    def __init__(self, law: Law, strengths: FloatArray, times: FloatArray) -> None:
        self.law, self.strengths, self.times = law, strengths, times
        self.ratio = 1.0 - float(strengths.sum())
        self.z = zone_nodes(law)
        self.edge = int(np.argmin(np.abs(self.z)))
        self._attraction = _half_derivative(self.z)
        if not law.tabulated:  # Lennard-Jones falls as z^-3/2 beyond the last node
            part = np.where(self.z == 0.0, 1e-9, self.z / self.z[-1])
            beyond = 2.0 * (1.0 - np.sqrt(np.maximum(1.0 - part, 0.0))) / part
            self._attraction[:, -1] += np.sqrt(self.z[-1]) * beyond
        self._opening = _half_derivative(-self.z[::-1])[::-1, ::-1].copy()
        part = self.z / self.z[0]  # the opening falls as 1/|z| before the first node
        root = np.sqrt(np.maximum(np.abs(part), 1e-12))
        beyond = np.where(part > 0.0, np.arcsin(np.minimum(root, 1.0)), np.arcsinh(root))
        self._opening[:, 0] += np.sqrt(-self.z[0]) * 2.0 / root * beyond
        self._opening *= 2.0 / np.pi
        self._elastic, self._far = self._opening @ self._attraction, self._opening.sum(axis=1)

    def pull(self, gaps: FloatArray) -> FloatArray:
        """Values g (n,) of the traction at `gaps` (n,)."""
        return self._attraction @ tractions_and_slopes(self.law, gaps)[0]

    def elastic(self) -> Zone:
        """The zone of the relaxed solid."""
        z, peak = self.z, self.law.peak_gap
        inside = 1.0 + 0.9 * (peak - 1.0) / (1.0 + 20.0 * np.abs(z))
        guess = Zone(np.where(z < 0.0, inside, peak + 2.2 * np.sqrt(np.maximum(z, 0.0))), np.sqrt(np.pi))
        return self._solve(self._elastic, self._far, 0.0, guess, 1e-4)

    def steady(self, speed: float, guess: Zone, *, closing: bool) -> Zone:
        """The zone of an edge that moves at a constant `speed`, from that of a similar one."""
        matrix = self._opening @ self._memory(speed, closing) @ self._attraction
        return self._solve(matrix, self._far, 0.0, guess, 1e-3)

    def follow(self, speeds: FloatArray, zone: Zone, *, closing: bool) -> list[Zone]:
        """The zones at rising `speeds` (v,), from that at rest."""
        scale = np.log(speeds)
        return _followed(lambda x, guess: self.steady(np.exp(x), guess, closing=closing), scale[0] - 2.0, scale, zone)

    def started(self, strain: float, wake: FloatArray, runs: FloatArray, zone: Zone) -> list[Zone]:
        """The zones of an edge that opens at once after falling `runs` (r,) from strains `strain` * `wake` (n,)."""
        scale = -np.log(runs + RUN_OFFSET)

        def solve(x: float, guess: Zone) -> Zone:
            return self.glassy(strain * np.interp(self.z + RUN_OFFSET - np.exp(-x), self.z, wake), guess)

        return _followed(solve, scale[0] - 2.0, scale, zone)

    def glassy(self, wake: FloatArray, guess: Zone) -> Zone:
        """The zone of an edge that opens at once through strains `wake` (n,), which only add to the opening."""
        return self._solve(self.ratio * self._elastic, self.ratio * self._far, self._opening @ wake, guess, 1e-3)

    def closing_strains(self, speed: float, zone: Zone) -> FloatArray:
        """Strains (m, n) of each term in a zone that closes at `speed`, over its far value."""
        pull = self.pull(zone.gaps)
        memories = [self._strain_history(speed * time, True) @ pull for time in self.times]
        return self.strengths[:, None] * (pull - np.array(memories)) / zone.far_value

    def openings(self, speed: float, zone: Zone) -> FloatArray:
        """Openings D (n,) of a zone that closes at `speed`."""
        return zone.far_value - self._memory(speed, True) @ self.pull(zone.gaps)

    def _memory(self, speed: float, closing: bool) -> FloatArray:
        """Matrix (n, n) that gives G - D from g."""
        sign = -1.0 if closing else 1.0
        terms = zip(self.strengths, self.times, strict=True)
        histories = [sign * c * self._strain_history(speed * time, closing) for c, time in terms]
        return np.eye(self.z.size) + np.sum(histories, axis=0)

    def _strain_history(self, length: float, closing: bool) -> FloatArray:
        """Matrix (n, n) of Q, exact for g linear between the nodes."""
        z, ratio, history = self.z, np.diff(self.z) / length, np.zeros((self.z.size, self.z.size))
        away = z[:-1] - z[:, None] if closing else z[:, None] - z[1:]  # from a node to the near end of each segment
        decay = np.exp(-np.maximum(away, 0.0) / length)
        segments = (np.triu(decay) if closing else np.tril(decay, -1)) * (-np.expm1(-ratio) / ratio)
        history[:, :-1] += segments
        history[:, 1:] -= segments
        if closing:  # the traction falls as 1/z beyond the last node
            history[:, -1] += np.exp((z - z[-1]) / length) * length / (length + z[-1])
        return history

    def _solve(
        self, matrix: FloatArray, far: FloatArray, wake: FloatArray | float, zone: Zone, tolerance: float
    ) -> Zone:
        """Solve h - 1 = G far - matrix s(h) + wake with the largest traction at the edge.

        Where the surfaces press on each other the traction is what a step changes.
        """
        law, count, edge, (gaps, far_value) = self.law, self.z.size, self.edge, zone
        for iteration in range(_MOST_ITERATIONS):
            traction, slope = tractions_and_slopes(law, gaps)
            misfit = np.append(gaps - 1.0 - far_value * far + matrix @ traction - wake, gaps[edge] - law.peak_gap)
            jacobian = np.zeros((count + 1, count + 1))
            jacobian[:count, :count] = matrix * slope
            jacobian[np.arange(count), np.arange(count)] += 1.0
            jacobian[:count, count], jacobian[count, edge] = -far, 1.0
            change = np.linalg.solve(jacobian, -misfit)
            step, pressed = change[:count], gaps < pressed_below(law)
            limits = np.where(pressed, np.abs(slope * step) / 2.0, np.abs(step) / (0.3 * gaps))
            longest = 1.0 if iteration < _FREE_ITERATIONS else 0.4  # where the iteration goes to and fro
            part = min(longest, 1.0 / max(float(limits.max()), 1e-300))
            new = gaps + part * step
            press(law, pressed, np.minimum(traction + part * slope * step, LARGEST_TENSION), gaps, new)
            gaps, far_value = new, far_value + part * float(change[count])
            # What is left after a whole step is of the order of its square.
            least = tolerance if part == 1.0 else tolerance**2
            if part == longest and np.abs(step / gaps).max() < least:
                return Zone(gaps, far_value)
        raise ZoneError("no process zone found")


def _followed(
    solve: Callable[[float, Zone], Zone], before: float, places: FloatArray, zone: Zone, middles: int = _MOST_MIDDLES
) -> list[Zone]:
    """The zones at rising `places` (p,), from a zone `before` them, by steps that are halved where `solve` fails."""
    zones = []
    for place in places.tolist():
        try:
            zone = solve(place, zone)
        except ZoneError:
            if not middles:
                raise
            between = np.array([0.5 * (before + place), place])
            zone = _followed(solve, before, between, zone, middles - 1)[-1]
        zones.append(zone)
        before = place
    return zones


def _half_derivative(z: FloatArray) -> FloatArray:
    """Matrix (n, n) that gives int_z^z_n s / sqrt(z' - z) dz', exact for s linear between the nodes."""
    matrix = np.zeros((z.size, z.size))
    for i in range(z.size - 1):
        near, far = z[i:-1] - z[i], z[i + 1 :] - z[i]
        width, zeroth, first = far - near, 2.0 * (np.sqrt(far) - np.sqrt(near)), 2.0 / 3.0 * (far**1.5 - near**1.5)
        matrix[i, i:-1] += (far * zeroth - first) / width
        matrix[i, i + 1 :] += (first - near * zeroth) / width
    return matrix


def tractions_and_slopes(law: Law, gaps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Tractions and their slopes (n,) at `gaps` (n,)."""
    tractions, slopes = np.empty(gaps.size), np.empty(gaps.size)
    _evaluate(law, gaps, tractions, slopes)
    return tractions, slopes


@kernel
def _evaluate(law: Law, gaps: np.ndarray, tractions: np.ndarray, slopes: np.ndarray) -> None:
    """Tractions and slopes (n,) at gaps (n,)."""
    for i in range(gaps.size):
        tractions[i], slopes[i] = traction_at(law, gaps[i]), slope_at(law, gaps[i])


@kernel
def press(law: Law, pressed: np.ndarray, tractions: np.ndarray, guess: np.ndarray, gaps: np.ndarray) -> None:
    """Replace the gaps (n,) of pressed nodes by those of their new tractions (n,)."""
    for i in range(gaps.size):
        if pressed[i]:
            gaps[i] = pressed_gap_of(law, tractions[i], guess[i])
