"""How far the solver and the laboratory can be trusted: extremes, soaks, revisions, known results, intervals."""
