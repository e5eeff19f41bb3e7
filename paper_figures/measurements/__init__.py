"""Figures and tables of the measurements: cost, robustness and effects."""
