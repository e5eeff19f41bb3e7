"""What every part of the package leans on: validation, wording, compilation, small linear algebra, whole files."""
