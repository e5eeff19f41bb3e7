"""What a simulation returns, and its pictures."""
