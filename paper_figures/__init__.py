"""One module for each table and figure of the paper: it reads results, draws and writes; it never computes."""
