"""The solver and other software on problems that both solve."""
