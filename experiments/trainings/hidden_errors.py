"""Errors of trained models across measurement steps: pull-off force and hysteresis on hidden protocols.

Errors at measurement steps are not comparable between two kinds of steps, because each kind has other forces. The
solver's own pull-off force and hysteresis are the same for both. What a model predicts at its own steps is compared
with these, on protocols off the paper's grid that no training has seen, at the paper's modulus ratio. The solver's
forces at the steps, read in the same way, are the floor: no model of these steps is expected to be closer.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from experiments.common import MODULUS_RATIO, load_surrogate, scenes, without_extrapolation_warnings
from experiments.measurements.cases import Hidden, results_of
from experiments.measurements.statistics import quantiles
from experiments.surrogates.measurement_floor import KINDS, READINGS, errors, grid, reading_errors


def hidden_errors(folders: Mapping[str, tuple[Path, str]], count: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Errors of models on hidden protocols, in percent.

    Args:
        folders: Model directory and kind of measurement steps, `"uniform"` or `"physical"`, of each model.
        count: Number of hidden protocols.

    Returns:
        Count and quantiles of each of `READINGS` by model, and the same of the solver's forces by kind of steps.
    """
    hidden = Hidden.draw(count, MODULUS_RATIO)
    trajectories = list(hidden.simulated())
    grids = {kind: grid(kind, hidden.quantities) for kind in KINDS}

    def summary(found: np.ndarray) -> dict[str, Any]:
        return {"count": count} | {name: quantiles(values) for name, values in zip(READINGS, found, strict=True)}

    found = {}
    for name, (folder, kind) in folders.items():
        model = load_surrogate(folder.name, folder.parent)
        with without_extrapolation_warnings():
            force = model.predict_history(*grids[kind], scenes(hidden.quantities["tabor"]))
        found[name] = summary(reading_errors(*grids[kind], force, KINDS[kind], results_of(trajectories).T))
    floor = {kind: summary(errors(trajectories, *grids[kind], counts)) for kind, counts in KINDS.items()}
    return found, floor
