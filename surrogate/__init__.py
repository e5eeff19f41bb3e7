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
from types import ModuleType
from typing import TYPE_CHECKING

from bem._support.lazy_names import lazy_names

if TYPE_CHECKING:
    from surrogate.architectures import build as build
    from surrogate.architectures.naming import names as names
    from surrogate.architectures.registry import register as register
    from surrogate.loading import load as load
    from surrogate.model import Surrogate as Surrogate
    from surrogate.validity import ExtrapolationWarning as ExtrapolationWarning
else:  # the imports above are the list of the names that load on first use
    lazy_names(globals())

__all__ = ["ExtrapolationWarning", "Surrogate", "build", "load", "names", "register"]


class _KerasImport(importlib.abc.MetaPathFinder):
    """Registers the layers of this package once Keras is imported, so that `keras.saving.load_model` knows them.

    Keras takes a class of another package only if it is registered; the package does not wait for Keras to be imported.
    """

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return the specification of Keras, extended by the registration; `None` for other modules."""
        spec = importlib.machinery.PathFinder.find_spec(name, path, target) if name == "keras" else None
        if spec is None or spec.loader is None:
            return None
        run = spec.loader.exec_module

        def run_and_register(module: ModuleType) -> None:
            run(module)
            _register_layers()

        spec.loader.exec_module = run_and_register  # type: ignore[method-assign]
        return spec


def _register_layers() -> None:
    importlib.import_module("surrogate.architectures.layers")


if "keras" in sys.modules:
    _register_layers()
else:
    sys.meta_path.insert(0, _KerasImport())
