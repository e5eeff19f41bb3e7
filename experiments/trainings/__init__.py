"""Studies that train models, what training costs, and which rankings of trained models hold."""
