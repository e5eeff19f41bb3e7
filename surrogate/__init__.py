"""Sequence models that imitate the contact solver: the whole force history from an indentation history.

`"fast"` and `"accurate"` predict protocols on any standard linear solid, with bands. The 18 paper models, six families
times three ways to include the Tabor parameter, are named ``"M1-concat"`` to ``"M6-gated"``. All quantities are
dimensionless as in the paper; forces are positive in tension.

Example:
    >>> import surrogate
    >>> surrogate.names()[:3]
    ['M1-concat', 'M1-FiLM', 'M1-gated']
    >>> surrogate.build("M1-concat").count_params()
    473729

Importing this package is quick: keras is imported by the first call that needs it.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, overload

from surrogate.architectures.naming import names
from surrogate.architectures.registry import register

if TYPE_CHECKING:
    import keras

    from surrogate.inference.predictor import Surrogate
    from surrogate.inference.validity import ExtrapolationWarning
    from surrogate.pretrained.model import Pretrained

__all__ = ["ExtrapolationWarning", "Surrogate", "build", "load", "names", "register"]


def build(name: str, features: str = "D") -> keras.Model:
    """Build one of the 18 paper models, or a model of a registered family, untrained.

    Args:
        name: One of `names()`, such as `"M1-concat"`.
        features: Feature set of the sequence input, `"A"` to `"F"` (see `surrogate.data.features`).

    Returns:
        A functional model of two inputs, `sequence` of shape `(batch, steps, channels)` and `tabor` of shape
        `(batch, 1)`, both scaled; its output is the scaled force of shape `(batch, steps, 1)`.

    Raises:
        ValueError: for an unknown name or feature set; the message lists the known ones.
    """
    from surrogate.architectures import build as build_model

    return build_model(name, features=features)


@overload
def load(  # type: ignore[overload-overlap]  # a name is one or the other
    name: Literal["fast", "accurate"], root: str | Path | None = None, *, backend: str = "onnx", threads: int = 1
) -> Pretrained: ...
@overload
def load(name: str | Path, root: str | Path | None = None, *, backend: str = "onnx", threads: int = 1) -> Surrogate: ...
def load(
    name: str | Path, root: str | Path | None = None, *, backend: str = "onnx", threads: int = 1
) -> Surrogate | Pretrained:
    """Load a trained model, ready to predict forces.

    Args:
        name: `"fast"` or `"accurate"`, which know any standard linear solid and their own uncertainty; a published
            model's name, the path of a directory written by `surrogate train`, or an ONNX file written by
            `surrogate export`.
        root: The directory searched for names. By default `published/models` beside the package, then the models
            packaged with it.
        backend: `"onnx"`, which starts quickly and needs no learning framework, or `"keras"`, whose model can be
            differentiated.
        threads: Threads of ONNX Runtime; Keras takes what its environment says.

    Returns:
        A `Surrogate`: `predict(times, indentations, tabor=...)` returns forces, `trajectories(protocols, tabor=...)`
        trajectories, `stream(tabor=...)` a step-by-step prediction. Of `"fast"` and `"accurate"`, a
        `surrogate.pretrained.model.Pretrained`: `trajectories(protocols, tabor=..., modulus_ratio=..., coverage=0.9)`
        returns trajectories with bands.

    Raises:
        FileNotFoundError: no such directory, or a file is missing from it.
        ValueError: the weights do not fit the model or are not finite, weights or scaling are not those the ONNX file
            beside them was exported with, or that file is not one of ours, as it was written.
    """
    if isinstance(name, str) and name in ("fast", "accurate"):
        from surrogate.pretrained.model import Pretrained, find

        if backend != "onnx":
            raise ValueError(f"Expected the backend 'onnx' for {name}. Received: backend={backend!r}")
        return Pretrained(find(name, root), threads)

    from surrogate.inference.predictor import Surrogate

    return Surrogate.load(name, root=root, backend=backend, threads=threads)


# A type checker reads the imports above instead, and then refuses a name that is none.
if not TYPE_CHECKING:

    def __getattr__(attribute: str) -> object:
        if attribute in ("Surrogate", "ExtrapolationWarning"):
            from surrogate.inference import predictor

            return getattr(predictor, attribute)
        raise AttributeError(f"module 'surrogate' has no attribute {attribute!r}")
