"""Figures of the paper's main text, one module each."""
