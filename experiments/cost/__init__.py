"""What accuracy costs: the solver, the models and their training, timed."""
