"""Least squares of one model: SciPy moves the nonlinear parameters, the linear ones are solved for at every step.

DMT and JKR are in contact over one span of the curve, wherever the undeformed sphere would overlap the sample and as
far beyond as the residuals want. The two points on either side of each end, between which the force jumps, do not
count.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.ndimage import median_filter

from bem._support.validation import FloatArray
from bem.lab.fitting.measurement import Measurement
from bem.lab.models import CONTACT_POINT, Model, Parameter
from bem.lab.models.contact import NoContactError

_ROUGH = 4e-4  # of the range of the force, several times what near simulations differ by beside their change
_CHANGE = 2.0  # of the tension, in units of the noise over all points, by a step of a derivative
_PASSED = 0.1  # of the noise; a point that changes by so much more than twice what those beside it do falls in a jump
_BESIDE = 9  # points of which the middle change is that of a point without a jump
_OVERLAPS = 0.02  # of the depth, up to which the ends of the contact are free: a search could not step over a sample
_REMEMBERED = 40  # tensions: those of a point and of its derivatives are needed again


@dataclass
class Regression:
    """The problem of one model and one curve.

    Args:
        model, data: what is fitted to what.
        start: first guesses of all parameters, in SI.
        free: those that SciPy moves; the others keep the value of `start`.
        linear: names of `Measurement.columns` that are solved for.
        options: of the model's `tension`.
    """

    model: Model
    data: Measurement
    start: dict[str, float]
    free: tuple[str, ...]
    linear: tuple[str, ...] = ("force_offset",)
    options: dict = field(default_factory=dict)
    evaluations: int = 0

    def __post_init__(self) -> None:
        self.parameters: dict[str, Parameter] = {entry.name: entry for entry in (*self.model.parameters, CONTACT_POINT)}
        depth = float(np.ptp(self.data.depth[self.data.first :]))
        pulled = max(float(np.max(self.data.tension)) - float(np.median(self.data.tension)), self.data.noise)
        size = {"contact_point": 0.1 * depth, "work_of_adhesion": pulled / (5.0 * self.data.setup.radius)}
        self.unit = {name: size.get(name, 1.0) for name in self.free}
        ends = ({name: getattr(entry, end) for name, entry in self.parameters.items()} for end in ("low", "high"))
        self.bounds: tuple[FloatArray, ...] = tuple(map(self.point, ends))
        columns = np.column_stack([self.data.columns[name] for name in self.linear] or [np.zeros((len(self), 0))])
        self.length = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        self.columns = columns / self.length
        self.weights = self.data.weights
        self.inside = np.ones(len(self), dtype=bool)
        # What enters linearly, as the baselines show it: the first guess of where the contact is.
        far = self.data.far
        self.baseline = self.columns @ np.linalg.lstsq(self.columns[far], self.data.tension[far], rcond=1e-6)[0]
        self.coefficients = np.zeros(len(self.linear))
        self.steps = np.full(len(self.free), self.model.difference)
        self.known: dict[tuple[bytes, Any], FloatArray] = {}

    def __len__(self) -> int:
        return self.data.tension.size

    def point(self, values: Mapping[str, float]) -> FloatArray:
        """The point of the search at values in SI."""
        inner = {name: self.parameters[name].inner for name in self.free}
        return np.array([(of(values[name]) - of(self.start[name])) / self.unit[name] for name, of in inner.items()])

    def values(self, x: FloatArray) -> dict[str, float]:
        """Values in SI at a point of the search, those that are fixed included."""
        moved = zip(self.free, map(self.parameters.__getitem__, self.free), x, strict=True)
        return self.start | {
            name: entry.outer(entry.inner(self.start[name]) + by * self.unit[name]) for name, entry, by in moved
        }

    def tension(self, x: FloatArray) -> FloatArray:
        """The model's tension in contact, (n,), and how late it jumps, in standard deviations, (m,)."""
        key = x.tobytes(), self.options.get("accuracy")
        if key not in self.known:
            self.evaluations += 1
            self.known[key] = self.model.tension(self.values(x), self.data, **self.options)
            if len(self.known) > _REMEMBERED:
                self.known.pop(next(iter(self.known)))
        return self.known[key]

    def residuals(self, x: FloatArray) -> FloatArray:
        """Measurement minus model in units of the noise, with the best linear parameters, and lateness, (n + m,)."""
        try:
            tension, late = np.split(self.tension(x), [len(self)])
        except NoContactError:
            late = np.ones(sum(jump.out for jump in self.options.get("jumps", ())))
            far = 1.0 + 2.0 * self.data.range
            return np.append(far * np.maximum(self.data.weights, 1.0), far * late)
        gone = np.isnan(tension)
        if self.model.spans:
            ahead = self.data.position - self.values(x)["contact_point"]
            self._choose_span(tension, ahead > _OVERLAPS * max(float(ahead.max()), 0.0))
        else:
            self.weights, tension = self.data.weights * ~gone, np.where(gone, 0.0, tension)
        residuals = np.append(self._solved(self.data.tension - np.where(self.inside, tension, 0.0)), -late)
        # What is left out counts as noise, so that a search gains nothing by it.
        residuals[: len(self)][gone] = self.data.weights[gone] > 0.0
        return residuals

    def derivatives(self, x: FloatArray) -> FloatArray:
        """Of tension and lateness by the moved parameters, weighted, in units of the noise; contact fixed."""
        here = self.tension(x)
        weights = np.append(self.weights * self.inside / self.data.noise, np.ones(here.size - len(self)))
        low, high = self.bounds
        columns = []
        for i, (step, direction) in enumerate(zip(self.steps, np.eye(x.size), strict=True)):
            ahead, back = (step if inside else 0.0 for inside in (x[i] + step <= high[i], x[i] - step >= low[i]))
            if ahead and self.model.costly:
                back = 0.0
            try:
                after, before = self.tension(x + ahead * direction), self.tension(x - back * direction)
            except NoContactError:
                after = before = np.where(np.isnan(here), np.nan, 0.0)
            change = weights * (after - before)
            near = np.append(
                median_filter(np.nan_to_num(change[: len(self)]), _BESIDE, mode="constant"), change[len(self) :]
            )
            passed = np.abs(change - near) > np.abs(near) + _PASSED
            columns.append(np.where(passed, np.nan, change / (ahead + back)))
        matrix = np.column_stack(columns)
        # A point that a jump passes has no derivative.
        matrix[np.isnan(matrix).any(axis=1)] = 0.0
        return matrix

    def narrow_steps(self, jacobian: FloatArray) -> None:
        """Take later derivatives over changes of the tension by a few standard deviations, where it is nearly linear.

        A corner of the force that moves across a point would else count. What is rough in the solver must stay small.
        """
        rough = _ROUGH * self.data.range * np.sqrt(len(self))
        change = self.model.difference * np.linalg.norm(jacobian[:, : self.steps.size], axis=0)
        self.steps = self.model.difference / np.maximum(1.0, change / np.hypot(_CHANGE, rough))

    def jacobian(self, x: FloatArray) -> FloatArray:
        """Of `residuals`: the derivatives without what the linear parameters take up."""
        matrix = -self.derivatives(x)
        basis = np.linalg.qr(self.columns * self.weights[:, None])[0]
        matrix[: len(self)] -= basis @ (basis.T @ matrix[: len(self)])
        return matrix

    def turn_tilt(self, x: FloatArray) -> None:
        """Let the tilt turn about the contact point."""
        if "tilt" in self.linear:
            turned, tilt = self.data.position - self.values(x)["contact_point"], self.linear.index("tilt")
            self.length[tilt] = np.linalg.norm(turned)
            self.columns[:, tilt] = turned / self.length[tilt]

    def _solved(self, tension: FloatArray) -> FloatArray:
        """Weighted residuals after the linear parameters, which are kept."""
        weights = self.weights / self.data.noise
        scaled = self.columns * weights[:, None]
        self.coefficients = np.linalg.lstsq(scaled.T @ scaled, scaled.T @ (weights * tension), rcond=1e-14)[0]
        return weights * (tension - self.columns @ self.coefficients)

    def _choose_span(self, tension: FloatArray, overlaps: np.ndarray) -> None:
        """Choose where the contact begins and ends, by the residuals in and out of contact (Kadane's algorithm).

        Where the sphere overlaps the sample (`overlaps`) there is contact: else a wrong shape would look like adhesion.
        """
        outside = self.data.tension - self.baseline
        for _ in range(2):
            gain = self.data.weights**2 * (outside**2 - (outside - tension) ** 2)
            total = np.concatenate([[0.0], np.cumsum(gain)])
            end = int(np.argmax(total - np.minimum.accumulate(total)))
            begin = int(np.argmin(total[: end + 1]))
            if overlaps.any():
                within = np.flatnonzero(overlaps)
                begin, end = min(begin, int(within[0])), max(end, int(within[-1]) + 1)
            self.inside = np.zeros(len(self), dtype=bool)
            self.inside[begin:end] = True
            self.weights = self.data.weights.copy()
            for edge in (begin, end):
                self.weights[max(edge - 1, 0) : edge + 1] *= 0.0 if 0 < edge < len(self) else 1.0
            self._solved(self.data.tension - np.where(self.inside, tension, 0.0))
            outside = self.data.tension - self.columns @ self.coefficients
