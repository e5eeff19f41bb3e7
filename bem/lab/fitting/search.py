"""The least-squares problem of a fit: what varies, residuals of forces and of the instants of jumps, derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from bem._support.validation import FloatArray
from bem.lab.fitting.jumps import as_residuals
from bem.lab.fitting.model import Model
from bem.lab.fitting.parameters import PARAMETERS

_GOOD = 1.1  # misfit in standard deviations of the noise at which one run is enough
_STRIDE = 3.0  # steps of the search, over which the derivatives behind the intervals are taken


@dataclass
class Search:
    """The least-squares problem of one curve: what varies, and the residuals in standard deviations of the noise.

    Residuals are those of the n points of the curve, and then those of the instants of its m jumps.
    """

    model: Model
    free: tuple[str, ...]
    fixed: dict[str, float]
    unit: dict[str, float]
    """Change of each transformed parameter that counts as one in the search."""
    origin: dict[str, float]
    """Parameters in SI at which the search is zero, so that its relative tolerances mean something."""
    weights: FloatArray
    accuracy: str | float = "draft"
    report: Callable[[int, float], None] | None = None
    _last: tuple[Any, FloatArray | None] = (None, None)

    @property
    def searched(self) -> tuple[str, ...]:
        """The free parameters that the search moves: all but the linear offset."""
        return tuple(name for name in self.free if name != "force_offset")

    @cached_property
    def bad(self) -> float:
        """Residual of a contact that the solver does not complete: more than no contact at all would leave."""
        tension = self.model.curve.tension
        return 1.0 + 2.0 * float(np.max(self.weights * np.abs(tension - np.median(tension))))

    def values(self, x: FloatArray) -> dict[str, float]:
        """Parameters in SI of a point of the search."""
        free = {
            name: PARAMETERS[name].outer(x[i] * self.unit[name] + PARAMETERS[name].inner(self.origin[name]))
            for i, name in enumerate(self.searched)
        }
        return self.fixed | free

    def point(self, values: Mapping[str, float]) -> FloatArray:
        """The point of the search that belongs to parameters in SI."""
        return np.array([self._inner(name, values[name]) for name in self.searched])

    def _inner(self, name: str, value: float) -> float:
        parameter = PARAMETERS[name]
        return (parameter.inner(value) - parameter.inner(self.origin[name])) / self.unit[name]

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest values of each searched parameter."""
        low, high = (
            np.array(
                [
                    self._inner(name, getattr(PARAMETERS[name], side))
                    if PARAMETERS[name].scale != "linear"
                    else getattr(PARAMETERS[name], side)
                    for name in self.searched
                ]
            )
            for side in ("low", "high")
        )
        return low, high

    def offset(self, tension: FloatArray) -> float:
        """The force offset, as a tension: the best one where it is free."""
        if "force_offset" not in self.free:
            return self.fixed.get("force_offset", 0.0)
        square = (self.weights * self.model.shares()) ** 2
        return float(np.sum(square * (self.model.curve.tension - tension)) / np.sum(square))

    def residuals(self, x: FloatArray, offset: float | None = None) -> FloatArray:
        """Weighted model minus measurement, shape (n + m,); with the best force offset unless one is given."""
        # The Jacobian begins where the search has just been.
        asked = (x.tobytes(), self.accuracy)
        if asked != self._last[0]:
            self._last = asked, self.model.tension(self.values(x), self.accuracy)
        tension = self._last[1]
        if tension is None:
            return np.full(len(self.model.curve) + len(self.model.measured), self.bad)
        curve = self.model.curve
        added = self.offset(tension) if offset is None else offset
        missed = self.model.shares() * self.weights * (tension + added - curve.tension)
        found = np.concatenate([missed, as_residuals(self.model.late())])
        if self.report is not None:
            self.report(self.model.evaluations, float(np.sqrt(np.mean(found**2))))
        return found

    def misfit(self, x: FloatArray) -> float:
        """Root mean square of the residuals."""
        return float(np.sqrt(np.mean(self.residuals(x) ** 2)))

    def until_good(self, points: Sequence[FloatArray], evaluations: int) -> list[OptimizeResult]:
        """Least squares from each point, the best first; once one describes the curve, no other is tried."""
        runs: list[OptimizeResult] = []
        for x in points:
            runs.append(self.run(x, evaluations))
            if np.mean(runs[-1].fun ** 2) < _GOOD**2:
                break
        return sorted(runs, key=lambda run: run.cost)

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Derivative of the residuals with the best offset at each point, shape (n + m, searched)."""
        here = self.residuals(x)
        return np.column_stack([self.residuals(x + step) - here for step in np.eye(x.size)])

    def full_jacobian(self, x: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """Derivative by all free parameters, the offset last and in N, shape (n + m, free), by central differences.

        Steps are long: where parameters trade off, the solver's scatter over a short one would look like a difference
        that tells them apart, and the intervals would be too narrow. Also which rows have a derivative, (n + m,) bool:
        the points that no jump passed, and the jumps that the model has too.
        """
        self.residuals(x, 0.0)
        columns, jumps = [], [self.model.jumps]
        smooth = [self.model.shares() == 1.0]
        known = [np.isfinite(self.model.passages)]
        for step in _STRIDE * np.eye(x.size):
            sides = []
            for side in (x + step, x - step):
                sides.append(self.residuals(side, 0.0))
                jumps.append(self.model.jumps)
                smooth.append(self.model.shares() == 1.0)
                known.append(np.isfinite(self.model.passages))
            columns.append((sides[0] - sides[1]) / (2.0 * _STRIDE))
        points = np.logical_and.reduce([self.model.away_from_jumps(jumps), *smooth])
        rows = np.concatenate([points, np.logical_and.reduce(known)])
        lifted = np.concatenate([self.weights, np.zeros(len(self.model.measured))])
        return np.column_stack(columns + [lifted] * ("force_offset" in self.free)), rows

    def run(self, x: FloatArray, evaluations: int) -> OptimizeResult:
        """Least squares from a point."""
        low, high = self.bounds
        inside = np.clip(x, low + 1e-9, high - 1e-9)
        # The solver's results scatter by its own error: an improvement below that is not real.
        return least_squares(
            self.residuals,
            inside,
            jac=self.jacobian,
            bounds=(low, high),
            max_nfev=evaluations,
            xtol=1e-4,
            ftol=1e-5,
            gtol=1e-8,
        )
