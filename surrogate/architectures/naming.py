"""Names of the models, FAMILY-CONDITIONING, and their numbers of parameters. This module does not import Keras."""

from __future__ import annotations

from bem._support.wording import shown

FAMILIES: dict[str, str] = {
    "M1": "two LSTM layers",
    "M2": "two LSTM layers with layer normalisation",
    "M3": "causal convolutions, then an LSTM layer",
    "M4": "temporal convolutional network",
    "M5": "transformer encoder",
    "M6": "residual LSTM layers",
}
"""Families and their descriptions; `surrogate.register` adds to them."""

PAPER_FAMILIES = ("M1", "M2", "M3", "M4", "M5", "M6")
"""Families that the paper compares. Figures and tables of the paper show no others."""

CONDITIONINGS = ("concat", "FiLM", "gated")
"""Ways to include the Tabor parameter (`surrogate.architectures.layers`)."""

CONDITIONINGS_OF: dict[str, tuple[str, ...]] = {}
"""Conditionings of registered families; all other families have all three."""

PAPER_PARAMETER_COUNTS: dict[str, int] = {
    "M1-concat": 473_729,
    "M1-FiLM": 489_473,
    "M1-gated": 144_899,
    "M4-concat": 228_993,
    "M4-FiLM": 245_697,
    "M4-gated": 229_315,
}
"""Numbers of trainable parameters that the paper states. The others follow from the descriptions in the paper, as
`docs/surrogate-models.md` explains."""

PARAMETER_COUNTS: dict[str, int] = {
    **PAPER_PARAMETER_COUNTS,
    "M2-concat": 474_497,
    "M2-FiLM": 490_241,
    "M2-gated": 473_859,
    "M3-concat": 165_633,
    "M3-FiLM": 182_209,
    "M3-gated": 166_083,
    "M5-concat": 669_569,
    "M5-FiLM": 686_209,
    "M5-gated": 670_083,
    "M6-concat": 340_353,
    "M6-FiLM": 356_609,
    "M6-gated": 340_227,
}
"""Numbers of trainable parameters of the 18 paper models with feature set D; a test compares them with Keras's."""


def names() -> list[str]:
    """Return the model names, family by family: the 18 paper models, then those of registered families."""
    return [
        f"{family}-{conditioning}"
        for family in FAMILIES
        for conditioning in CONDITIONINGS_OF.get(family, CONDITIONINGS)
    ]


def paper_names() -> list[str]:
    """Return the names of the 18 paper models, family by family."""
    return [f"{family}-{conditioning}" for family in PAPER_FAMILIES for conditioning in CONDITIONINGS]


def split_name(name: str) -> tuple[str, str]:
    """Split a model name into family and conditioning.

    Raises:
        ValueError: the name is unknown; the message lists the known ones.
    """
    if name not in names():
        raise ValueError(f"Unknown model name. Expected one of {', '.join(names())}. Received: name={shown(name)}")
    family, _, conditioning = name.rpartition("-")
    return family, conditioning
