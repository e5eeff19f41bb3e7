"""Studies of `bem.lab`: how reliable its fits are, and what its units are for real instruments."""
