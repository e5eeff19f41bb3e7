"""Studies behind the paper's figures and tables, and behind the report."""
