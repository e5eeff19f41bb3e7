"""Figures of cost, robustness and effects, one module each."""
