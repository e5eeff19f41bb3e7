"""What several trainings of one model say together, and which trainings belong together."""
