"""The pretrained models on the command line: any standard linear solid, and bands."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

from surrogate.cli.answer import USUAL_MODULUS_RATIO, Answer, asked_protocols

if TYPE_CHECKING:
    from surrogate.pretrained.model import Pretrained

RATIO = "modulus_ratio"


def predict_solids(
    model: Pretrained,
    table: Any,
    options: dict[str, float | None],
    modulus_ratio: float | None,
    coverage: float | None,
) -> Answer:
    """Predict protocols on standard linear solids, with bands.

    Args:
        model: `fast` or `accurate`.
        table: The content of the input file, if there is one.
        options: Protocol of the options, by name.
        modulus_ratio: That of all protocols, unless the file has a column of it; 0.1 by default.
        coverage: Share of true values that the bands are to contain, 0.9 by default.

    Raises:
        ValueError: the file holds a history, the modulus ratio is given twice, or numbers are out of bounds.
    """
    import numpy as np

    from surrogate.inference.validity import ExtrapolationWarning

    if table is not None and table.is_history:
        raise ValueError(
            f"Expected protocols, since {model.name} computes at measurement steps of its own; models of the paper "
            f"such as M1-concat take histories. Received: the history {table.path}"
        )
    protocols, tabor = asked_protocols(table, options)
    column = None if table is None else table.columns.get(RATIO)
    if column is not None and modulus_ratio is not None:
        raise ValueError(
            f"Expected modulus ratios from --in FILE or from --modulus-ratio, not both. Received: {modulus_ratio!r} "
            f"and a column {RATIO} in {table.path}"
        )
    usual = USUAL_MODULUS_RATIO if modulus_ratio is None else modulus_ratio
    ratios = np.full(len(protocols), usual) if column is None else column
    with warnings.catch_warnings():
        # The command says it for each trajectory.
        warnings.simplefilter("ignore", ExtrapolationWarning)
        found = model.trajectories(
            protocols, tabor=tabor, modulus_ratio=ratios, coverage=0.9 if coverage is None else coverage
        )
    known = ratios.tolist()
    return Answer(protocols, tabor, found, found, found, known, known)


def require_one_material(name: str, table: Any, coverage: float | None) -> None:
    """Check that nothing was given that only the pretrained models take.

    Raises:
        ValueError: a column of modulus ratios, or a coverage.
    """
    if table is not None and not table.is_history and RATIO in table.columns:
        raise ValueError(
            f"Expected protocols without {RATIO}, since {name} knows one material; accurate and fast know any "
            f"standard linear solid. Received: a column {RATIO} in {table.path}"
        )
    if coverage is not None:
        raise ValueError(
            f"Expected --coverage with a model that has bands, accurate or fast. Received: --coverage {coverage:g} "
            f"with {name}"
        )
