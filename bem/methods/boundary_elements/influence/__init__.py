"""Displacement under overlapping triangles of traction."""
