"""The solver beside other software on problems that both solve."""
