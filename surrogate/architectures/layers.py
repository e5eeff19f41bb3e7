"""Layers for the conditioning on the Tabor parameter: a channel, FiLM, or a gate between two representations.

Source: the paper's appendix "Tabor-Conditioning Mechanisms".

These layers are registered with Keras under the package name `surrogate` and define `get_config`, so that Keras can
serialise models. Weights files store their sublayers under readable names.
"""

from __future__ import annotations

from typing import Any

import keras
from keras import ops


class Conditioning(keras.layers.Layer):
    """A layer that maps the Tabor parameter to a context of `hidden` units; its output has its first input's shape."""

    def __init__(self, hidden: int, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.hidden = hidden

    def compute_output_shape(self, first_shape: tuple) -> tuple:
        """Return the shape of the first input."""
        return first_shape

    def get_config(self) -> dict[str, Any]:
        """Return the constructor's arguments."""
        return {**super().get_config(), "hidden": self.hidden}


@keras.saving.register_keras_serializable(package="surrogate")
class AppendTabor(keras.layers.Layer):
    """Repeat the scaled Tabor parameter over the steps, and append it as the last channel.

    Call arguments: a 3D tensor of shape `(batch, steps, channels)` and a 2D tensor of shape `(batch, 1)`. Output: a 3D
    tensor of shape `(batch, steps, channels + 1)`.
    """

    def call(self, sequence: Any, tabor: Any) -> Any:
        """Append the channel."""
        repeated = ops.zeros_like(sequence[:, :, :1]) + ops.expand_dims(tabor, axis=1)
        return ops.concatenate([sequence, repeated], axis=-1)

    def compute_output_shape(self, sequence_shape: tuple) -> tuple:
        """Return the shape of the sequence with one more channel."""
        return (*sequence_shape[:-1], sequence_shape[-1] + 1)


@keras.saving.register_keras_serializable(package="surrogate")
class FiLM(Conditioning):
    """Feature-wise linear modulation: scale and shift every feature by functions of the Tabor parameter.

    A dense layer with ReLU maps the scaled Tabor parameter to a context. Two dense layers map the context to the scale
    and the shift, which are the same at every step. The bias of the scale is initialised to one.

    Args:
        hidden: Number of units of the context.

    Call arguments: a 3D tensor of shape `(batch, steps, features)` and a 2D tensor of shape `(batch, 1)`. Output: a 3D
    tensor of the first argument's shape.
    """

    def __init__(self, hidden: int = 64, **kwargs: Any) -> None:
        super().__init__(hidden, **kwargs)

    def build(self, sequence_shape: tuple, tabor_shape: tuple) -> None:
        """Create the three dense layers."""
        width = sequence_shape[-1]
        self.context = keras.layers.Dense(self.hidden, activation="relu", name="context")
        self.scale = keras.layers.Dense(width, bias_initializer="ones", name="scale")
        self.shift = keras.layers.Dense(width, name="shift")
        self.context.build(tabor_shape)
        for layer in (self.scale, self.shift):
            layer.build((tabor_shape[0], self.hidden))
        self.built = True

    def call(self, sequence: Any, tabor: Any) -> Any:
        """Modulate the sequence."""
        context = self.context(tabor)
        scale = ops.expand_dims(self.scale(context), axis=1)
        shift = ops.expand_dims(self.shift(context), axis=1)
        return scale * sequence + shift


@keras.saving.register_keras_serializable(package="surrogate")
class TaborGate(Conditioning):
    """Convex combination of two representations; a dense network with softmax maps the Tabor parameter to its weights.

    Args:
        hidden: Number of units of the hidden layer. The paper does not state it; 96 gives its parameter counts.

    Call arguments: two 3D tensors of shape `(batch, steps, features)` and a 2D tensor of shape `(batch, 1)`. Output: a
    3D tensor of shape `(batch, steps, features)`.
    """

    def __init__(self, hidden: int = 96, **kwargs: Any) -> None:
        super().__init__(hidden, **kwargs)

    def build(self, first_shape: tuple, second_shape: tuple, tabor_shape: tuple) -> None:
        """Create the two dense layers."""
        if first_shape[-1] != second_shape[-1]:
            raise ValueError(
                f"both representations must have one width; received {first_shape[-1]} and {second_shape[-1]}"
            )
        self.context = keras.layers.Dense(self.hidden, activation="relu", name="context")
        self.weighting = keras.layers.Dense(2, activation="softmax", name="weighting")
        self.context.build(tabor_shape)
        self.weighting.build((tabor_shape[0], self.hidden))
        self.built = True

    def call(self, first: Any, second: Any, tabor: Any) -> Any:
        """Combine the two representations."""
        weights = ops.expand_dims(self.weighting(self.context(tabor)), axis=1)
        return weights[:, :, :1] * first + weights[:, :, 1:] * second
