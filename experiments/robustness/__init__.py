"""Difficult cases of the solver and of the models: extremes, random scenes, and maps of errors."""
