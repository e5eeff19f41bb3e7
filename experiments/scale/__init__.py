"""What campaigns cost besides the trajectories, and where they stop growing."""
