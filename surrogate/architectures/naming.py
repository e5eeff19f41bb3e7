"""Names of the models, FAMILY-CONDITIONING, and the table of their families. This module does not import Keras."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from bem._support.wording import listed, shown

if TYPE_CHECKING:
    import keras

CONDITIONINGS = ("concat", "FiLM", "gated")
"""Ways to include the Tabor parameter (`surrogate.architectures.layers`)."""


class Source(NamedTuple):
    """Name of a file, without its folder, and SHA-256 sum of its content."""

    name: str
    sha256: str


class Family(NamedTuple):
    """A family of models: one architecture, in its conditionings."""

    description: str
    builder: str | Callable[..., keras.Model] = ""
    """The function that builds the models if it is registered, otherwise its name, which is that of its module too."""
    parameters: tuple[int, ...] = ()
    """Numbers of trainable parameters with feature set D, one for each conditioning."""
    conditionings: tuple[str, ...] = CONDITIONINGS
    source: Source | None = None
    """The file that registered the family; `None` for those of this package, or without a file."""


FAMILIES: dict[str, Family] = {
    "M1": Family("two LSTM layers", "m1_lstm", (473_729, 489_473, 144_899)),
    "M2": Family("two LSTM layers with layer normalisation", "m2_normalised_lstm", (474_497, 490_241, 473_859)),
    "M3": Family("causal convolutions, then an LSTM layer", "m3_convolutional_lstm", (165_633, 182_209, 166_083)),
    "M4": Family("temporal convolutional network", "m4_tcn", (228_993, 245_697, 229_315)),
    "M5": Family("transformer encoder", "m5_encoder", (669_569, 686_209, 670_083)),
    "M6": Family("residual LSTM layers", "m6_residual_lstm", (340_353, 356_609, 340_227)),
}
"""All families; `surrogate.register` adds to them. A test compares the numbers of parameters with Keras's."""

PAPER_FAMILIES = ("M1", "M2", "M3", "M4", "M5", "M6")
"""Families that the paper compares. Figures and tables of the paper show no others."""

PARAMETER_COUNTS: dict[str, int] = {
    f"{name}-{conditioning}": count
    for name, family in FAMILIES.items()
    for conditioning, count in zip(family.conditionings, family.parameters, strict=True)
}
"""Numbers of trainable parameters of the models of this package, with feature set D."""

PAPER_PARAMETER_COUNTS: dict[str, int] = {
    name: count for name, count in PARAMETER_COUNTS.items() if name.startswith(("M1-", "M4-"))
}
"""Those of them that the paper states. The others follow from the descriptions in the paper, as
`docs/surrogate-models.md` explains."""


def names() -> list[str]:
    """Return the model names, family by family: the 18 paper models, then those of registered families."""
    return [f"{name}-{conditioning}" for name, family in FAMILIES.items() for conditioning in family.conditionings]


def paper_names() -> list[str]:
    """Return the names of the 18 paper models, family by family."""
    return [f"{family}-{conditioning}" for family in PAPER_FAMILIES for conditioning in CONDITIONINGS]


def split_name(name: str) -> tuple[str, str]:
    """Split a model name into family and conditioning.

    Raises:
        ValueError: the name is unknown; the message lists the known ones.
    """
    if name not in names():
        raise ValueError(f"name must be one of {listed(names(), name)}; received {shown(name)}")
    family, _, conditioning = name.rpartition("-")
    return family, conditioning


def is_registered(name: str) -> bool:
    """Return whether a model is of a registered family, not of this package; errors as of `split_name`."""
    return callable(FAMILIES[split_name(name)[0]].builder)
