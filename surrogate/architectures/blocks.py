"""The residual blocks of M4 and M5.

Sources: for `ResidualTCNBlock` the paper's appendix "Neural Network Layer Definitions", section "Temporal
Convolutional Network (TCN) block"; for `EncoderBlock` Vaswani et al. 2017, section 3.1.
"""

from __future__ import annotations

from typing import Any

import keras
from keras import ops

from surrogate.architectures.layers import Layer


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
