"""Quadratic polynomials of standardised features, to which a network adds what they leave."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache

import numpy as np

_AT_ONCE = 5_000  # rows whose products are in memory at a time
_MANY = 16  # rows from which on products of whole columns are faster than gathered ones
_RIDGE = 1e-4


@cache
def pairs(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Both factors of all products of two of `count` features, in the order of `numpy.triu_indices`."""
    first, second = np.triu_indices(count)
    return first, second


def products(z: np.ndarray) -> np.ndarray:
    """All products of two of the columns of an array (batch, n), in the order of `numpy.triu_indices`."""
    first, second = pairs(z.shape[1])
    if len(z) < _MANY:
        return z[:, first] * z[:, second]
    values, at = np.empty((len(z), len(first)), z.dtype), 0
    for column in range(z.shape[1]):
        size = z.shape[1] - column
        np.multiply(z[:, column : column + 1], z[:, column:], out=values[:, at : at + size])
        at += size
    return values


@dataclass(frozen=True)
class Polynomial:
    """A polynomial of second degree in standardised features.

    Args:
        mean, deviation: Of the features, each of shape (n,).
        coefficients: Of the constant, the features, and their products in the order of `numpy.triu_indices`, shape
            (1 + n + n (n + 1) / 2, m).
        offset, scale: Of what the polynomial leaves, each of shape (m,).
    """

    mean: np.ndarray
    deviation: np.ndarray
    coefficients: np.ndarray
    offset: np.ndarray
    scale: np.ndarray

    @classmethod
    def fit(cls, features: np.ndarray, targets: np.ndarray) -> Polynomial:
        """Fit targets (batch, m) to features (batch, n) by least squares, with a weak ridge."""
        mean, deviation = features.mean(axis=0), features.std(axis=0) + 1e-9
        size = features.shape[1]
        terms = 1 + size + size * (size + 1) // 2
        own = cls(mean, deviation, np.zeros((terms, targets.shape[1])), np.zeros(1), np.ones(1))
        normal, right = _RIDGE * len(features) * np.eye(terms), np.zeros((terms, targets.shape[1]))
        for first in range(0, len(features), _AT_ONCE):
            rows = slice(first, first + _AT_ONCE)
            products = own._terms(features[rows])
            normal += products.T @ products
            right += products.T @ targets[rows]
        own = cls(mean, deviation, np.linalg.solve(normal, right), np.zeros(1), np.ones(1))
        rest = targets - own(features)
        # Outputs that hardly vary would otherwise weigh as much as those that do.
        return cls(mean, deviation, own.coefficients, rest.mean(axis=0), rest.std(axis=0) + 0.02 * rest.std())

    @classmethod
    def of_arrays(cls, arrays: dict[str, np.ndarray]) -> Polynomial:
        """The polynomial whose fields are among these arrays, by name."""
        return cls(*(arrays[field.name] for field in fields(cls)))

    def __call__(self, features: np.ndarray) -> np.ndarray:
        """The polynomial, shape (batch, m), without the network."""
        constant, linear, quadratic = np.split(self.coefficients, [1, 1 + len(self.mean)])
        parts = []
        for at in range(0, len(features), _AT_ONCE):
            z = (features[at : at + _AT_ONCE] - self.mean) / self.deviation
            parts.append(z @ linear + products(z) @ quadratic + constant)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def standardised(self, features: np.ndarray) -> np.ndarray:
        """The features that the network reads, float32."""
        return ((features - self.mean) / self.deviation).astype(np.float32)

    def left(self, features: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """What the network is to learn, float32 of shape (batch, m)."""
        return ((targets - self(features) - self.offset) / self.scale).astype(np.float32)

    def _terms(self, features: np.ndarray) -> np.ndarray:
        z = (features - self.mean) / self.deviation
        return np.column_stack([np.ones(len(z)), z, products(z)])
