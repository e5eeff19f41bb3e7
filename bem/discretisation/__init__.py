"""A contact in numbers: mesh that follows the edge, influence of overlapping triangles, width of the cohesive zone."""
