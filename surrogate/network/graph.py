"""A trained network as a graph of elementary operations with named weights.

`surrogate.network.lowering` makes the graph of a Keras model out of eleven kinds of operation. The ONNX exporter
(`surrogate.export`) and the streaming kernels (`surrogate.network.kernels`) implement these kinds and need no Keras.

==============  ============================================  =====================================================
kind            weights                                       result
==============  ============================================  =====================================================
``append``                                                    the sequence with the Tabor parameter as last channel
``dense``       ``kernel`` (in, out), ``bias``                an affine map at every step
``lstm``        ``W`` (1, 4H, in), ``R`` (1, 4H, H), ``B``    hidden states; gates in ONNX order: i, o, f, c
``normalise``   ``gamma``, ``beta``                           layer normalisation; option ``epsilon``
``convolve``    ``kernel`` (out, in, points), ``bias``        a causal convolution; option ``dilation``
``relu``                                                      the positive part
``softmax``                                                   a softmax over the last axis
``add``                                                       a sum of two
``modulate``                                                  first times second plus third, the same at all steps
``mix``                                                       two sequences weighted by a pair of numbers
``attend``      ``kernel_q`` .. ``bias_out``                  full self-attention; options ``heads``, ``key_dim``
==============  ============================================  =====================================================
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

SEQUENCE, TABOR = "sequence", "tabor"


@dataclass(frozen=True)
class Operation:
    """One elementary operation.

    Args:
        kind: One of the kinds of the module's table.
        name: Its result's name; weights are called `name/weight`.
        inputs: Names of the results it takes.
        options: What the kind needs besides.
    """

    kind: str
    name: str
    inputs: tuple[str, ...]
    options: dict[str, float] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return asdict(self)

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> Operation:
        """Return what `as_dict` described."""
        return cls(content["kind"], content["name"], tuple(content["inputs"]), dict(content["options"]))


@dataclass
class Graph:
    """Operations in the order of their evaluation, from `SEQUENCE` and `TABOR` to the last one's result.

    Args:
        operations: What is computed.
        weights: Arrays by name, float32.
    """

    operations: list[Operation] = field(default_factory=list)
    weights: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def output(self) -> str:
        """Name of the result, the scaled force of shape `(batch, steps, 1)`."""
        return self.operations[-1].name

    def add(
        self, kind: str, name: str, inputs: list[str], weights: dict[str, Any] | None = None, **options: Any
    ) -> str:
        """Append an operation and return its name."""
        self.operations.append(Operation(kind, name, tuple(inputs), options))
        for key, values in (weights or {}).items():
            self.weights[f"{name}/{key}"] = np.ascontiguousarray(values, dtype=np.float32)
        return name
