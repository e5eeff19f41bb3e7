"""Difficult cases of the solver and the models: extremes, random scenes, maps of errors."""
