"""Studies behind the paper's figures and tables."""
