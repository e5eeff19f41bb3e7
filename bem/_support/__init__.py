"""Shared by all parts of the package: validation, wording, compilation, small linear algebra, whole files."""
