"""One stage of a model of any linear solid: a quadratic polynomial of its features, and a dense network on them.

Standardised features z enter the polynomial and the network, whose outputs, times a scale, are added to it. NumPy
evaluates both: for one contact a session of ONNX Runtime would cost more than its multiplications.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import fields as dataclass_fields
from functools import cached_property

import numpy as np
from scipy.special import erf

from surrogate.data.fronts import Front
from surrogate.data.polynomial import Polynomial, products

_HALF = np.float32(np.sqrt(0.5))
_AT_ONCE = 5_000  # rows whose products are in memory at a time


@dataclass(frozen=True)
class Stage:
    """A polynomial and a network.

    Args:
        polynomial: Of the features.
        kernels: Weights of the layers, float32, from all inputs to all outputs.
        biases: Their biases; all layers but the last are followed by GELU.
        fronts: What is added to some of the outputs.
    """

    polynomial: Polynomial
    kernels: Sequence[np.ndarray]
    biases: Sequence[np.ndarray]
    fronts: Sequence[Front] = ()

    def __call__(self, features: np.ndarray, places: Sequence[tuple[slice, np.ndarray]] = ()) -> np.ndarray:
        """Targets (batch, m) of features (batch, n), and of steps and `surrogate.data.fronts.places` of each front."""
        rows = [slice(at, at + _AT_ONCE) for at in range(0, len(features), _AT_ONCE)]
        parts = [self._part(features[part], [(steps, place[part]) for steps, place in places]) for part in rows]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    @cached_property
    def _coefficients(self) -> list[np.ndarray]:
        """The constant, linear and quadratic coefficients, float32."""
        size = len(self.polynomial.mean)
        return np.split(self.polynomial.coefficients.astype(np.float32), [1, 1 + size])

    def _part(self, features: np.ndarray, places: Sequence[tuple[slice, np.ndarray]]) -> np.ndarray:
        polynomial = self.polynomial
        z = polynomial.standardised(features)
        constant, linear, quadratic = self._coefficients
        value = z @ linear + products(z) @ quadratic + constant
        hidden = z
        for kernel, bias in zip(self.kernels[:-1], self.biases[:-1], strict=True):
            hidden = hidden @ kernel + bias
            hidden *= np.float32(0.5) * (np.float32(1.0) + erf(hidden * _HALF))
        left = hidden @ self.kernels[-1] + self.biases[-1]
        for front, (steps, place) in zip(self.fronts, places, strict=True):
            left[:, steps] += front(hidden, place)
        return value + (left * polynomial.scale + polynomial.offset)

    def as_arrays(self, name: str) -> dict[str, np.ndarray]:
        """What to store, under names that begin with that of the stage; `of_arrays` is the inverse."""
        arrays = {f"{name}/{key}": values for key, values in vars(self.polynomial).items()}
        arrays[f"{name}/coefficients"] = self.polynomial.coefficients.astype(np.float32)
        for number, layer in enumerate(zip(self.kernels, self.biases, strict=True)):
            arrays |= zip((f"{name}/kernel_{number}", f"{name}/bias_{number}"), layer, strict=True)
        for number, front in enumerate(self.fronts):
            arrays |= front.as_arrays(f"{name}/front_{number}")
        return arrays

    @classmethod
    def of_arrays(cls, arrays: dict[str, np.ndarray], name: str) -> Stage:
        """The inverse of `as_arrays`."""
        own = {key.partition("/")[2]: values for key, values in arrays.items() if key.startswith(f"{name}/")}
        layers = range(sum(key.startswith("kernel_") for key in own))
        fronts = range(sum(key.startswith("front_") and key.endswith("/place") for key in own))
        weights = [field.name for field in dataclass_fields(Front)]
        return cls(
            Polynomial.of_arrays(own),
            [own[f"kernel_{number}"] for number in layers],
            [own[f"bias_{number}"] for number in layers],
            [Front(*(own[f"front_{number}/{weight}"] for weight in weights)) for number in fronts],
        )
