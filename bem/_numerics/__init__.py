"""Small numerics that all packages share: compilation, dense systems, interpolation, peaks."""
