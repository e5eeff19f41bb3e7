"""What a trained model may be asked: inputs that it refuses, and quantities outside the ranges of its training.

The ranges of the protocol quantities are those of the training set. The other ranges describe what all training
histories have in common: they start and end at -pi^(2/3) mu, and consist of a straight ramp, a dwell and a straight
ramp back with 50, 20 and 50 equally spaced points. Deviations within the tolerances of this module hardly change the
error against the solver. The number of points is an exception: 100 to 140 points in the same proportions are the
resolutions that the paper compares (its appendix "FMS-resolution transferability of the M1-concat surrogate"), and
`experiments.paper.fms_transfer` measures their error. Units as in `bem.problem.protocol`.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from bem._support.validation import real_array
from bem._support.wording import shown
from bem.dataset.designs import QUANTITIES
from bem.dataset.measurement_steps import proportional_counts
from bem.problem.materials import Elastic, StandardLinearSolid
from bem.problem.protocol import (
    LARGEST_INDENTATION,
    LARGEST_RATE,
    LONGEST_DWELL,
    SMALLEST_RATE,
    LoadingProtocol,
    default_start_indentation,
)
from bem.problem.scene import Scene
from bem.problem.tractions import LennardJones
from surrogate.data.features import plateau

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

LONGEST_HISTORY = LONGEST_DWELL + 4.0 * LARGEST_INDENTATION / SMALLEST_RATE
"""Duration of the slowest protocol, in retardation times."""

SHORTEST_STEP = 1e-24
"""Smallest time step: far below that of any allowed motion, and far above that at which a division overflows."""

RANGE_TOLERANCE = 1e-6
"""Relative tolerance of all bounds, for rates that are computed from rounded times."""

MARGIN = 0.1
"""How far outside its ranges a protocol on a solid may lie: shares of the width of each range in its logarithm, added.

