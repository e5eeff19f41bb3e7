"""How the sphere is moved: load, dwell, unload, any piecewise-linear history of indentation, or one of force.

Units: indentation in h0, force in pi R dgamma (tension positive), time in retardation times, rates in h0 per
retardation time; rates are speeds, so positive. In a scene with a spring, indentations are those of the stage: what the
sphere's would be if the spring carried no force. A `LoadingProtocol` starts and ends at the same indentation, by
default -pi^(2/3) mu, the paper's delta_0 (Appendix, protocol definitions).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike

from bem._support.validation import FloatArray, Valued, finite_number, finite_vector, strictly_increasing
from bem._support.wording import shown

Phase = Literal["loading", "dwell", "unloading"]

LARGEST_INDENTATION = 1e9
LARGEST_FORCE = 1e9
LARGEST_RATE = 1e12
SMALLEST_RATE = 1e-12
LONGEST_DWELL = 1e12
MOST_INSTANTS = 100_000
"""Of one history; the solver takes a step at least from each to the next."""


@overload
def default_start_indentation(tabor: float) -> float: ...
@overload
def default_start_indentation(tabor: FloatArray) -> FloatArray: ...
def default_start_indentation(tabor: float | FloatArray) -> float | FloatArray:
    """The paper's initial indentation -pi^(2/3) mu, of one Tabor parameter or of an array of them."""
    return -(np.pi ** (2.0 / 3.0)) * tabor


def _checked_pairs(name: str, times: ArrayLike, values: ArrayLike, largest: float) -> tuple[FloatArray, FloatArray]:
    """Instants and values of a history, as many of each, both (n,) and read-only."""
    instants = strictly_increasing("times", finite_vector("times", times, at_least=2))
    checked = finite_vector(name, values, at_least=2)
    if len(instants) > MOST_INSTANTS:
        raise ValueError(
            f"times must be at most {MOST_INSTANTS} instants, between which {name} are linear; received {len(instants)}"
        )
    if len(instants) != len(checked):
        raise ValueError(f"times and {name} must have the same length; received {len(instants)} and {len(checked)}")
    if np.max(np.abs(checked)) > largest:
        raise ValueError(f"{name} must lie within +-{largest:g}; received {float(np.max(np.abs(checked)))!r}")
    return instants, checked


def _phases(changes: FloatArray) -> tuple[Phase, ...]:
    """What segments are called by the sign of what presses more in each."""
    names: dict[int, Phase] = {1: "loading", 0: "dwell", -1: "unloading"}
    return tuple(names[int(sign)] for sign in np.sign(changes))


class _Linear(Valued):
    """A history that is linear between its instants."""

    times: FloatArray

    @property
    def duration(self) -> float:
        """Time from the first to the last instant."""
        return float(self.times[-1] - self.times[0])


@dataclass(frozen=True, eq=False, init=False)
class PiecewiseLinearProtocol(_Linear):
    """An indentation history that is linear between given instants.

    Args:
        times: instants, strictly increasing, 2 to 100,000.
        indentations: indentation at each of them.
        phases: what each segment is called; by default 'loading', 'dwell' or 'unloading' by the sign of its rate.

    Raises:
        ValueError: for unequal or too large lengths, non-finite values, times that do not increase or unknown phases.
    """

    times: FloatArray
    indentations: FloatArray
    phases: tuple[Phase, ...]

    def __init__(self, times: ArrayLike, indentations: ArrayLike, phases: tuple[Phase, ...] | None = None) -> None:
        instants, depths = _checked_pairs("indentations", times, indentations, LARGEST_INDENTATION)
        if phases is None:
            phases = _phases(np.diff(depths))
        elif len(phases) != len(instants) - 1 or not set(phases) <= {"loading", "dwell", "unloading"}:
            raise ValueError(
                f"phases must name each of the {len(instants) - 1} segments 'loading', 'dwell' or 'unloading'; "
                f"received {shown(phases)}"
            )
        object.__setattr__(self, "times", instants)
        object.__setattr__(self, "indentations", depths)
        object.__setattr__(self, "phases", tuple(phases))

    @property
    def rates(self) -> FloatArray:
        """Signed indentation rate of each segment, shape (n - 1,)."""
        depths, times = self.indentations, self.times
        return (depths[1:] - depths[:-1]) / (times[1:] - times[:-1])

    def indentation_at(self, time: ArrayLike) -> FloatArray:
        """Indentation at `time` (any shape); constant before the first and after the last instant."""
        return np.interp(np.asarray(time, dtype=np.float64), self.times, self.indentations)


@dataclass(frozen=True, eq=False, init=False)
class ForceProtocol(_Linear):
    """A history of the force that is linear between given instants: load control, dead loads, creep.

    The sphere starts in contact, in equilibrium under the first force. Where the force comes to exceed what the contact
    bears, the sphere flies off, and the trajectory ends there.

    Args:
        times: instants, strictly increasing, 2 to 100,000.
        forces: force at each of them, in pi R dgamma, tension positive, so that a weight is negative; within +-1e9.

    Raises:
        ValueError: for unequal or too large lengths, non-finite values or times that do not increase.

    Examples:
        >>> creep = ForceProtocol(times=[0.0, 1e-3, 10.0], forces=[0.0, -5.0, -5.0])
        >>> creep.phases
        ('loading', 'dwell')
    """

    times: FloatArray
    forces: FloatArray

    def __init__(self, times: ArrayLike, forces: ArrayLike) -> None:
        instants, values = _checked_pairs("forces", times, forces, LARGEST_FORCE)
        object.__setattr__(self, "times", instants)
        object.__setattr__(self, "forces", values)

    @property
    def phases(self) -> tuple[Phase, ...]:
        """Segments in which compression grows are 'loading', those in which it falls or tension grows 'unloading'."""
        return _phases(-np.diff(self.forces))


