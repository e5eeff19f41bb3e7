"""Fit a ladder of models to a measured force curve, and say with what intervals and what the curve contradicts."""

from bem.lab.fitting.curve_fit import fit
from bem.lab.fitting.measurement import guess_setup
from bem.lab.fitting.result import FitError, FitResult

__all__ = ["FitError", "FitResult", "fit", "guess_setup"]
