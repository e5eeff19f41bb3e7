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

from typing import TYPE_CHECKING

from bem._support.lazy_names import lazy_names

if TYPE_CHECKING:
    from surrogate.architectures import build as build
    from surrogate.architectures.naming import names as names
    from surrogate.architectures.registry import register as register
    from surrogate.loading import load as load
    from surrogate.model import Surrogate as Surrogate
    from surrogate.training.interface import train as train
    from surrogate.validity import ExtrapolationWarning as ExtrapolationWarning
else:  # the imports above are the list of the names that load on first use
    lazy_names(globals())

__all__ = ["ExtrapolationWarning", "Surrogate", "build", "load", "names", "register", "train"]
