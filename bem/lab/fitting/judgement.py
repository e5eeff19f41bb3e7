"""Whether a model describes a curve: in sum, over depth in blocks, where contact begins, and at three depths.

The noise is that of the baseline, as correlated as the baseline is, so that a misfit does not count as noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from scipy.special import fdtri

from bem._support.validation import FloatArray
from bem.lab.contact_point import noise_of
from bem.lab.fitting.regression import BLOCKS, Fitted

_SURE = 0.999  # that a misfit is no chance: in sum, over blocks, and of three moduli
_SURE_AT_CONTACT = 0.9995  # the same of the one block about the contact point
_DEPTHS = 3  # from which the modulus is taken
_SOLVED = 0.004  # of the range of the force, by which the solver's own error may move a block


@dataclass(frozen=True)
class Judgement:
    """What the residuals of a fit say."""

    adequate: bool
    moduli: tuple[float, float] | None
    """Smallest and largest Young's modulus over three depths, in Pa."""
    reasons: tuple[str, ...]
    """In words, why it is not adequate."""


def judge(fitted: Fitted) -> Judgement:
    """Judge one fit."""
    data, counted = fitted.problem.data, fitted.counted[: len(fitted.problem)]
    residuals = fitted.residuals[: len(fitted.problem)]
    depth = data.position - fitted.values["contact_point"]
    pressed = counted & (depth > 0.0)
    if np.count_nonzero(pressed) < 2 * _DEPTHS:
        return Judgement(False, None, ("Fewer points in contact than a judgement needs.",))
    # In contact the noise may be louder than before it, such as that of the path.
    loud = max(1.0, noise_of(residuals[pressed])) ** 2
    reasons = [] if fitted.converged else ["The search did not converge within its budget."]
    white = lfilter(data.whitener, 1.0, residuals)
    # Only in contact: points before it would else lend a wrong shape the room that loud noise would need there.
    louder = max(1.0, noise_of(white[pressed])) ** 2 - 1.0
    expected = 1.0 + louder * np.count_nonzero(pressed) / np.count_nonzero(counted)
    if np.mean(white[counted] ** 2) > expected * fdtri(np.count_nonzero(counted), data.quiet, _SURE):
        reasons.append(f"The residuals are {fitted.misfit:.3g} times the noise.")
    blocks = fitted.blocks[:, np.count_nonzero(fitted.blocks & counted[:, None], axis=0) > 3]
    if not blocks.size:
        return Judgement(False, None, ("Fewer points in contact than a judgement needs.",))
    gain, count = _gain(fitted, blocks)
    variance = loud * data.correlated
    if count and gain / count > variance * fdtri(count, data.freedoms, _SURE):
        reasons.append("The residuals change with depth by more than noise.")
    # A softer layer on top hides among all blocks, and bends the force most where the contact begins.
    begins = counted & (np.abs(depth) < depth[pressed].max() / BLOCKS)
    gain, count = _gain(fitted, begins[:, None])
    if count and gain > variance * fdtri(1, data.freedoms, _SURE_AT_CONTACT):
        reasons.append("The force about the contact point differs by more than noise.")
    moduli, gain, count = _moduli(fitted, depth, pressed)
    if count and gain / count > variance * fdtri(count, data.freedoms, _SURE):
        reasons.append("The modulus changes with depth by more than its errors.")
    return Judgement(not reasons, moduli, tuple(reasons))


def _gain(fitted: Fitted, columns: FloatArray) -> tuple[float, int]:
    """Sum of squares that further columns (n, m) take of the residuals, and how many of them are new."""
    matrix = np.zeros((fitted.residuals.size, columns.shape[1]))
    matrix[: columns.shape[0]] = columns * (fitted.problem.weights > 0.0)[:, None]
    matrix, basis, residuals = matrix[fitted.counted], fitted.basis, fitted.residuals[fitted.counted]
    matrix /= np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    left, sizes, _ = np.linalg.svd(matrix - basis @ (basis.T @ matrix), full_matrices=False)
    new = left[:, sizes > 1e-3]
    taken = np.abs(new.T @ residuals)
    if fitted.model.name == "contact":
        range_ = float(np.ptp(fitted.problem.data.tension)) / fitted.problem.data.noise
        taken = np.maximum(taken - _SOLVED * range_ * np.sqrt(new.shape[0]) / 4.0, 0.0)
    return float(taken @ taken), int(new.shape[1])


def _moduli(fitted: Fitted, depth: FloatArray, pressed: np.ndarray) -> tuple[tuple[float, float] | None, float, int]:
    """Range of the modulus over thirds of the depth, and what sum of squares one of its own for each third takes."""
    if "relaxed_modulus" not in fitted.problem.free:
        return None, 0.0, 0
    by_modulus = fitted.jacobian[: depth.size, fitted.problem.free.index("relaxed_modulus")]
    third = np.minimum(depth / depth[pressed].max() * _DEPTHS, _DEPTHS - 1).astype(int)
    columns = np.column_stack([by_modulus * (pressed & (third == number)) for number in range(1, _DEPTHS)])
    gain, count = _gain(fitted, columns)
    both = np.column_stack([fitted.jacobian[: depth.size], columns])
    length = np.maximum(np.linalg.norm(both, axis=0), 1e-300)
    change = np.linalg.lstsq(both / length, fitted.residuals[: depth.size], rcond=1e-7)[0] / length
    first = change[fitted.problem.free.index("relaxed_modulus")]
    factors = np.exp(np.clip(first + np.append(0.0, change[1 - _DEPTHS :]), -3.0, 3.0))
    modulus = fitted.values["relaxed_modulus"]
    return (float(modulus * factors.min()), float(modulus * factors.max())), gain, count
