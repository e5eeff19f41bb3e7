"""Several trainings of one model: which belong together, which are missing, and what they show about the ranking."""
