"""Small validators whose messages name the quantity, what is allowed and what was received."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from numbers import Real
from operator import ge, gt, le, lt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bem._support.wording import shown

FloatArray = NDArray[np.float64]
_TRUTH = (bool, np.bool_)
_LARGEST_WHOLE_NUMBER = 2**63 - 1


class Valued:
    """Equality and hash of a frozen dataclass by the values of its fields, some of which are arrays."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(np.array_equal(mine, vars(other)[name]) for name, mine in vars(self).items())

    def __hash__(self) -> int:
        return hash(tuple(field.tobytes() if isinstance(field, np.ndarray) else field for field in vars(self).values()))


def finite_number(
    name: str,
    value: Any,
    *,
    low: float | None = None,
    high: float | None = None,
    above: float | None = None,
    below: float | None = None,
) -> float:
    """Return `value` as a float when it is a finite real number within bounds.

    Args:
        name: the quantity, as the user wrote it.
        value: what the user gave; booleans and strings are refused.
        low, high: inclusive bounds.
        above, below: exclusive bounds.

    Raises:
        ValueError: naming the quantity, the allowed range and the value received.
    """
    try:
        number = float(value) if isinstance(value, Real) and not isinstance(value, _TRUTH) else math.nan
    except OverflowError:
        number = math.inf
    bounds = (("greater than", above, gt), ("at least", low, ge), ("less than", below, lt), ("at most", high, le))
    limits = [(relation, limit, holds) for relation, limit, holds in bounds if limit is not None]
    if not math.isfinite(number) or any(not holds(number, limit) for _, limit, holds in limits):
        allowed = " and ".join(f"{relation} {limit:g}" for relation, limit, _ in limits)
        raise ValueError(f"{name} must be a finite number{' ' if allowed else ''}{allowed}; received {shown(value)}")
    return number


@contextmanager
def collected(mistakes: list[str]) -> Iterator[None]:
    """Add the sentence of a `ValueError` to `mistakes`, of which one message then names all."""
    try:
        yield
    except ValueError as error:
        mistakes.append(str(error))


def instance(name: str, value: Any, allowed: tuple[type, ...]) -> Any:
    """Return `value` when it is an instance of one of `allowed`, else raise a `ValueError` naming them."""
    if not isinstance(value, allowed):
        names = ", ".join(f"{cls.__name__}(...)" for cls in allowed)
        raise ValueError(f"{name} must be one of {names}; received {shown(value)}")
    return value


def real_array(name: str, values: ArrayLike) -> FloatArray:
    """Return `values` as float64 of any shape, NaN and infinity included.

    Raises:
        ValueError: complex numbers, text, or rows of unequal length.
    """
    try:
        array = np.asarray(values)
        if array.dtype.kind in "biuf":
            return array.astype(np.float64, copy=False)
        # Decimals and fractions, or `None`, which is NaN.
        if array.dtype.kind == "O" and not any(isinstance(value, str | bytes) for value in array.flat):
            return array.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError(f"{name} must be real numbers; received {shown(values)}")


def finite_vector(name: str, values: ArrayLike, *, at_least: int = 0) -> FloatArray:
    """Return a read-only float64 copy of shape (n,) of finite `values`, n >= `at_least`.

    Raises:
        ValueError: naming the quantity, what is allowed and what was received.
    """
    try:
        vector = real_array(name, values).copy()
    except ValueError:
        vector = np.array(np.nan)
    if vector.ndim != 1 or len(vector) < at_least or not np.all(np.isfinite(vector)):
        count = f"at least {at_least} " if at_least else ""
        raise ValueError(
            f"{name} must be a one-dimensional sequence of {count}finite numbers; received {shown(values)}"
        )
    vector.setflags(write=False)
    return vector


def strictly_increasing(name: str, values: FloatArray) -> FloatArray:
    """Return `values` when each is larger than the one before, else raise a `ValueError` that shows where it is not."""
    offences = np.flatnonzero(np.diff(values) <= 0.0)
    if offences.size:
        i = int(offences[0])
        raise ValueError(
            f"{name} must be strictly increasing; received {float(values[i])!r} followed by {float(values[i + 1])!r}"
        )
    return values


def whole_number(name: str, value: Any, *, low: int, high: int = _LARGEST_WHOLE_NUMBER) -> int:
    """Return `value` as an int when it is a whole number within bounds.

    Raises:
        ValueError: naming the quantity, the allowed range and the value received.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not low <= value <= high:
        raise ValueError(f"{name} must be a whole number from {low} to {high}; received {shown(value)}")
    return int(value)
