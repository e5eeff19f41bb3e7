"""One fitted model: what its residuals say of it, its 95 % intervals, and whether it describes the curve.

It is judged in sum, over depth in blocks, where contact begins, and at three depths. The noise is that of the baseline,
as correlated as the baseline is, so that a misfit does not count as noise.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import orth
from scipy.optimize import least_squares
from scipy.signal import lfilter
from scipy.special import fdtri, stdtrit

from bem._support.validation import FloatArray
from bem.lab.contact_point import noise_of
from bem.lab.fitting.measurement import slow_noise
from bem.lab.fitting.regression import Regression
from bem.lab.models import Model, setup_of
from bem.lab.setup import Setup

CONFIDENCE = 0.95
_BLOCKS = 8  # of the depth, on either way
_ERROR_IN_A_BLOCK = 0.0016  # of the solver, over the range of the force: its standard deviation, for intervals
_MOST_IN_A_BLOCK = 0.004  # and the most that it may move a block by, before the model counts as a misfit
_ROUNDING = 1e-7  # of the largest singular value, below which one is rounding of finite differences
_SURE = 0.999  # that a misfit is no chance: in sum, over blocks, and of three moduli
_SURE_AT_CONTACT = 0.9995  # the same of the one block about the contact point
_EDGE = 1e-6  # of its unit, within which a parameter is at its bound
_DEPTHS = 3  # from which the modulus is taken


@dataclass(frozen=True)
class Judgement:
    """What the residuals of a fit say."""

    adequate: bool
    moduli: tuple[float, float] | None
    """Smallest and largest Young's modulus over three depths, in Pa."""
    reasons: tuple[str, ...]
    """In words, why it is not adequate."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """One fitted model, in units of the noise."""

    problem: Regression
    x: FloatArray
    values: dict[str, float]
    """Of all parameters, those that are fixed and the linear ones included, in SI."""
    residuals: FloatArray
    jacobian: FloatArray
    """By the moved parameters, and then the linear ones."""
    counted: np.ndarray
    """Which of the residuals count."""
    at_bound: tuple[str, ...]
    """Parameters at the end of their range."""
    converged: bool
    """Whether the search ended by itself, and not after its last evaluation."""

    @property
    def model(self) -> Model:
        """Which was fitted."""
        return self.problem.model

    @property
    def setup(self) -> Setup:
        """The setup with the fitted values."""
        return setup_of(self.values, self.problem.data.setup)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the columns of the Jacobian."""
        return (*self.problem.free, *self.problem.linear)

    @property
    def misfit(self) -> float:
        """Root mean square of the residuals over the noise of the measurement."""
        return float(np.sqrt(self.residuals @ self.residuals / max(np.count_nonzero(self.counted), 1)))

    @cached_property
    def basis(self) -> FloatArray:
        """Orthonormal columns of what the parameters take up of the counted residuals."""
        columns = self.jacobian[self.counted]
        return orth(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), rcond=_ROUNDING)

    @cached_property
    def slow(self) -> tuple[float, float]:
        """Variance of the residuals, as large as it would be if they were independent, and its degrees of freedom."""
        variance, degrees = slow_noise(self.residuals[self.counted], self.basis)
        # The solver's own error and its bent valleys add to what a few low frequencies tell: there, at least of all.
        return max(variance, self.misfit**2 if self.model.name == "contact" else 0.0), degrees

    @property
    def depth(self) -> FloatArray:
        """Path from the fitted contact point on, in m, (n,)."""
        return self.problem.data.position - self.values["contact_point"]

    @property
    def pressed(self) -> np.ndarray:
        """Which points count and are in contact, (n,)."""
        return self.counted[: self.depth.size] & (self.depth > 0.0)

    def layer(self, count: int) -> np.ndarray:
        """In which of equal layers of the depth each point lies, from zero at the contact point, (n,)."""
        deepest = self.depth[self.pressed].max(initial=1e-300)
        return np.minimum(self.depth / deepest * count, count - 1).astype(int)

    @cached_property
    def blocks(self) -> np.ndarray:
        """Which points of the contact lie in which block of depth, on either way, and in which of a hold, (n, m)."""
        segments, number = self.problem.data.segments, np.arange(self.depth.size)
        pressed, block, ways = self.pressed, self.layer(_BLOCKS), (number > segments.top, number <= segments.top)
        hold = np.array_split(number[segments.top : segments.leaves + 1], 4)
        blocks = [pressed & way & (block == depth_block) for way in ways for depth_block in range(_BLOCKS)]
        return np.column_stack([*blocks, *(np.isin(number, quarter) for quarter in hold)])

    @cached_property
    def judgement(self) -> Judgement:
        """Whether the model describes the curve."""
        return judge(self)

    @property
    def independent(self) -> float:
        """How many independent points the residuals are worth, by the correlation of the baseline."""
        return max(float(np.count_nonzero(self.counted)) / self.problem.data.correlated, 10.0)

    def criterion(self, judge: Fitted) -> float:
        """Bayesian information criterion, for noise as strong and as correlated as the residuals of `judge`."""
        freedoms = len(self.names) + 4 * self.model.spans  # both ends of the contact are chosen, of many places
        count = judge.independent
        return float(count * np.log(self.misfit**2 + self.problem.data.exact**2) + freedoms * np.log(count))

    def intervals(self) -> tuple[dict[str, tuple[float, float]], dict[str, dict[str, float]]]:
        """95 % intervals of the parameters by the linearised problem, and their correlations.

        The intervals are widened for correlated residuals, and infinite for what the data do not constrain.
        """
        free, names = len(self.x), self.names
        length = np.linalg.norm(self.jacobian, axis=0)
        seen = length > np.where(np.arange(length.size) < free, 1e-9, 0.0)
        normal = self.jacobian[:, seen] / length[seen]
        values, vectors = np.linalg.eigh(normal.T @ normal)
        inverse = (vectors / np.maximum(values, 1e-14)) @ vectors.T
        covariance = self.slow[0] * inverse
        if self.model.name == "contact":  # the solver's own error is one within a block, and is not averaged there
            error = _ERROR_IN_A_BLOCK * self.problem.data.range * self.problem.weights
            moved = inverse @ normal[: error.size].T @ (error[:, None] * self.blocks)
            covariance += moved @ moved.T
        inner = np.sqrt(np.diag(covariance))
        spread, correlation = np.full(length.size, np.inf), np.eye(length.size)
        spread[seen] = float(stdtrit(self.slow[1], 0.5 + 0.5 * CONFIDENCE)) * inner / length[seen]
        correlation[np.ix_(seen, seen)] = covariance / np.outer(inner, inner)
        low, high = (self.problem.values(self.x + side * spread[:free]) for side in (-1.0, 1.0))
        floor = {name: half.low for name, half in self.problem.parameters.items() if half.scale == "linear"}
        intervals = {name: (max(low[name], floor.get(name, 0.0)), high[name]) for name in names[:free]}
        for name, half in zip(names[free:], spread[free:], strict=True):
            intervals[name] = (self.values[name] - half, self.values[name] + half)
        rows = zip(names, correlation.tolist(), strict=True)
        return intervals, {name: dict(zip(names, row, strict=True)) for name, row in rows}


