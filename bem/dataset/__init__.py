"""Measurement steps, sampling designs, and the HDF5 file of many trajectories."""
