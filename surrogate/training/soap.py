"""The optimizer SOAP: Adam in the eigenbasis of Shampoo's preconditioner. The recipe `swift` uses it.

Source: N. Vyas, D. Morwani, R. Zhao, I. Shapira, D. Brandfonbrener, L. Janson and S. Kakade, "SOAP: Improving and
Stabilizing Shampoo using Adam", arXiv:2409.11321, algorithm 3.

For a matrix of weights with gradient G, the bases are the eigenvectors of the moving averages of G G^T and of G^T G.
SOAP rotates the gradient into these bases, takes Adam's step there, and rotates the step back. The bases change slowly,
so one orthogonal iteration every few steps is enough to follow them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import keras
from keras import ops

WIDEST = 1024
"""Longest side of a matrix that is rotated. Eigenvectors of a longer side would cost more than the rest of the step."""


@dataclass(frozen=True)
class _Blocks:
    """View of a variable as a stack of matrices of shape `(count, rows, columns)`.

    The kernel of an LSTM is a stack of the matrices of its four gates. The kernel of a query, key or value is a stack
    of the matrices of the heads. Every other kernel is one matrix, from all inputs to all outputs.
    """

    count: int
    rows: int
    columns: int
    shape: tuple[int, ...]

    @classmethod
    def of(cls, variable: Any) -> _Blocks | None:
        shape = tuple(variable.shape)
        if len(shape) < 2:
            return None
        if "lstm_cell" in variable.path:
            return cls(4, shape[0], shape[1] // 4, shape)
        if any(f"/{name}/kernel" in variable.path for name in ("query", "key", "value")):
            return cls(shape[1], shape[0], shape[2], shape)
        return cls(1, math.prod(shape[:-1]), shape[-1], shape)

    def split(self, tensor: Any) -> Any:
        return ops.transpose(ops.reshape(tensor, (self.rows, self.count, self.columns)), (1, 0, 2))

    def join(self, stack: Any) -> Any:
        return ops.reshape(ops.transpose(stack, (1, 0, 2)), self.shape)


class _Basis(NamedTuple):
    """Moving average of the gradient products of one side, and its approximate eigenvectors: `(count, side, side)`."""

    products: Any
    vectors: Any


@keras.saving.register_keras_serializable(package="surrogate")
class Soap(keras.optimizers.Optimizer):
    """Keras optimizer: SOAP for matrices, Adam for vectors.

    Args:
        learning_rate: A float or a learning-rate schedule of Keras.
        beta_1: Decay rate per step of the moving average of the gradient.
        beta_2: Decay rate per step of the moving averages of squares and gradient products.
        basis_every: Number of steps between two updates of the eigenbases.
        epsilon: Constant added to the square root of the mean squares.
        name: Name of the optimizer.
        **kwargs: Arguments of every Keras optimizer, such as `global_clipnorm` and `use_ema`.
    """

    def __init__(
        self,
        learning_rate: Any = 3e-3,
        beta_1: float = 0.95,
        beta_2: float = 0.95,
        basis_every: int = 10,
        epsilon: float = 1e-8,
        name: str = "soap",
        **kwargs: Any,
    ) -> None:
        super().__init__(learning_rate=learning_rate, name=name, **kwargs)
        self.beta_1, self.beta_2 = beta_1, beta_2
        self.basis_every, self.epsilon = basis_every, epsilon

    def build(self, variables: list[Any]) -> None:
        """Create the state: two moments of each variable, and the bases of both sides of each matrix."""
        if self.built:
            return
        super().build(variables)
        self._blocks = [_Blocks.of(variable) for variable in variables]
        self._means = [self.add_variable_from_reference(variable, name="mean") for variable in variables]
        self._squares, self._bases = [], []
        for variable, blocks in zip(variables, self._blocks, strict=True):
            shape = (blocks.count, blocks.rows, blocks.columns) if blocks else variable.shape
            self._squares.append(self.add_variable(shape, "zeros", name="squares"))
            sides = (blocks.rows, blocks.columns) if blocks else ()
            self._bases.append([self._basis(blocks.count, side) if 1 < side <= WIDEST else None for side in sides])

    def _basis(self, count: int, side: int) -> _Basis:
        vectors = self.add_variable((count, side, side), "zeros", name="vectors")
        vectors.assign(ops.tile(ops.eye(side)[None], (count, 1, 1)))
        return _Basis(self.add_variable((count, side, side), "zeros", name="products"), vectors)

    def update_step(self, gradient: Any, variable: Any, learning_rate: Any) -> None:
        """Update one variable."""
        index = self._get_variable_index(variable)
        blocks, mean, squares = self._blocks[index], self._means[index], self._squares[index]
        step = ops.cast(self.iterations + 1, variable.dtype)
        unbias = ops.sqrt(1 - ops.power(self.beta_2, step)) / (1 - ops.power(self.beta_1, step))
        rate = ops.cast(learning_rate, variable.dtype) * unbias
        self._average(mean, gradient, self.beta_1)
        if blocks is None:
            self._average(squares, ops.square(gradient), self.beta_2)
            self.assign_sub(variable, rate * mean / (ops.sqrt(squares) + self.epsilon))
            return

        left, right = bases = self._bases[index]
        gradient = blocks.split(gradient)
        self._average(squares, ops.square(_rotate(gradient, bases)), self.beta_2)
        move = _rotate(blocks.split(mean), bases) / (ops.sqrt(squares) + self.epsilon)
        self.assign_sub(variable, rate * blocks.join(_rotate(move, bases, back=True)))
        if left:
            self._average(left.products, ops.matmul(gradient, _transposed(gradient)), self.beta_2)
        if right:
            self._average(right.products, ops.matmul(_transposed(gradient), gradient), self.beta_2)
        if filled := [basis for basis in bases if basis]:
            self._refine(filled)

    def _average(self, average: Any, value: Any, decay: float) -> None:
        self.assign_add(average, (1 - decay) * (value - average))

    def _refine(self, bases: list[_Basis]) -> None:
        """Update the eigenvectors by one orthogonal iteration, once in `basis_every` steps."""
        refined = ops.cond(
            ops.equal(ops.mod(self.iterations, self.basis_every), 0),
            lambda: tuple(ops.qr(ops.matmul(basis.products, basis.vectors))[0] for basis in bases),
            lambda: tuple(ops.convert_to_tensor(basis.vectors) for basis in bases),
        )
        for basis, vectors in zip(bases, refined, strict=True):
            self.assign(basis.vectors, vectors)

    def get_config(self) -> dict[str, Any]:
        """Return the arguments of the constructor."""
        own = ("beta_1", "beta_2", "basis_every", "epsilon")
        return {**super().get_config(), **{name: getattr(self, name) for name in own}}


def _transposed(stack: Any) -> Any:
    return ops.transpose(stack, (0, 2, 1))


def _rotate(stack: Any, bases: list[_Basis | None], back: bool = False) -> Any:
    """Turn matrices into the bases of their two sides, or back; a side without a basis stays."""
    left, right = bases
    if left:
        stack = ops.matmul(left.vectors if back else _transposed(left.vectors), stack)
    if right:
        stack = ops.matmul(stack, _transposed(right.vectors) if back else right.vectors)
    return stack
