"""What each physical effect costs, and how `recommend` keeps its promise."""
