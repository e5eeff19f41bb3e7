"""Code shared by all figures and tables."""
