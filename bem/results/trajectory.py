"""The result of a simulation: force history, status and cost.

Units: time in retardation times, indentation in h0, force in pi R dgamma (tension positive), contact radius in beta,
work and hysteresis in h0 pi R dgamma.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from bem._support.interpolation import ForceInterpolant
from bem._support.tabular import FORCE, UNITS, Column, Tabular
from bem._support.validation import FloatArray
from bem.results.profiles import Profiles

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

FAR_FIELD_FACTOR = 4.0
"""How many times the attraction of undeformed surfaces still counts as far field; see `far_field`."""
_CANCELLED = 0.2  # error of a viscoelastic loop, over that of the target times the work of both ways


def far_field(force: ArrayLike, indentation: ArrayLike, *, doubt: float = 0.0) -> np.ndarray:
    """Whether a force has fallen to the attraction of surfaces that do not touch; shapes broadcast, result bool.

    The attraction of an undeformed sphere at a gap 1 - delta, P = 2 integral of the traction over the gap, does not
    depend on material and Tabor parameter. Attraction raises the surface and a deep contact leaves a dent, so that the
    force of separated surfaces is less, or up to four times as much: that of a surface that bridges half of the gap. In
    the elastic contact the factor is 1.4 at most.

    Args:
        force: tension positive.
        indentation: at which the force acts; above 0 the undeformed sphere is taken to just touch.
        doubt: error of the force, added to what is allowed.

    Returns:
        Truth values, of the broadcast shape of `force` and `indentation`.
    """
    gap = 1.0 - np.minimum(indentation, 0.0)
    alone = 8.0 / 3.0 * (gap**-2.0 - 0.25 * gap**-8.0)
    return np.asarray(force) <= FAR_FIELD_FACTOR * alone + doubt


def is_completed(status: str) -> bool:
    """Whether a `Trajectory.status`, also one that was stored, is that of a completed trajectory."""
    return status.startswith(("completed", "detached"))


@dataclass(frozen=True)
class Jump:
    """An instability: the contact changes to another branch of equilibria at constant time and indentation.

    Behind a spring the stage stands still and the sphere moves; under a prescribed force the force stands still.
    """

    time: float
    indentation: float
    force_before: float
    force_after: float
    eigenvalue_before: float
    """Smallest eigenvalue of the Jacobian in the last state before; near zero at a fold."""
    eigenvalue_after: float
    """The same after; positive, the new state is stable."""
    energy_lost: float = np.nan
    """What an elastic contact dissipates in the jump, in h0 pi R dgamma, with what its spring loses; NaN for others."""
    indentation_after: float = np.nan
    """Indentation of the sphere after the jump; NaN where it has flown off under a prescribed force."""


@dataclass(frozen=True, kw_only=True)
class Statistics:
    """Numbers of steps, iterations and nodes of a simulation; only `seconds` depends on the machine."""

    method: str = "boundary elements"
    """Which solution answered: "boundary elements", "sharp crack", "elastic branch", "Hertz" or "elements"."""
    left_out: tuple[str, ...] = ()
    """Effects of the scene that were too small to matter; see `bem.problem.negligible_effects`."""
    left_out_error: float = 0.0
    """Bound of the relative error of the force that leaving them out makes."""
    steps: int = 0
    """Accepted time steps."""
    steps_by_phase: dict[str, int] = field(default_factory=dict)
    """Accepted steps in 'loading', 'dwell' and 'unloading' segments; a phase that does not occur is absent."""
    rejections: int = 0
    iterations: int = 0
    factorisations: int = 0
    memory_vectors: int = 0
    nodes: float = 0.0
    """Mean number of nodes."""
    unknowns_per_solve: float = 0.0
    """Mean size of the linear systems: nodes whose traction answers to the gap."""
    grid_nodes: int = 0
    """Size of the master grid on which memory lives, at the start where it moves with the edge."""
    attempts: int = 1
    """How often the simulation was begun, each time at a tighter accuracy; the counts above are of the last."""
    failed_attempts: int = 0
    """Those of them that found no way through."""
    multiply_adds: int = 0
    """Work of all attempts, estimated from the sizes of the linear systems; `bem.simulate` bounds it."""
    seconds: float = 0.0
    """Of all attempts."""


@dataclass(frozen=True, repr=False)
class Trajectory(Tabular):
    """A force history, in arrays of equal length; at a jump two entries share one time, before and after.

    `status` begins with "completed", and says more where the accuracy had to be tightened. Otherwise it says why not,
    and the arrays end where the solution does. Under a prescribed force that the contact comes not to bear, it begins
    with "detached", and the last entry is that before the sphere flies off. Ask `completed`; the words may change.
    """

    time: FloatArray
    indentation: FloatArray
    force: FloatArray
    contact_radius: FloatArray
    status: str
    jumps: tuple[Jump, ...]
    stats: Statistics
    accuracy: float
    """Target relative error; that which is expected, of a sharp crack."""
    unloading: np.ndarray
    """(n,) bool: entries that belong to an unloading segment, its first instant included."""
    energy_balance: float = np.nan
    """Work put into an elastic contact: the change of its stored energy plus what its jumps lost; else NaN."""
    spring: float | None = None
    """Stiffness of the spring between stage and sphere, in pi R dgamma / h0; `None` where there is none."""
    by_force: bool = False
    """Whether the protocol prescribed the force."""
    attraction: float = 1.0
    """Attraction of the undeformed indenter at the last indentation, over that of the paraboloid."""
    profiles: Profiles | None = None
    """Gap, traction and displacement over the radius, at the instants that `simulate` was asked for."""

    @property
    def stage(self) -> FloatArray:
        """Displacement of the stage, in h0: the indentation less the extension of the spring, force over stiffness."""
        return self.indentation if self.spring is None else self.indentation - self.force / self.spring

    @property
    def hysteresis_accuracy(self) -> float:
        """Relative error to be expected of the hysteresis: `accuracy`, more where the loop loses little.

        The jumps of an elastic contact are exact to `accuracy` times half of h0 pi R dgamma, however small the loop.
        The loop of a viscoelastic one is a difference of works, which together err by a fifth of `accuracy` times
        `turnover` at most in nearly all random scenes. Effects that were left out add their bound times `turnover`.
        """
        loop, turnover = max(self.hysteresis, 1e-12), self.turnover()
        left_out = self.stats.left_out_error * turnover / loop if self.stats.left_out else 0.0
        # The loop whose relative error is `accuracy`; the error of a smaller one is as large as that of this.
        least = 0.5 if np.isfinite(self.energy_balance) else _CANCELLED * turnover
        return self.accuracy * max(1.0, least / loop) + left_out

    @property
    def completed(self) -> bool:
        """Whether the history reaches the end of the protocol, or its contact ended under the prescribed force."""
        return is_completed(self.status)

    @cached_property
    def _pull_off(self) -> int:
        if not self.completed or not np.any(self.unloading):
            return -1
        candidates = np.flatnonzero(self.unloading)
        return int(candidates[np.argmax(self.force[candidates])])

    @property
    def pull_off_force(self) -> float:
        """Largest force while unloading (tension positive); NaN when unfinished or never unloaded.

        Where the contact is not `detached` at the end it is the largest so far, and a longer unloading may exceed it.
        """
        return float(self.force[self._pull_off]) if self._pull_off >= 0 else np.nan

    @property
    def pull_off_time(self) -> float:
        """Time of the pull-off force; NaN when there is none."""
        return float(self.time[self._pull_off]) if self._pull_off >= 0 else np.nan

    @property
    def max_compression(self) -> float:
        """Smallest force: largest compression, negative, or smallest tension if not compressed; NaN if unfinished."""
        return float(np.min(self.force)) if self.completed else np.nan

    @property
    def end_force(self) -> float:
        """Force at the end of the protocol; NaN when unfinished."""
        return float(self.force[-1]) if self.completed else np.nan

    @property
    def detached(self) -> bool:
        """Whether the surfaces have separated by the end of the protocol; False when unfinished.

        Two things must hold. The contact edge is gone: the contact radius is zero, as the gap is everywhere wider than
        that of the largest tension (without adhesion: as nothing presses). And the force has fallen to the far-field
        attraction, see `far_field`; without adhesion it is zero. For mu < 0.09 the default start itself lies within the
        gap of the largest tension, so that a slow unloading ends attached there. A sphere that flew off under a
        prescribed force is detached.
        """
        flew_off = self.status.startswith("detached")
        if not self.completed or flew_off:
            return flew_off
        force = self.force[-1] / self.attraction
        return bool(self.contact_radius[-1] == 0.0 and far_field(force, self.indentation[-1]))

    @cached_property
    def hysteresis(self) -> float:
        """Area |closed integral of P d(delta)| of the loop, interpolated as by `at`; NaN when unfinished.

        The paper's definition has no sign. It is energy dissipated where `work` is positive; where that is negative the
        contact gave back energy that it held at the start, as from a glassy start in contact.
        """
        return abs(self.work()) if self.completed else np.nan

    def turnover(self) -> float:
        """Integral of |P d(delta)| over the history: what its work is to be compared with."""
        mean = 0.5 * (np.abs(self.force[1:]) + np.abs(self.force[:-1]))
        return float(np.sum(mean * np.abs(np.diff(self.indentation))))

    def work(self) -> float:
        """Integral of -P d(delta) over the history: the energy put into the contact.

        What a loop closed in indentation and state dissipates; negative where the contact gave energy back. Of an
        elastic contact it is `energy_balance`, which does not subtract large areas. Behind a spring the indentation is
        that of the sphere; over a closed cycle the work of the stage is the same.
        """
        if np.isfinite(self.energy_balance):
            return self.energy_balance
        if self.by_force:
            return float(-np.sum(0.5 * (self.force[1:] + self.force[:-1]) * np.diff(self.indentation)))
        total, stage = 0.0, self.stage
        for (begin, end), integral in zip(self._interpolant.ranges, self._interpolant.integrals(), strict=True):
            duration = self.time[end - 1] - self.time[begin]
            if duration > 0.0:
                total -= float((stage[end - 1] - stage[begin]) / duration * integral)
        if self.spring is not None:  # what the spring holds at the end is work of the stage, not of the sphere
            total -= float(0.5 * (self.force[-1] ** 2 - self.force[0] ** 2) / self.spring)
        return total

    @cached_property
    def _interpolant(self) -> ForceInterpolant:
        if self.by_force:  # linear between entries
            return ForceInterpolant(self.time, self.force, [], self.time)
        return ForceInterpolant(self.time, self.force, [jump.time for jump in self.jumps], self.time[self._corner])

    @property
    def corners(self) -> FloatArray:
        """Instants at which a segment of the protocol begins, and the end; of a prescribed force the ends only."""
        inner = self.time[self._corner] if not self.by_force else self.time[:0]
        return np.unique(np.concatenate([self.time[:1], inner, self.time[-1:]]))

    @cached_property
    def _corner(self) -> np.ndarray:
        rates = np.diff(self.stage) / np.maximum(np.diff(self.time), 1e-300)
        scale = np.maximum(np.abs(rates[1:]), np.abs(rates[:-1]))
        corner = np.zeros(self.time.size, dtype=bool)
        corner[1:-1] = np.abs(np.diff(rates)) > 1e-4 * scale
        return corner

    def at(self, times: ArrayLike) -> FloatArray:
        """Force at `times` (any shape) by monotone interpolation, which does not overshoot.

        It reaches across no jump and no corner of the protocol. A time a few roundings outside counts as the end.

        Raises:
            ValueError: for times outside the trajectory.
        """
        return self._interpolant.at(times)

    def columns(self) -> dict[str, Column]:
        """The columns of `to_dataframe` and `to_xarray`, with their units."""
        stage = () if self.spring is None else ("stage",)
        names = ("time", "indentation", "force", "contact_radius", *stage, "unloading")
        return {name: Column(getattr(self, name), UNITS.get(name, "")) for name in names}

    def facts(self) -> dict[str, str]:
        """Status, number of records and results, as texts."""
        facts = {"status": self.status, "records": str(len(self.time))}
        if np.isfinite(self.pull_off_force):
            facts |= {"pull-off force": f"{self.pull_off_force:.4g} {FORCE}"}
            facts |= {"hysteresis": f"{self.hysteresis:.4g} {UNITS['hysteresis']}"}
            facts |= {"detached": "yes" if self.detached else "no"}
        return facts | ({"jumps": str(len(self.jumps))} if self.jumps else {})

    def plot(self, *, title: str = "") -> Figure:
        """Draw the history and the loop of the force; see `bem.results.plots.draw_trajectory`."""
        from bem.results.plots import draw_trajectory

        return draw_trajectory(self, title)

    def filmstrip(self, path: str | Path, setup: Any = None) -> None:
        """Draw the contact at the instants that tell its story (.png, .pdf, .svg); see `draw_filmstrip`."""
        from bem.results.film import draw_filmstrip

        draw_filmstrip(self, setup).savefig(path, dpi=200)

    def animate(self, path: str | Path, setup: Any = None) -> None:
        """Write the moving contact beside its force history (.gif, or .mp4 by ffmpeg); see `write_film`."""
        from bem.results.film import write_film

        write_film(self, path, setup)

    def summary(self) -> dict[str, Any]:
        """The scalars of the trajectory, ready for JSON: status, pull-off, hysteresis, work, jumps, statistics."""
        names = ("status", "accuracy", "pull_off_force", "pull_off_time", "max_compression", "hysteresis")
        return {name: getattr(self, name) for name in (*names, "hysteresis_accuracy")} | {
            "work": self.work() if self.completed else np.nan,
            "end_force": self.end_force,
            "detached": self.detached,
            "jumps": [asdict(jump) for jump in self.jumps],
            "stats": asdict(self.stats),
        }
