"""The curve of equilibria of an elastic contact."""