@dataclass(frozen=True, kw_only=True)
class LoadingProtocol:
    """Load at constant rate to a peak, dwell there, unload at constant rate to the start.

    Args:
        peak_indentation: indentation held during the dwell, within +-1e9 and above the start.
        loading_rate: speed of the first ramp, 1e-12 to 1e12.
        dwell_time: time held at the peak, 0 to 1e12; zero leaves the phase out.
        unloading_rate: speed of the last ramp, 1e-12 to 1e12.
        start_indentation: where it starts and ends, below the peak; `None` for -pi^(2/3) mu.

    Raises:
        ValueError: naming the quantity, the allowed range and the value received.
    """

    peak_indentation: float
    loading_rate: float
    dwell_time: float
    unloading_rate: float
    start_indentation: float | None = None

    def __post_init__(self) -> None:
        depths = {"low": -LARGEST_INDENTATION, "high": LARGEST_INDENTATION}
        speeds = {"low": SMALLEST_RATE, "high": LARGEST_RATE}
        checked = {
            "peak_indentation": finite_number("peak_indentation", self.peak_indentation, **depths),
            "loading_rate": finite_number("loading_rate", self.loading_rate, **speeds),
            "dwell_time": finite_number("dwell_time", self.dwell_time, low=0.0, high=LONGEST_DWELL),
            "unloading_rate": finite_number("unloading_rate", self.unloading_rate, **speeds),
        }
        if self.start_indentation is not None:
            bounds = {"low": -LARGEST_INDENTATION, "below": checked["peak_indentation"]}
            checked["start_indentation"] = finite_number("start_indentation", self.start_indentation, **bounds)
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def start(self, tabor: float) -> float:
        """Indentation at which the protocol starts and ends in a scene of this Tabor parameter."""
        return default_start_indentation(tabor) if self.start_indentation is None else self.start_indentation

    def phase_times(self, tabor: float) -> tuple[float, float, float, float]:
        """Instants (t0, t1, t2, t3): start, peak reached, dwell over, end; t1 = t2 without a dwell."""
        travel = self.peak_indentation - self.start(tabor)
        t1 = travel / self.loading_rate
        t2 = t1 + self.dwell_time
        return 0.0, t1, t2, t2 + travel / self.unloading_rate

    def history(self, tabor: float) -> PiecewiseLinearProtocol:
        """The indentation history in a scene of this Tabor parameter; it remembers which segment is which phase.

        Raises:
            ValueError: when the peak does not lie above the start, or a phase is too short to be told apart in double
                precision.
        """
        start, peak = self.start(tabor), self.peak_indentation
        if not peak > start:
            raise ValueError(
                f"peak_indentation must lie above the start indentation, which is {start:.6g} at tabor {tabor:g}; "
                f"received {peak!r}"
            )
        t0, t1, t2, t3 = self.phase_times(tabor)
        for phase, begin, end, exists in (("dwell", t1, t2, self.dwell_time > 0.0), ("unloading", t2, t3, True)):
            if exists and not end > begin:
                raise ValueError(
                    f"the {phase} phase must outlast the rounding of its start time {begin!r}; received {shown(self)}"
                )
        if t2 == t1:
            return PiecewiseLinearProtocol([t0, t1, t3], [start, peak, start], ("loading", "unloading"))
        return PiecewiseLinearProtocol([t0, t1, t2, t3], [start, peak, peak, start], ("loading", "dwell", "unloading"))


Protocol = LoadingProtocol | PiecewiseLinearProtocol | ForceProtocol
"""What `bem.simulate` takes."""
_History = TypeVar("_History", bound=PiecewiseLinearProtocol | ForceProtocol)
_Number = TypeVar("_Number", int, float)


def history_of(protocol: LoadingProtocol | _History, tabor: float) -> PiecewiseLinearProtocol | _History:
    """What a protocol prescribes between its instants, in a scene of this Tabor parameter.

    Raises:
        ValueError: as `LoadingProtocol.history` raises.
    """
    return protocol.history(tabor) if isinstance(protocol, LoadingProtocol) else protocol


def by_phase(phases: Iterable[Phase], values: Iterable[_Number]) -> dict[str, _Number]:
    """Sum of the `values` of all segments of each phase, in the order in which phases first occur."""
    sums: dict[str, _Number] = {}
    for phase, value in zip(phases, values, strict=True):
        sums[phase] = sums.get(phase, 0) + value
    return sums


def in_phase(history: PiecewiseLinearProtocol | ForceProtocol, instants: FloatArray, phase: Phase) -> np.ndarray:
    """Whether instants (n,) lie in segments of a phase, both ends included; bool (n,)."""
    named = np.array([name == phase for name in history.phases])
    ending, beginning = (
        named[np.clip(np.searchsorted(history.times, instants, side) - 1, 0, named.size - 1)]
        for side in ("left", "right")
    )
    return ending | beginning
