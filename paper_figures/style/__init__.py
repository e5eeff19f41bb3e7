"""What all figures and tables share."""
