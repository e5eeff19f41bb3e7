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

import importlib
import importlib.abc
import importlib.machinery
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from bem._support.lazy_names import lazy_names

if TYPE_CHECKING:
    import keras

    from surrogate.architectures.naming import names as names
    from surrogate.architectures.registry import register as register
    from surrogate.prediction.predictor import Surrogate as Surrogate
    from surrogate.prediction.validity import ExtrapolationWarning as ExtrapolationWarning
else:  # the imports above are the list of the names that load on first use
    lazy_names(globals())

__all__ = ["ExtrapolationWarning", "Surrogate", "build", "load", "names", "register"]


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


def load(name: str | Path, root: str | Path | None = None, *, backend: str = "onnx", threads: int = 1) -> Surrogate:
    """Load a trained model.

    Args:
        name: `"fast"` or `"accurate"`, which know any standard linear solid and their own uncertainty; name of a
            published model, path of a model directory that `surrogate train` wrote, or path of an ONNX file that
            `surrogate export` wrote.
        root: Directory that is searched for names. By default `published` of the repository, then `published` of the
            working directory, then the models packaged with an installation.
        backend: `"onnx"`, which starts quickly and needs no deep-learning framework, or `"keras"`, whose model can be
            differentiated.
        threads: Number of threads of ONNX Runtime. The environment determines the threads of Keras.

    Returns:
        A `Surrogate`. Its `predict(scene, protocol)` returns a trajectory, or a list of them for many, of `"fast"` and
        `"accurate"` with bands; `predict_history(times, indentations, scene)` returns forces; and `stream(scene)`
        starts a step-by-step prediction.

    Raises:
        FileNotFoundError: the model directory or one of its files does not exist.
        ModuleNotFoundError: Keras is not installed, and the backend is `"keras"`.
        ValueError: the name or the backend is unknown, a file is damaged, the weights do not fit the model or are not
            finite, or the ONNX file was exported from other weights or with another scaling.
    """
    from surrogate.prediction import loading

    return loading.load(name, root, backend=backend, threads=threads)


class _KerasImport(importlib.abc.MetaPathFinder):
    """Registers the layers of this package once Keras is imported, so that `keras.saving.load_model` knows them.

    Keras takes a class of another package only if it is registered; the package does not wait for Keras to be imported.
    """

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return the specification of Keras, extended by the registration; `None` for other modules."""
        found = importlib.machinery.PathFinder.find_spec(name, path, target) if name == "keras" else None
        if found is None or found.loader is None:
            return None
        run = found.loader.exec_module

        def run_and_register(module: ModuleType) -> None:
            run(module)
            importlib.import_module("surrogate.architectures.layers")

        found.loader.exec_module = run_and_register  # type: ignore[method-assign]
        return found


if "keras" in sys.modules:
    importlib.import_module("surrogate.architectures.layers")
else:
    sys.meta_path.insert(0, _KerasImport())
