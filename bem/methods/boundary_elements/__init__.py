"""Boundary elements with memory and time steps, for every scene."""