Up to there the median error of the pull-off force stays below 2 % (`fast` and `accurate`,
`experiments.surrogates.outside_ranges`); predictions farther outside are refused.
"""

_PHASES = ("loading_points", "dwell_points", "unloading_points")
POINTS = dict(zip(_PHASES, zip(*(proportional_counts(total) for total in (100, 140)), strict=True), strict=True))
"""Smallest and largest number of points in each phase."""

START_TOLERANCE = 0.03
"""Largest relative difference of start and end from -pi^(2/3) mu."""

BEND_TOLERANCE = 0.005
"""Largest difference of an indentation from the straight ramps and the dwell, as a fraction of the travel."""

LARGEST_STEP_RATIO = 1.5
"""Largest ratio of the longest to the shortest time step within a phase."""

ADVICE = {
    **dict.fromkeys(
        ("start_indentation", "end_indentation"),
        "begin and end the history at -pi^(2/3) tabor, as all of the training do",
    ),
    **dict.fromkeys(
        (*POINTS, "step_ratio"),
        "the model counts points: give it 50 equally spaced ones in loading, 20 in the dwell and 50 in unloading",
    ),
    "bend": "the model knows straight ramps and a flat dwell: average noise away, or ask the solver about another path",
}
"""Advice by the name of the quantity outside its range; `OTHERWISE` holds for the quantities that are not listed."""
OTHERWISE = "compare with the solver before you trust a protocol the model has not seen (`surrogate predict --check`)"


Scenes = Scene | Sequence[Scene]
"""One scene, or one for each history."""


class ExtrapolationWarning(UserWarning):
    """A prediction is outside the ranges of the training set."""


def contacts(
    scene: Scenes, protocol: LoadingProtocol | Sequence[LoadingProtocol], more: str
) -> tuple[list[Scene], list[LoadingProtocol], bool]:
    """Read the arguments of a prediction.

    Args:
        scene: One scene, or one for each protocol.
        protocol: One protocol, or one for each scene.
        more: What else a protocol must be, for the message.

    Returns:
        The scenes, as many protocols as there are contacts, and whether both arguments are single.

    Raises:
        ValueError: a protocol is none.
    """
    scenes, protocols = _listed(scene), _listed(protocol)
    if strange := [entry for entry in protocols if not isinstance(entry, LoadingProtocol)]:
        raise ValueError(f"protocol must be a LoadingProtocol {more}; received {shown(strange[0])}")
    single = not isinstance(scene, Iterable) and not isinstance(protocol, Iterable)
    return scenes, protocols * len(scenes) if len(protocols) == 1 else protocols, single


def _listed(argument: Any) -> list[Any]:
    return list(argument) if isinstance(argument, Iterable) else [argument]


def tabor_parameters(scene: Scenes, count: int) -> np.ndarray:
    """Return Tabor parameters of shape `(count,)`, from one scene per history or one for all.

    Raises:
        ValueError: a scene is none, their number does not fit, or one is not of the kind that all models learned:
            Lennard-Jones adhesion, a paraboloid, and no spring.
    """
    scenes = _listed(scene)
    if len(scenes) not in (1, count):
        raise ValueError(f"scene must be one, or one for each of {count} histories; received {len(scenes)}")
    for at, entry in enumerate(scenes):
        _require_learned(entry, _where(scenes, at))
    return np.resize([entry.tabor for entry in scenes], count).astype(np.float64)


def modulus_ratios(scene: Scenes, count: int) -> np.ndarray:
    """Return modulus ratios of shape `(count,)` likewise.

    Raises:
        ValueError: a material is neither a standard linear solid nor elastic.
    """
    scenes = _listed(scene)
    for at, material in enumerate(entry.material for entry in scenes):
        if not isinstance(material, StandardLinearSolid | Elastic):
            raise ValueError(
                "material must be a standard linear solid, as in the training, `fast`, `accurate` and the solver know "
                f"others (`bem.simulate`); received {shown(material)}{_where(scenes, at)}"
            )
    return np.resize([entry.material.modulus_ratio for entry in scenes], count).astype(np.float64)


def _where(scenes: Sequence[Any], at: int) -> str:
    return f" as scene {at}" * (len(scenes) > 1)


def _require_learned(scene: Any, where: str) -> None:
    if not isinstance(scene, Scene):
        raise ValueError(f"scene must be a bem.Scene; received {shown(scene)}{where}")
    if not isinstance(scene.adhesion, LennardJones) or scene.spring is not None or scene.indenter is not None:
        unsupported = "a spring" if scene.spring is not None else shown(scene.indenter or scene.adhesion)
        raise ValueError(
            "scene must have Lennard-Jones adhesion, a paraboloid and no spring, as in the training, the solver knows "
            f"others (`bem.simulate`); received {unsupported}{where}"
        )


def check_history(times: np.ndarray, indentations: np.ndarray) -> None:
    """Check times and indentations of shape `(batch, steps)`.

    Raises:
        ValueError: the shapes differ, a value is NaN or infinite, times do not increase strictly, or a value is outside
            the bounds of `bem.problem.protocol`.
    """
    if times.ndim != 2 or times.shape != indentations.shape or times.size == 0:
        raise ValueError(
            "times and indentations must have the same shape (batch, steps); "
            f"received times of shape {times.shape}, indentations of shape {indentations.shape}"
        )
    with np.errstate(all="ignore"):
        # Models use the time since the first point; by rounding, two late times may have the same one.
        since = times - times[:, :1]
        steps, rises = since[:, 1:] - since[:, :-1], indentations[:, 1:] - indentations[:, :-1]
        sound = ((steps >= SHORTEST_STEP) & (np.abs(rises) <= LARGEST_RATE * steps)).all(axis=1)
        sound &= (np.abs(indentations) <= LARGEST_INDENTATION).all(axis=1) & (since[:, -1] <= LONGEST_HISTORY)
    if sound.all():
        return
    row = int(sound.argmin())
    time, where = times[row], f" in history {row}" if len(times) > 1 else ""
    for name, values in (("times", time), ("indentations", indentations[row])):
        if not np.isfinite(values).all():
            raise ValueError(f"{name} must be finite; received NaN or infinity{where}")
    for step in np.flatnonzero(steps[row] <= 0.0)[:1]:
        received = f"{float(time[step + 1])!r} after {float(time[step])!r}"
        raise ValueError(f"times must increase strictly; received {received}{where}")
    for name, values, low, high in (
        ("indentations", indentations[row], -LARGEST_INDENTATION, LARGEST_INDENTATION),
        ("times after the first", since[row], 0.0, LONGEST_HISTORY),
        ("time steps", steps[row], SHORTEST_STEP, LONGEST_HISTORY),
        ("rates", rises[row] / steps[row], -LARGEST_RATE, LARGEST_RATE),
    ):
        for value in values[(values < low) | (values > high)][:1].tolist():
            raise ValueError(f"{name} must be from {low:g} to {high:g}; received {value!r}{where}")


def checked_edge(edge: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    """Return edge marks of shape `shape` as float64.

    Raises:
        ValueError: the shape is another one, or a mark is neither zero nor one.
    """
    edge = real_array("edge", edge)
    if edge.shape != shape:
        raise ValueError(f"edge must be of shape {shape}; received shape {edge.shape}")
    bad = edge[~((edge == 0.0) | (edge == 1.0))]
    if bad.size:
        raise ValueError(f"edge must be zero or one; received {bad[0]:g}")
    return edge


@dataclass(frozen=True)
class Excess:
    """A quantity that is outside its range in at least one history; all arrays are of shape `(batch,)`."""

    name: str
    values: np.ndarray
    low: np.ndarray
    high: np.ndarray
    beyond: np.ndarray
    """Distance of each value from its range; zero inside the range, and for NaN."""

    def words(self, index: int) -> str:
        """Return name, value and range for the history `index` as text."""
        return f"{self.name} = {self.values[index]:.6g} lies outside [{self.low[index]:.6g}, {self.high[index]:.6g}]"

    @property
    def shares(self) -> np.ndarray:
        """Distances from the range over its width, in the logarithm; zero for what is not of a protocol or solid.

        No dwell is too short: the shortest of the training hardly relaxes.
        """
        if self.name not in (*QUANTITIES, "modulus_ratio"):
            return np.zeros_like(self.values)
        with np.errstate(all="ignore"):
            below, above = np.log(self.low / self.values), np.log(self.values / self.high)
            if self.name == "dwell_time":
                below = np.zeros_like(below)
            distances = np.maximum(below, above) / np.log(self.high / self.low)
        distances[self.values < 0.0] = np.inf
        return np.where(self.beyond > 0.0, distances, 0.0)


def allowed(name: str, low: float, high: float, margin: float = MARGIN) -> tuple[float, float]:
    """Return the smallest and the largest value of a quantity of this range, with a margin."""
    factor = (high / low) ** margin
    return 0.0 if name == "dwell_time" else low / factor, min(high * factor, 1.0 if name == "modulus_ratio" else np.inf)


def excesses(quantities: dict[str, np.ndarray], ranges: dict[str, tuple[float, float]]) -> list[Excess]:
    """Return the quantities that are outside their range.

    Args:
        quantities: Values by name, each of shape `(batch,)`; NaN if a history does not have the quantity. Names without
            a range are ignored.
        ranges: Smallest and largest value in the training set, by name. This module has the ranges of the others.

    Returns:
        One entry for each quantity of which at least one value is outside; empty if there is none.
    """
    bounds = _bounds(ranges, quantities.get("tabor"))
    names = [name for name in quantities if name in bounds]
    if not names:
        return []
    # One set of array operations for all quantities: a prediction takes hardly longer than a few dozen of them.
    values = np.array([quantities[name] for name in names])
    low, high = np.empty_like(values), np.empty_like(values)
    for row, name in enumerate(names):
        low[row], high[row] = bounds[name]
    # Nearly always; only a value outside is compared with the tolerance.
    if ((values >= low) & (values <= high)).all():
        return []
    below, above = low - values, values - high
    outside = (below > RANGE_TOLERANCE * np.abs(low)) | (above > RANGE_TOLERANCE * np.abs(high))
    if not outside.any():
        return []
    beyond = np.where(outside, np.maximum(below, above), 0.0)
    rows = np.flatnonzero(outside.any(axis=1))
    return [Excess(names[row], values[row], low[row], high[row], beyond[row]) for row in rows]


def refusals(outside: Sequence[Excess], count: int, name: str, *, single: bool) -> list[str]:
    """Return for each of `count` histories why the model `name` refuses it, as one sentence; `""` if it does not.

    Raises:
        ValueError: it refuses a single one.
    """
    reasons = [""] * count
    if not outside:
        return reasons
    shares = np.array([excess.shares for excess in outside])
    for row in np.flatnonzero(shares.sum(axis=0) > MARGIN).tolist():
        farthest = int(shares[:, row].argmax())
        excess, other_shares = outside[farthest], np.delete(shares[:, row], farthest).sum()
        low, high = allowed(excess.name, excess.low[row], excess.high[row], max(MARGIN - other_shares, 0.0))
        reasons[row] = (
            f"{excess.name} must be from {low:.4g} to {high:.4g} for {name}, the range of its training and a margin; "
            f"`bem.simulate` takes others; received {excess.values[row]:.6g}"
        )
    if single and reasons[0]:
        raise ValueError(reasons[0])
    return reasons


def _bounds(ranges: dict[str, Any], tabor: Any) -> dict[str, tuple[Any, Any]]:
    """Return the bounds of all quantities by name; those of start and end if the Tabor parameter is known."""
    bounds = {**POINTS, "bend": (0.0, BEND_TOLERANCE), "step_ratio": (1.0, LARGEST_STEP_RATIO)}
    if tabor is not None:
        start = default_start_indentation(tabor)
        near = (1.0 + START_TOLERANCE) * start, (1.0 - START_TOLERANCE) * start
        bounds |= {"start_indentation": near, "end_indentation": near}
    return bounds | ranges


def warn_of_extrapolation(name: str, excesses: list[Excess], where: str = "", reasons: Sequence[str] = ()) -> None:
    """Issue one `ExtrapolationWarning` for all excesses, if there are any, at the caller of the calling method.

    Args:
        name: Name of the model.
        excesses: What `excesses` returned; of each quantity, the value farthest outside is named.
        where: What lies outside, in words; by default the model.
        reasons: What `refusals` returned.
    """
    if excesses:
        texts = [excess.words(int(excess.beyond.argmax())) for excess in excesses]
        message = f"{where or f'{name} extrapolates beyond its training'}: {'; '.join(texts)}. Advice: {advice(texts)}"
        if refused := list(filter(None, reasons)):
            message = f"{len(refused)} of {len(reasons)} predictions are refused and NaN: {refused[0]}. {message}"
        warnings.warn(message, ExtrapolationWarning, stacklevel=3)


def advice(texts: Iterable[str]) -> str:
    """Return the advice on the texts of `Excess.words`, without repetition."""
    return "; ".join(dict.fromkeys(ADVICE.get(quantity.split(" = ")[0], OTHERWISE) for quantity in texts))


def of_history(excesses: Iterable[Excess], index: int) -> tuple[str, ...]:
    """Return the quantities of the history `index` that are outside their range, as text."""
    return tuple(excess.words(index) for excess in excesses if excess.beyond[index] > 0.0)


def history_quantities(
    times: np.ndarray, indentations: np.ndarray, edge: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """Return the quantities of histories that `excesses` checks.

    A quantity of a phase that a history does not have is NaN.

    Args:
        times: Times of shape `(batch, steps)`.
        indentations: Indentations of the same shape.
        edge: Marks of the same shape, one at the first and the last point of the dwell and zero elsewhere, if known. By
            default, and for a history without one or two marks, the dwell is the longest run of constant indentation.

    Returns:
        Arrays of shape `(batch,)` by the name of the quantity.
    """
    marks = [None] * len(times) if edge is None else edge
    rows = [_history(*row) for row in zip(times, indentations, marks, strict=True)]
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _history(time: np.ndarray, indentation: np.ndarray, edge: np.ndarray | None) -> dict[str, float]:
    marks, peak, last = np.flatnonzero(edge if edge is not None else ()), int(indentation.argmax()), len(time) - 1
    # Without a dwell, both are that of the peak.
    onset, end = (marks[0], marks[-1]) if len(marks) in (1, 2) else plateau(indentation) or (peak, peak)
    corners = sorted({0, onset, end, last})
    travel, steps = np.ptp(indentation), np.diff(time)
    straight = np.interp(time, time[corners], indentation[corners])
    ratios = [float(steps[begin:stop].max() / steps[begin:stop].min()) for begin, stop in pairwise(corners)]

    def slope(begin: int, end: int) -> float:
        if end <= begin:
            return np.nan
        return float((indentation[end] - indentation[begin]) / (time[end] - time[begin]))

    return {
        "peak_indentation": float(indentation.max()),
        "loading_rate": slope(0, onset),
        "dwell_time": float(time[end] - time[onset]),
        "unloading_rate": -slope(end, last),
        "start_indentation": float(indentation[0]),
        "end_indentation": float(indentation[last]),
        "loading_points": onset + 1.0,
        # Without a dwell there is no number of points; the dwell time of zero is checked.
        "dwell_points": float(end - onset) if end > onset else np.nan,
        "unloading_points": float(last - end),
        "bend": float(np.abs(indentation - straight).max() / travel) if travel else 0.0,
        "step_ratio": max(ratios, default=1.0),
    }
