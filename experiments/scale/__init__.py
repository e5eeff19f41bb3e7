"""What campaigns cost besides the trajectories, and how far they scale."""
