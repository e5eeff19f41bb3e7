"""The regions of the protocols by which errors are listed."""

from itertools import pairwise

import numpy as np

EDGES = {
    "tabor": ("Tabor parameter", (0.2, 1.0, 2.0, 3.2)),
    "unloading_rate": ("Unloading rate", (0.1, 10.0, 100.0, 1000.0)),
    "peak_indentation": ("Peak indentation", (2.0, 20.0, 50.0, 100.0)),
    "modulus_ratio": ("Modulus ratio", (0.01, 0.1, 1.0)),
}
"""Quantities that divide the protocols: their names, and the bounds of their regions."""


def regions(quantities: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Divide protocols by each quantity in turn.

    Args:
        quantities: Of the protocols, each of shape (n,). One that is missing, or the same for all, divides nothing.

    Returns:
        Which protocols belong to each region, of shape (n,), by its name, such as "Tabor parameter 0.2 to 1"; first
        "all". Regions without any are left out.
    """
    found = {"all": np.ones(len(next(iter(quantities.values()))), dtype=bool)}
    for name, (words, edges) in EDGES.items():
        values = quantities.get(name)
        if values is None or np.ptp(values) == 0.0:
            continue
        # Corners of the paper's design lie a little outside its stated range.
        place = np.digitize(values, edges[1:-1])
        found |= {f"{words} {low:g} to {high:g}": place == i for i, (low, high) in enumerate(pairwise(edges))}
    return {words: rows for words, rows in found.items() if rows.any()}
