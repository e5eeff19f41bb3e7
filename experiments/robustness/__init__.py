"""How far the solver and the laboratory can be trusted: extremes, soaks, known results, intervals."""
