"""Published viscoelastic materials with their sources, and functions that turn measurements into materials."""

from bem.materials_library.entries import Entry, load, names
from bem.materials_library.viscoelasticity import (
    PronyFit,
    complex_modulus,
    fit_prony,
    loss_modulus,
    relaxation_spectrum,
    shifted,
    storage_modulus,
    wlf_shift,
)

__all__ = [
    "Entry",
    "PronyFit",
    "complex_modulus",
    "fit_prony",
    "load",
    "loss_modulus",
    "names",
    "relaxation_spectrum",
    "shifted",
    "storage_modulus",
    "wlf_shift",
]
