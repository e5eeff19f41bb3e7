"""The residual blocks of M4 and M5.

Sources: the paper's appendix on layer definitions for `ResidualTCNBlock`; Vaswani et al. 2017, section 3.1, for
`EncoderBlock`.
"""

from __future__ import annotations

from typing import Any

import keras
from keras import ops


@keras.saving.register_keras_serializable(package="surrogate")
class ResidualTCNBlock(keras.layers.Layer):
    """Two dilated causal convolutions, each with layer normalisation, ReLU and dropout, beside a skip path.

    The skip path is the identity where the width stays and a pointwise convolution where it changes. A block reaches
    `2 (kernel_size - 1) dilation` steps back.

    Args:
        filters: Output channels.
        kernel_size: Points per convolution.
        dilation: Spacing of those points, in steps.
        dropout: Rate of the dropout after each activation.

    Call arguments: a 3D tensor of shape `(batch, steps, channels)`. Output: a 3D tensor of shape
    `(batch, steps, filters)`.
    """

    def __init__(
        self, filters: int, kernel_size: int = 3, dilation: int = 1, dropout: float = 0.1, **kwargs: Any
    ) -> None:
        super().__init__(**kwargs)
        self.filters = filters
        self.kernel_size = kernel_size
        self.dilation = dilation
        self.dropout = dropout

    def build(self, sequence_shape: tuple) -> None:
        """Create both stages and, where the width changes, the projection."""
        # One attribute a layer: Keras writes no weights of layers inside nested lists.
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

    def get_config(self) -> dict[str, Any]:
        """Return the constructor's arguments."""
        return {
            **super().get_config(),
            "filters": self.filters,
            "kernel_size": self.kernel_size,
            "dilation": self.dilation,
            "dropout": self.dropout,
        }


@keras.saving.register_keras_serializable(package="surrogate")
class EncoderBlock(keras.layers.Layer):
    """One transformer encoder block, normalised after each residual sum.

    Attention is full: every step attends to every step, so the block is not causal.

    Args:
        heads: Number of attention heads.
        key_dim: Width of each head's queries, keys and values.
        feed_forward: Width of the hidden layer between the two dense maps.

    Call arguments: a 3D tensor of shape `(batch, steps, features)`. Output: a 3D tensor of the same shape.
    """

    def __init__(self, heads: int = 4, key_dim: int = 128, feed_forward: int = 256, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.heads = heads
        self.key_dim = key_dim
        self.feed_forward = feed_forward

    def build(self, sequence_shape: tuple) -> None:
        """Create the attention, the two dense maps and both normalisations."""
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
        """Attend, then transform each step by itself."""
        attended = self.attention_normalisation(sequence + self._attend(sequence))
        return self.output_normalisation(attended + self.contract(self.expand(attended)))

    def _attend(self, sequence: Any) -> Any:
        """Return `self.attention(sequence, sequence)`, each head's products as one batch of matrices.

        Keras asks for them by einsum, and turning the operands to and fro takes TensorFlow a quarter of the training.
        """
        layer = self.attention
        projections = (layer.query_dense, layer.key_dense, layer.value_dense)
        query, key, value = (ops.transpose(dense(sequence), (0, 2, 1, 3)) for dense in projections)
        scores = ops.matmul(query * self.key_dim**-0.5, ops.transpose(key, (0, 1, 3, 2)))
        heads = ops.matmul(ops.softmax(scores), value)
        return layer.output_dense(ops.transpose(heads, (0, 2, 1, 3)))

    def compute_output_shape(self, sequence_shape: tuple) -> tuple:
        """Return the shape of the sequence."""
        return sequence_shape

    def get_config(self) -> dict[str, Any]:
        """Return the constructor's arguments."""
        return {
            **super().get_config(),
            "heads": self.heads,
            "key_dim": self.key_dim,
            "feed_forward": self.feed_forward,
        }
