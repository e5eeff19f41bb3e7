"""PyTorch's own LSTM for training under that backend, where Keras steps through the sequence in Python.

The operator is fused on a processor (oneDNN) and on a GPU (cuDNN) alike, and computes what `keras.layers.LSTM` does up
to rounding, from the same weights: its four gates stand in Keras's order, its matrices transposed. Models are built
and published with Keras's layer; only the copy that is trained holds this one.
"""

from __future__ import annotations

from typing import Any

import keras
import torch
from keras import ops


class TorchLSTM(keras.layers.LSTM):
    """`keras.layers.LSTM` computed by `torch.lstm`: forwards in time, of tanh and sigmoid, without dropout or mask."""

    def inner_loop(self, sequences: Any, initial_state: list, mask: Any, training: bool = False) -> tuple:
        """Return the last output, the outputs of shape `(batch, steps, units)`, and the two last states."""
        if not self._is_standard or mask is not None:
            return super().inner_loop(sequences, initial_state, mask, training)
        cell = self.cell
        from_input, from_state, bias = (
            ops.convert_to_tensor(weight) for weight in (cell.kernel, cell.recurrent_kernel, cell.bias)
        )
        # PyTorch adds a second bias, of the recurrence.
        weights = [from_input.T.contiguous(), from_state.T.contiguous(), bias, torch.zeros_like(bias)]
        outputs, *states = torch.lstm(
            sequences,
            [state[None] for state in initial_state],
            weights,
            has_biases=True,
            num_layers=1,
            dropout=0.0,
            train=torch.is_grad_enabled(),
            bidirectional=False,
            batch_first=True,
        )
        return outputs[:, -1], outputs, [state[0] for state in states]

    @property
    def _is_standard(self) -> bool:
        functions = (self.activation, self.recurrent_activation)
        return (
            functions == (keras.activations.tanh, keras.activations.sigmoid)
            and self.use_bias
            and not (self.go_backwards or self.dropout or self.recurrent_dropout)
        )


def with_torch_lstm(model: keras.Model) -> keras.Model:
    """Return a copy of a functional model, of the same weights in the same order, its LSTMs run by `TorchLSTM`."""

    def copied(layer: keras.layers.Layer) -> keras.layers.Layer:
        kind = TorchLSTM if type(layer) is keras.layers.LSTM else type(layer)
        return kind.from_config(layer.get_config())

    copy = keras.models.clone_model(model, clone_function=copied)
    copy.set_weights(model.get_weights())
    return copy
