"""The graph of one stage of a model of any linear solid: a quadratic polynomial of its features, and a network.

Input `features`, float64 of shape `(batch, n)`; output `targets`, float64 of shape `(batch, m)`. Standardised features
z enter a polynomial of second degree and a network of dense layers, whose outputs, times a scale, are added to it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from onnx import TensorProto

from surrogate.data.polynomial import Polynomial
from surrogate.onnx.file import checked_content
from surrogate.onnx.graph import OnnxGraph
from surrogate.onnx.keras_layers import add_network

if TYPE_CHECKING:
    import keras


def stage_content(polynomial: Polynomial, model: keras.Model, name: str) -> bytes:
    """Return the ONNX file of a stage; the model's inputs are all features but the first, and then the first."""
    graph, size = OnnxGraph(), len(polynomial.mean)
    z = (graph.named("features") - polynomial.mean) / polynomial.deviation
    first, second = np.triu_indices(size)
    coefficients = polynomial.coefficients
    products = z.pick(*first.tolist()) * z.pick(*second.tolist())
    value = z @ coefficients[1 : 1 + size] + products @ coefficients[1 + size :] + coefficients[0]
    sequence = z.pick(*range(1, size), 0).cast(TensorProto.FLOAT).expand(1)
    network = add_network(model, sequence).cast(TensorProto.DOUBLE).squeeze(1)
    value.to("Add", network * polynomial.scale + polynomial.offset, output="targets")
    inputs, outputs = {"features": ["batch", size]}, {"targets": ["batch", coefficients.shape[1]]}
    return checked_content(graph.finish(name, inputs, outputs))
