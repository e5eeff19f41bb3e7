"""`Contact`: a contact that is advanced step by step, for control loops and for models of which it is a part.

Units: as in `bem.results.trajectory`.
"""

from __future__ import annotations

import copy
import math
from typing import Literal, NamedTuple

import numpy as np

from bem._support.jit import uncompiled
from bem._support.validation import finite_number, instance
from bem._support.wording import shown
from bem.methods.boundary_elements.discrete_problem import device_of, problem_of
from bem.methods.boundary_elements.equilibrium import Factor
from bem.methods.boundary_elements.history import before_start, followed
from bem.methods.boundary_elements.memory import Memory
from bem.methods.boundary_elements.time_stepping import Progress
from bem.methods.outcomes import COMPLETED, NOT_FINITE
from bem.methods.records import MOST_WORK, STEPS, new_records, new_work
from bem.problem.accuracy import resolve_accuracy
from bem.problem.protocol import LARGEST_FORCE, LARGEST_INDENTATION, PiecewiseLinearProtocol, default_start_indentation
from bem.problem.scene import Scene
from bem.simulation import load_kernels


class _Step(NamedTuple):
    """What was asked of a contact."""

    duration: float
    name: str  # of what is prescribed: "indentation" or "force"
    value: float


class _Moment(NamedTuple):
    """A state between two steps; nothing changes it."""

    time: float
    stage: float  # indentation of the stage
    progress: Progress
    steps: int  # of the solver, so far


def _own(progress: Progress) -> Progress:
    """The same state at the begin of a step, with arrays of its own, so that the step leaves it as it is."""
    memory, factor = Memory(*map(np.copy, progress.memory)), Factor(*map(np.copy, progress.factor))
    records = uncompiled(new_records)()
    return progress._replace(memory=memory, factor=factor, records=records, outcome=COMPLETED, segment=0)