def run(problem: Regression, x: FloatArray, evaluations: int = 60, closeness: float = 1e-8) -> Fitted:
    """Least squares from a point."""
    low, high = problem.bounds
    limits = {"max_nfev": evaluations, "ftol": closeness, "xtol": closeness, "gtol": 1e-12}
    x = np.clip(x, low + 1e-9, high - 1e-9)
    solution = least_squares(problem.residuals, x, problem.jacobian, bounds=(low, high), **limits)
    return fitted_at(problem, solution.x, solution.status > 0)


def fitted_at(problem: Regression, x: FloatArray, converged: bool) -> Fitted:
    """What a problem gives at a point. The tilt turns about the contact point: the offset is the force there."""
    problem.turn_tilt(x)
    problem.tension(x)  # raises where there is no contact
    residuals = problem.residuals(x)
    columns = np.zeros((residuals.size, len(problem.linear)))
    columns[: len(problem)] = problem.columns * problem.length * (problem.weights / problem.data.noise)[:, None]
    jacobian = np.column_stack([problem.derivatives(x), columns])
    low, high = problem.bounds
    at_bound = tuple(itertools.compress(problem.free, np.minimum(x - low, high - x) < _EDGE))
    coefficients = map(float, problem.coefficients / problem.length)
    values = problem.values(x) | dict(zip(problem.linear, coefficients, strict=True))
    counted = np.append(problem.weights > 0.0, np.ones(residuals.size - len(problem), dtype=bool))
    return Fitted(problem, x, values, residuals, jacobian, counted, at_bound, converged)


