"""What accuracy costs: solver, closed forms and surrogates on the same protocols, and when a surrogate pays."""
