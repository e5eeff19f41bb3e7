"""Studies of `bem.lab`: how reliable its fits are, and its units for real instruments."""
