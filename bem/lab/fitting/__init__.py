"""Fit measured force curves: what a curve determines, which model describes it, and how well."""

from bem.lab.fitting.curve_fit import fit
from bem.lab.fitting.measurement import guess_setup
from bem.lab.fitting.result import FitError, FitResult

__all__ = ["FitError", "FitResult", "fit", "guess_setup"]
