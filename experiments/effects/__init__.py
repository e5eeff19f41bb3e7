"""What each physical effect costs, and how often `recommend` meets its tolerance."""