class Contact:
    """A contact that is advanced step by step: the solver of `bem.simulate` with its memory between the steps.

    Args:
        scene: what touches.
        accuracy: as in `bem.simulate`.
        start_indentation: indentation (of the stage, behind a spring) at which it begins, in h0; by default
            -pi^(2/3) mu.
        initial_state: "relaxed" or "glassy", as in `bem.simulate`.
        deepest: indentation that the mesh has room for at first, in h0. Where a step leaves it, all steps are taken
            again on a mesh with twice the room.

    Attributes:
        time, indentation, force, contact_radius: of the present state.
        status: "completed", or why the last step could not be taken; the state is then that before it.

    Raises:
        ValueError: for input that is not a scene, an accuracy or an indentation, naming what is allowed, and for a
            Tabor parameter too large for boundary elements.

    Examples:
        >>> import bem
        >>> contact = bem.Contact(bem.Scene(tabor=1.0, material=bem.StandardLinearSolid(0.1)))
        >>> force = contact.advance(0.1, indentation=2.0)  # doctest: +SKIP
        >>> ahead = contact.copy().advance(0.1, indentation=3.0)  # doctest: +SKIP
        >>> indentation = contact.advance(0.1, force=1.0)  # doctest: +SKIP
    """

    def __init__(
        self,
        scene: Scene,
        accuracy: str | float = "standard",
        *,
        start_indentation: float | None = None,
        initial_state: Literal["relaxed", "glassy"] = "relaxed",
        deepest: float = 4.0,
    ) -> None:
        instance("scene", scene, (Scene,))
        self._scene, self._accuracy = scene, resolve_accuracy(accuracy)
        if initial_state not in ("relaxed", "glassy"):
            raise ValueError(f"initial_state must be 'relaxed' or 'glassy'; received {shown(initial_state)}")
        self._glassy = initial_state == "glassy"
        self._start = default_start_indentation(scene.tabor)
        if start_indentation is not None:
            self._start = finite_number("start_indentation", start_indentation, high=LARGEST_INDENTATION)
        load_kernels("boundary elements")
        self._steps: list[_Step] = []
        self._room = max(finite_number("deepest", deepest, high=LARGEST_INDENTATION), self._start)
        self.status = "completed"
        try:
            self._begin()
        except MemoryError as error:
            raise ValueError(f"Contact takes boundary elements and cannot start: {error}; received {scene}") from error

    def __repr__(self) -> str:
        return f"<Contact: time {self.time:g}, indentation {self.indentation:.6g}, force {self.force:.6g}>"

    def _begin(self) -> None:
        """Set the state at the start, on a mesh with the present room, and take the steps so far."""
        path = PiecewiseLinearProtocol([0.0, 1.0], [self._room] * 2)
        problem = problem_of(self._scene, path, self._accuracy)
        by_force = problem._replace(device=device_of(self._scene, True, problem.scales.force))
        self._problems = {"indentation": problem, "force": by_force}
        begin = np.zeros(1), np.array([self._start]), np.empty(0), self._glassy, before_start()
        progress, _, _ = followed(problem, *begin, uncompiled(new_work)(MOST_WORK))
        self._now = _Moment(0.0, self._start, progress, 0)
        if progress.outcome != COMPLETED:
            raise ValueError(
                f"{self._scene} must have an equilibrium at its start; {progress.outcome.status(MOST_WORK)}"
            )
        for step in self._steps:
            self._now = self._after(step)

    @property
    def time(self) -> float:
        """Time since the start, in retardation times."""
        return self._now.time

    @property
    def indentation(self) -> float:
        """Indentation of the sphere, in h0."""
        return float(self._now.progress.state.depth)

    @property
    def force(self) -> float:
        """Force, in pi R dgamma, positive in tension."""
        return float(self._now.progress.state.force)

    @property
    def contact_radius(self) -> float:
        """Contact radius, in beta; 0 where nothing touches."""
        return float(self._now.progress.state.edge)

    def advance(self, duration: float, *, indentation: float | None = None, force: float | None = None) -> float:
        """Move for a duration, and return what was not prescribed at its end.

        Args:
            duration: in retardation times, greater than 0; the solver takes as many steps inside as it needs.
            indentation: the indentation, or the displacement of the stage behind a spring, reached at constant speed.
            force: the force reached at a constant rate, in place of the indentation.

        Returns:
            The force, where the indentation was prescribed; the indentation of the sphere, where the force was. NaN if
            the step could not be taken: the state is then that before it, and `status` says why.

        Raises:
            ValueError: for both or none of indentation and force, or for numbers out of range.
        """
        if (indentation is None) == (force is None):
            raise ValueError(
                "advance takes either an indentation or a force; received "
                f"indentation={shown(indentation)}, force={shown(force)}"
            )
        name, value = ("indentation", indentation) if force is None else ("force", force)
        limit = LARGEST_INDENTATION if force is None else LARGEST_FORCE
        step = _Step(
            finite_number("duration", duration, above=0.0), name, finite_number(name, value, low=-limit, high=limit)
        )
        before = self._room, self._problems, self._now
        try:
            if name == "indentation":
                self._need(step.value)
            after = self._after(step)
            if name == "force" and self._need(float(after.progress.state.depth)):
                after = self._after(step)
            outcome, state = after.progress.outcome, after.progress.state
            if outcome == COMPLETED and not math.isfinite(state.force + state.depth):
                outcome = NOT_FINITE
            if outcome == COMPLETED:
                before = self._room, self._problems, after
                self._steps.append(step)
        except MemoryError as error:
            self.status = f"not started: {error}"
            return math.nan
        finally:  # an error or Ctrl-C leaves the state as it was, too
            self._room, self._problems, self._now = before
        self.status = outcome.status(MOST_WORK)
        if outcome != COMPLETED:
            return math.nan
        return self.force if name == "indentation" else self.indentation

    def copy(self) -> Contact:
        """A contact of its own in the same state, to look ahead."""
        duplicate = copy.copy(self)
        duplicate._steps = list(self._steps)
        return duplicate

    def _need(self, depth: float) -> bool:
        """Whether the mesh had to become larger for an indentation."""
        if not depth > self._room:
            return False
        self._room = max(2.0 * self._room, depth)
        self._begin()
        return True

    def _after(self, step: _Step) -> _Moment:
        """The state after a step."""
        now, state = self._now, self._now.progress.state
        if now.progress.outcome != COMPLETED:  # a step before could not be taken again on a larger mesh
            return now
        first = now.stage if step.name == "indentation" else state.force
        work = uncompiled(new_work)(MOST_WORK)
        work[STEPS] = now.steps
        times, controls = np.array([0.0, step.duration]), np.array([first, step.value])
        begin = _own(now.progress)
        progress, _, _ = followed(self._problems[step.name], times, controls, np.empty(0), False, begin, work)
        spring = self._scene.spring
        stage = step.value if step.name == "indentation" else progress.state.depth
        if step.name == "force" and spring is not None:
            stage -= progress.state.force / spring
        return _Moment(now.time + step.duration, stage, progress, int(work[STEPS]))
