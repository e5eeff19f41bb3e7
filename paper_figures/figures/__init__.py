"""Figures and tables of the paper, those that read the same results in one module."""
