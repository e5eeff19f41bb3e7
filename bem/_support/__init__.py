"""Shared by all parts of the package: validation, wording, output files, progress, command lines."""
