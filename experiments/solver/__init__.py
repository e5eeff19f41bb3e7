"""The solver alone: its seconds and errors over accuracies, sizes of the problem and revisions."""
