"""Elastic contacts at large Tabor parameters: the curve of their equilibria, and trajectories read off it."""
