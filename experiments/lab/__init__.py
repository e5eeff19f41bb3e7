"""Studies of `bem.lab`: what its fits are worth, and what its units mean for real instruments."""
