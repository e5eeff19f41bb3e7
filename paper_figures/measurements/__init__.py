"""Figures of the measurements: cost, robustness and effects, one module each."""
