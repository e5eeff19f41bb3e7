"""Studies of the paper and measurements of the software, each run by `python -m experiments NAME`."""
