"""Where the solver and the models work hard: extremes, random scenes, maps of errors."""
