"""Sequence models that predict the force history of the contact solver from the indentation history.

`"fast"` and `"accurate"` predict protocols on any linear solid, with intervals. The 18 paper models, six families
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

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)  # of the names in __init__.pyi
