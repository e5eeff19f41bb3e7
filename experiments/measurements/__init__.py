"""What accuracy costs: one harness, its tools and cases, and the questions about solver and effects."""
