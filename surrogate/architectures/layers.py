"""Layers for the conditioning on the Tabor parameter (a channel, FiLM or a gate), and the residual blocks of M4 and M5.

Sources: the paper's appendices "Tabor-Conditioning Mechanisms" and "Neural Network Layer Definitions", section
"Temporal Convolutional Network (TCN) block"; for `EncoderBlock` Vaswani et al. 2017, section 3.1. `ChosenSteps` is not
the paper's; `fast` begins with it.

The layers are registered with Keras under the package name `surrogate` and define `get_config`, so that Keras can
serialise models. Weights files store their sublayers under readable names.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import keras
from keras import ops


class Layer(keras.layers.Layer):
    """A layer whose output has the shape of its first input, and whose own arguments are attributes of their names."""

    arguments: tuple[str, ...] = ()

    def compute_output_shape(self, first_shape: tuple) -> tuple:
        """Return the shape of the first input."""
        return first_shape

    def get_config(self) -> dict[str, Any]:
        """Return the constructor's arguments."""
        return {**super().get_config(), **{name: getattr(self, name) for name in self.arguments}}


@keras.saving.register_keras_serializable(package="surrogate")
class AppendTabor(Layer):
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
class FiLM(Layer):
    """Feature-wise linear modulation: scale and shift every feature by functions of the Tabor parameter.

    A dense layer with ReLU maps the scaled Tabor parameter to a context. Two dense layers map the context to the scale
    and the shift, which are the same at every step. The bias of the scale is initialised to one.

    Args:
        hidden: Number of units of the context.

    Call arguments: a 3D tensor of shape `(batch, steps, features)` and a 2D tensor of shape `(batch, 1)`. Output: a 3D
    tensor of the first argument's shape.
    """

    arguments = ("hidden",)

    def __init__(self, hidden: int = 64, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.hidden = hidden

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
class TaborGate(Layer):
    """Convex combination of two representations; a dense network with softmax maps the Tabor parameter to its weights.

    Args:
        hidden: Number of units of the hidden layer. The paper does not state it; 96 gives its parameter counts.

    Call arguments: two 3D tensors of shape `(batch, steps, features)` and a 2D tensor of shape `(batch, 1)`. Output: a
    3D tensor of shape `(batch, steps, features)`.
    """

    arguments = ("hidden",)

    def __init__(self, hidden: int = 96, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.hidden = hidden

    def build(self, first_shape: tuple, second_shape: tuple, tabor_shape: tuple) -> None:
        """Create the two dense layers."""
        if first_shape[-1] != second_shape[-1]:
            raise ValueError(
                f"Expected two representations of the same width. Received: {first_shape[-1]} and {second_shape[-1]}"
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


@keras.saving.register_keras_serializable(package="surrogate")
class ChosenSteps(Layer):
    """The channels of a history at some of its steps, side by side.

    Args:
        steps: Numbers of these steps.

    Call argument: a 3D tensor of shape `(batch, steps, channels)`. Output: a 2D tensor of shape `(batch, chosen steps *
    channels)`.
    """

    arguments = ("steps",)

    def __init__(self, steps: Sequence[int], **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.steps = [int(one) for one in steps]

    def call(self, sequence: Any) -> Any:
        """Choose the steps."""
        chosen = ops.take(sequence, self.steps, axis=1)
        return ops.reshape(chosen, (-1, len(self.steps) * sequence.shape[-1]))

    def compute_output_shape(self, sequence_shape: tuple) -> tuple:
        """Return the shape of all chosen channels side by side."""
        return (sequence_shape[0], len(self.steps) * sequence_shape[-1])


@keras.saving.register_keras_serializable(package="surrogate")
class ResidualTCNBlock(Layer):
    """Two dilated causal convolutions, each with layer normalisation, ReLU and dropout, and a skip path.

    The skip path is the identity if the number of channels stays the same, and a pointwise convolution if it changes.
    The output depends on the `2 (kernel_size - 1) dilation` previous steps.

    Args:
        filters: Number of output channels.
        kernel_size: Number of points of each convolution.
        dilation: Distance between these points, in steps.
        dropout: Dropout rate after each activation.

    Call arguments: a 3D tensor of shape `(batch, steps, channels)`. Output: a 3D tensor of shape
    `(batch, steps, filters)`.
    """

    arguments = ("filters", "kernel_size", "dilation", "dropout")

    def __init__(
        self, filters: int, kernel_size: int = 3, dilation: int = 1, dropout: float = 0.1, **kwargs: Any
    ) -> None:
        super().__init__(**kwargs)
        self.filters = filters
        self.kernel_size = kernel_size
        self.dilation = dilation
        self.dropout = dropout

    def build(self, sequence_shape: tuple) -> None:
        """Create both stages and, if the number of channels changes, the projection."""
        # One attribute per layer, because Keras saves no weights of layers inside nested lists.
        hidden_shape = (*sequence_shape[:-1], self.filters)
        self.first_convolution = self._convolution("first_convolution", sequence_shape)
        self.first_normalisation = keras.layers.LayerNormalization(name="first_normalisation")
        self.first_dropout = keras.layers.Dropout(self.dropout, name="first_dropout")
        self.second_convolution = self._convolution("second_convolution", hidden_shape)
        self.second_normalisation = keras.layers.LayerNormalization(name="second_normalisation")
        self.second_dropout = keras.layers.Dropout(self.dropout, name="second_dropout")
        self.first_normalisation.build(hidden_shape)
        self.second_normalisation.build(hidden_shape)
        self.projection = None
        if sequence_shape[-1] != self.filters:
            self.projection = keras.layers.Conv1D(self.filters, 1, name="projection")
            self.projection.build(sequence_shape)
        self.built = True

    def call(self, sequence: Any, training: bool | None = None) -> Any:
        """Apply both stages and add the skip path."""
        hidden = ops.relu(self.first_normalisation(self.first_convolution(sequence)))
        hidden = self.first_dropout(hidden, training=training)
        hidden = ops.relu(self.second_normalisation(self.second_convolution(hidden)))
        hidden = self.second_dropout(hidden, training=training)
        return hidden + (sequence if self.projection is None else self.projection(sequence))

    def _convolution(self, name: str, shape: tuple) -> keras.layers.Layer:
        convolution = keras.layers.Conv1D(
            self.filters, self.kernel_size, padding="causal", dilation_rate=self.dilation, name=name
        )
        convolution.build(shape)
        return convolution

    def compute_output_shape(self, sequence_shape: tuple) -> tuple:
        """Return the sequence's shape with `filters` channels."""
        return (*sequence_shape[:-1], self.filters)


@keras.saving.register_keras_serializable(package="surrogate")
class EncoderBlock(Layer):
    """Transformer encoder block with layer normalisation after each residual sum.

    Each step attends to all steps, so the block is not causal.

    Args:
        heads: Number of attention heads.
        key_dim: Size of the queries, keys and values of each head.
        feed_forward: Number of units of the first of the two dense layers.

    Call arguments: a 3D tensor of shape `(batch, steps, features)`. Output: a 3D tensor of the same shape.
    """

    arguments = ("heads", "key_dim", "feed_forward")

    def __init__(self, heads: int = 4, key_dim: int = 128, feed_forward: int = 256, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.heads = heads
        self.key_dim = key_dim
        self.feed_forward = feed_forward

    def build(self, sequence_shape: tuple) -> None:
        """Create the attention, the two dense layers and both normalisations."""
        width = sequence_shape[-1]
        self.attention = keras.layers.MultiHeadAttention(self.heads, self.key_dim, name="attention")
        self.attention_normalisation = keras.layers.LayerNormalization(name="attention_normalisation")
        self.expand = keras.layers.Dense(self.feed_forward, activation="relu", name="expand")
        self.contract = keras.layers.Dense(width, name="contract")
        self.output_normalisation = keras.layers.LayerNormalization(name="output_normalisation")
        self.attention.build(sequence_shape, sequence_shape)
        for layer in (self.attention_normalisation, self.expand, self.output_normalisation):
            layer.build(sequence_shape)
        self.contract.build((*sequence_shape[:-1], self.feed_forward))
        self.built = True

    def call(self, sequence: Any) -> Any:
        """Apply the attention, then the dense layers to each step."""
        attended = self.attention_normalisation(sequence + self._attend(sequence))
        return self.output_normalisation(attended + self.contract(self.expand(attended)))

    def _attend(self, sequence: Any) -> Any:
        """Return `self.attention(sequence, sequence)`, computed as a batch of matrix products for each head.

        Keras uses einsum, whose transpositions take a quarter of the training time under TensorFlow.
        """
        layer = self.attention
        projections = (layer.query_dense, layer.key_dense, layer.value_dense)
        query, key, value = (ops.transpose(dense(sequence), (0, 2, 1, 3)) for dense in projections)
        scores = ops.matmul(query * self.key_dim**-0.5, ops.transpose(key, (0, 1, 3, 2)))
        heads = ops.matmul(ops.softmax(scores), value)
        return layer.output_dense(ops.transpose(heads, (0, 2, 1, 3)))
