"""Studies that train models, and what training costs."""
