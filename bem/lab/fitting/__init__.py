"""Fit a setup to a measured force curve: the model of the curve, the search, and the result with its intervals."""

from bem.lab.fitting.curve_fit import ALL, ELASTIC, fit
from bem.lab.fitting.result import FitError, FitResult

__all__ = ["ALL", "ELASTIC", "FitError", "FitResult", "fit"]
