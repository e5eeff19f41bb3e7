"""Many trajectories at once: plan, work, checkpoints, executors, merging."""
