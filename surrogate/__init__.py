"""Sequence models that predict the force history of the contact solver from the indentation history.

`"fast"` and `"accurate"` predict protocols on any standard linear solid, with bands. The 18 paper models, six families
with three conditionings on the Tabor parameter each, are named ``"M1-concat"`` to ``"M6-gated"``. All quantities are
dimensionless as in the paper; forces are positive in tension.

Examples:
    >>> import surrogate
    >>> surrogate.names()[:3]
    ['M1-concat', 'M1-FiLM', 'M1-gated']
    >>> surrogate.build("M1-concat").count_params()
    473729

The import of this package is quick: the first call that needs Keras imports it.
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

_PRETRAINED = ("fast", "accurate")


def build(name: str, features: str = "D") -> keras.Model:
    """Return an untrained model: one of the 18 paper models, or one of a registered family.

    Source: the paper's section "DL Models' architecture" and its appendices on architectures and layers.

    Args:
        name: One of `names()`, such as `"M1-concat"`.
        features: Feature set of the sequence input, `"A"` to `"F"` (see `surrogate.data.features`).

    Returns:
        A functional model with two scaled inputs, `sequence` of shape `(batch, steps, channels)` and `tabor` of shape
        `(batch, 1)`. The output is the scaled force of shape `(batch, steps, 1)`.

    Raises:
        ModuleNotFoundError: Keras is not installed.
        ValueError: the name or the feature set is unknown; the message lists the known ones.
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
    """Load a trained model.

    Args:
        name: `"fast"` or `"accurate"`, which know any standard linear solid and their own uncertainty; name of a
            published model, path of a model directory that `surrogate train` wrote, or path of an ONNX file that
            `surrogate export` wrote.
        root: Directory that is searched for names. By default `published/models` of the repository, then
            `published/models` of the working directory, then the models packaged with an installation.
        backend: `"onnx"`, which starts quickly and needs no deep-learning framework, or `"keras"`, whose model can be
            differentiated.
        threads: Number of threads of ONNX Runtime. The environment determines the threads of Keras.

    Returns:
        A `Surrogate`. Its `predict(times, indentations, tabor=...)` returns forces, `trajectories(protocols,
        tabor=...)` returns trajectories, and `stream(tabor=...)` starts a step-by-step prediction.
        Of `"fast"` and `"accurate"`, a `surrogate.pretrained.model.Pretrained`, whose `trajectories(protocols,
        tabor=..., modulus_ratio=..., coverage=0.9)` returns trajectories with bands.

    Raises:
        FileNotFoundError: the model directory or one of its files does not exist.
        ModuleNotFoundError: Keras is not installed, and the backend is `"keras"`.
        ValueError: the name or the backend is unknown, a file is damaged, the weights do not fit the model or are not
            finite, or the ONNX file was exported from other weights or with another scaling.
    """
    if isinstance(name, str) and name in _PRETRAINED:
        from surrogate.pretrained.model import Pretrained, find

        if backend != "onnx":
            raise ValueError(f"Expected the backend 'onnx' for {name}. Received: backend={backend!r}")
        return Pretrained(find(name, root), threads)

    from surrogate.inference.predictor import Surrogate

    return Surrogate.load(name, root=root, backend=backend, threads=threads, also=_PRETRAINED)


# A type checker uses the imports above instead, so that it reports unknown names.
if not TYPE_CHECKING:

    def __getattr__(attribute: str) -> object:
        if attribute in ("Surrogate", "ExtrapolationWarning"):
            from surrogate.inference import predictor

            return getattr(predictor, attribute)
        raise AttributeError(f"module 'surrogate' has no attribute {attribute!r}")
