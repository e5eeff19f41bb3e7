"""Figures of the trained models: architectures, learning curves, inputs, errors and ranking, one module each."""