def judge(fitted: Fitted) -> Judgement:
    """Judge one fit."""
    data, counted, pressed = fitted.problem.data, fitted.counted[: len(fitted.problem)], fitted.pressed
    residuals = fitted.residuals[: len(fitted.problem)]
    blocks = fitted.blocks[:, np.count_nonzero(fitted.blocks & counted[:, None], axis=0) > 3]
    if np.count_nonzero(pressed) < 2 * _DEPTHS or not blocks.size:
        return Judgement(False, None, ("Fewer points in contact than a judgement needs.",))
    reasons = [] if fitted.converged else ["The search did not converge within its budget."]
    white = lfilter(data.whitener, 1.0, residuals)
    # In contact the noise may be louder than before it, such as that of the path. Points before it would lend a wrong
    # shape the room that loud noise needs there.
    louder = max(1.0, noise_of(white[pressed])) ** 2 - 1.0
    expected = 1.0 + louder * np.count_nonzero(pressed) / np.count_nonzero(counted)
    if np.mean(white[counted] ** 2) > expected * fdtri(np.count_nonzero(counted), data.quiet, _SURE):
        reasons.append(f"The residuals are {fitted.misfit:.3g} times the noise.")
    # A softer layer on top hides among all blocks, and bends the force most where the contact begins.
    begins = counted & (np.abs(fitted.depth) < fitted.depth[pressed].max() / _BLOCKS)
    moduli, by_third = _moduli(fitted)
    variance = max(1.0, noise_of(residuals[pressed])) ** 2 * data.correlated
    for reason, columns, sure in (
        ("The residuals change with depth by more than noise.", blocks, _SURE),
        ("The force about the contact point differs by more than noise.", begins[:, None], _SURE_AT_CONTACT),
        ("The modulus changes with depth by more than its errors.", by_third, _SURE),
    ):
        gain, count = _gain(fitted, columns)
        if count and gain / count > variance * fdtri(count, data.freedoms, sure):
            reasons.append(reason)
    return Judgement(not reasons, moduli, tuple(reasons))


def _gain(fitted: Fitted, columns: FloatArray) -> tuple[float, int]:
    """Sum of squares that further columns (n, m) take of the residuals, and how many of them are new."""
    late = np.zeros((fitted.residuals.size - columns.shape[0], columns.shape[1]))
    matrix = np.vstack([columns, late])[fitted.counted]
    matrix /= np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    left, sizes, _ = np.linalg.svd(matrix - fitted.basis @ (fitted.basis.T @ matrix), full_matrices=False)
    new = left[:, sizes > 1e-3]
    taken = np.abs(new.T @ fitted.residuals[fitted.counted])
    if fitted.model.name == "contact":
        error = _MOST_IN_A_BLOCK * fitted.problem.data.range
        taken = np.maximum(taken - error * np.sqrt(new.shape[0]) / 4.0, 0.0)
    return float(taken @ taken), int(new.shape[1])


def _moduli(fitted: Fitted) -> tuple[tuple[float, float] | None, FloatArray]:
    """Range of the modulus over thirds of the depth, and the derivatives by its values in all but the first, (n, 2)."""
    count = fitted.depth.size
    if "relaxed_modulus" not in fitted.problem.free:
        return None, np.zeros((count, 0))
    jacobian, number = fitted.jacobian[:count], fitted.problem.free.index("relaxed_modulus")
    third = fitted.layer(_DEPTHS)
    columns = [jacobian[:, number] * (fitted.pressed & (third == depth)) for depth in range(1, _DEPTHS)]
    by_third = np.column_stack(columns)
    both = np.column_stack([jacobian, by_third])
    length = np.maximum(np.linalg.norm(both, axis=0), 1e-300)
    change = np.linalg.lstsq(both / length, fitted.residuals[:count], rcond=1e-7)[0] / length
    factors = np.exp(np.clip(change[number] + np.append(0.0, change[1 - _DEPTHS :]), -3.0, 3.0))
    modulus = fitted.values["relaxed_modulus"]
    return (float(modulus * factors.min()), float(modulus * factors.max())), by_third
