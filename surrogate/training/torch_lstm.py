"""PyTorch's LSTM operator for training under the PyTorch backend, where Keras steps through the sequence in Python.

The operator is fused on a CPU (oneDNN) and on a GPU (cuDNN). From the same weights it computes the same as
`keras.layers.LSTM` up to rounding: the four gates have Keras's order, and the matrices are transposed. Models are built
and published with Keras's layer; only the copy that is trained has this layer.
"""

from __future__ import annotations

from typing import Any

import keras
from keras import ops


class TorchLSTM(keras.layers.LSTM):
    """`keras.layers.LSTM` computed by `torch.lstm`.

    A layer that runs backwards, has dropout, a mask, no bias, or activations other than tanh and sigmoid is left to
    Keras.
    """

    def inner_loop(self, sequences: Any, initial_state: list, mask: Any, training: bool = False) -> tuple:
        """Return the last output, all outputs of shape `(batch, steps, units)`, and the two final states.

        The last output and each state have the shape `(batch, units)`.
        """
        if not self._is_standard or mask is not None:
            return super().inner_loop(sequences, initial_state, mask, training)
        import torch

        cell = self.cell
        from_input, from_state, bias = (
            ops.convert_to_tensor(weight) for weight in (cell.kernel, cell.recurrent_kernel, cell.bias)
        )
        # PyTorch has a second bias for the recurrent part; Keras has not.
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


def with_fused_lstm(model: keras.Model) -> keras.Model:
    """Return the functional model to train.

    Under PyTorch it is a copy with `TorchLSTM` layers and the same weights in the same order, under other backends the
    model itself.
    """
    if keras.backend.backend() != "torch":
        return model

    def copied(layer: keras.layers.Layer) -> keras.layers.Layer:
        layer_class = TorchLSTM if type(layer) is keras.layers.LSTM else type(layer)
        return layer_class.from_config(layer.get_config())

    copy = keras.models.clone_model(model, clone_function=copied)
    copy.set_weights(model.get_weights())
    return copy
